#pragma once

#include <array>
#include <cstdint>

#include "graph/small_objects.hpp"
#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// Integrals of a transfer function over stored numbers, in fixed point: differences of integers
/// are exact, so that what lies between two near numbers keeps its digits however much lies below
/// them.
///
/// Of each knot: the optical depth per t, integrated from the first knot to there, and the same
/// times red, green and blue. Knots are even, the first and the last cell beyond all points of the
/// function, where it is constant. They lie at multiples of a power of two, so that f32 finds the
/// place of a number between them without rounding. Between knots and beyond them the integrals go
/// evenly, by slopes that are not rounded to integers.
///
/// Error of an integral between two numbers: at each end width^2 / 8 times the slope of the
/// function in that end's cell, and width / 4 times its jumps there. To this the rounding adds
/// 2^-30 of the whole, and beyond the knots 2^-23 of what lies there.
struct TransferSums {
    static constexpr int kCells = 8192;      // of which points span half or more
    static constexpr double kOne = 1 << 30;  // the optical depth over all cells, as an integer

    float first = 0, per_number = 1;  // knot of a stored number: (number - first) per_number
    float width = 1;                  // of a cell [stored number]
    float scale = 0;                  // of one unit of the integers
    SmallVector<std::array<std::int32_t, 4>> knots;  // where each cell begins
    SmallVector<std::array<float, 4>> slopes;        // of each cell [integer per cell]
};

/// @param optics  with opacities per length in t
TransferSums transfer_sums_of(const Optics& optics);

}  // namespace edgewise::kernels
