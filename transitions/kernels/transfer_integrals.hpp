#pragma once

#include <array>
#include <vector>

#include "graph/small_objects.hpp"
#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// Integrals of a transfer function over stored numbers, for pieces of rays along which the value
/// goes evenly from one number to another (Engel, Kraus, Ertl, "High-quality pre-integrated volume
/// rendering", 2001, of first order: within a piece all light is attenuated alike).
///
/// Of each knot: the optical depth per t, integrated from the first knot to there, and the same
/// times red, green and blue. Knots are even, the first and the last one beyond all points of the
/// function, where it is constant; between knots the integrals go evenly.
///
/// **Error of the table.** Let f be one of the four functions, w the width of a cell, and V(a) the
/// variation of f within the cell of a. An integral that goes evenly through a cell is off by at
/// most V w / 4 within it (the worst is one jump in the middle), and the midpoints of eight pieces
/// leave a knot off by at most w / 16 times the variation of f up to there. So the mean of f
/// between two numbers a and b is off by at most
///     w / |b - a| ((V(a) + V(b)) / 4 + V(a to b) / 16 + R M),
/// with M the largest f, and R for rounding: knots of f32 and their sums, 4 x 4096 x 2^-24; and
/// places, 2^-22 times the larger number of cells from the first knot to a and b. Kernels take it
/// where |b - a| is at least 2 w. Beyond the table the last two knots go on: their rounding adds
/// 2^-11 M. Where f is smooth an end errs by w^2 |f'| / 8, half of V w / 4.
struct TransferIntegrals {
    static constexpr int kCells = 4096;

    float first = 0, per_number = 1;  // knot of a stored number: (number - first) per_number
    float width = 1;                  // of a cell [stored number]
    SmallVector<std::array<float, 4>> knots;  // kCells + 1
};

/// @param optics  with opacities per length in t
TransferIntegrals transfer_integrals_of(const Optics& optics);

/// Optical depth per t, and colour, at a stored number.
std::array<double, 4> optics_at(const Optics& optics, double stored);

}  // namespace edgewise::kernels
