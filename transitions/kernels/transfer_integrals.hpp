#pragma once

#include <array>
#include <vector>

#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// Integrals of a transfer function over stored numbers, for pieces of rays along which the value
/// goes evenly from one number to another (Engel, Kraus, Ertl, "High-quality pre-integrated volume
/// rendering", 2001, of first order: within a piece all light is attenuated alike).
///
/// Of each knot: the optical depth per t, integrated from the first knot to there, and the same
/// times red, green and blue. Knots are even, the first and the last one beyond all points of the
/// function, where it is constant; between knots the integrals go evenly.
struct TransferIntegrals {
    static constexpr int kCells = 4096;

    float first = 0, per_number = 1;  // knot of a stored number: (number - first) per_number
    float width = 1;                  // of a cell [stored number]
    std::vector<std::array<float, 4>> knots;  // kCells + 1
};

/// @param optics  with opacities per length in t
TransferIntegrals transfer_integrals_of(const Optics& optics);

/// Optical depth per t, and colour, at a stored number.
std::array<double, 4> optics_at(const Optics& optics, double stored);

}  // namespace edgewise::kernels
