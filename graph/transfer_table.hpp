#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "graph/request.hpp"

namespace edgewise {

/// Opacity and colour by the value and the length of its gradient, which distinguishes boundaries
/// from interiors: bilinear between the points of a grid, constant beyond it.
///
/// Levoy, "Display of surfaces from volume data", IEEE Computer Graphics and Applications 8(3),
/// 1988; Kindlmann and Durkin, "Semi-automatic generation of transfer functions for direct volume
/// rendering", Symposium on Volume Visualization 1998; Kniss, Kindlmann and Hansen, "Interactive
/// volume rendering using multi-dimensional transfer functions and direct manipulation widgets",
/// Visualization 2001.
struct TransferTable {
    static constexpr std::size_t kMostPlaces = 4096;    // along one axis
    static constexpr std::size_t kMostCells = 1 << 20;  // of all

    std::vector<double> values;     // ascending
    std::vector<double> gradients;  // ascending, at least 0 [value per file unit]
    std::vector<double> opacity;    // of each value, gradient by gradient: per Transfer::unit
    std::vector<std::array<double, 3>> color = {};  // the same; empty: those of Transfer::points
    /// The steepest that an opacity is by value; what completed() finds.
    double steepest = 0;

    /// Red, green, blue and opacity. Of a table that has colours.
    std::array<double, 4> at(double value, double gradient) const noexcept;
};

/// Why something is no table: which numbers, and what was expected; empty: it is one.
/// @param points  of the transfer function: where the table has no colours each may be a column
std::string no_table(const TransferTable& table, std::size_t points);

/// A transfer function whose table has colours, those of the points by value or white, and whose
/// points say what opacity each value has at most, whatever its gradient: who asks for opacities by
/// value alone learns what may be seen. Without a table it stays as it is.
Transfer completed(Transfer transfer);

/// The same over other values: `shift` + `scale` value, and gradients times `scale`.
/// @param scale  at least 0
void rescale(Transfer& transfer, double shift, double scale);

}  // namespace edgewise
