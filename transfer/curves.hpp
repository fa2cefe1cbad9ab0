#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "graph/request.hpp"
#include "transfer/transfer_spec.hpp"

namespace edgewise::transfer {

// Transfer functions as VTK, ParaView and Slicer have them: one curve of opacity and one of colour,
// each with knots of its own.

/// Opacity (in [0]) or colour at a value, and how the curve runs from here to the next knot.
struct Knot {
    double at = 0;
    std::array<double, 3> to{};
    double midpoint = 0.5;  // where half of the way is made, as a share of the distance
    double sharpness = 0;   // 0: linear on both sides of the midpoint; 1: a step there
};
using Curve = std::vector<Knot>;

/// Of one curve. More would make every sample of a ray slow.
constexpr std::size_t kMostKnots = 4096;

/// Whether all of it has one value.
bool is_constant(const Curve& curve, double value) noexcept;

/// One list of points for both curves, with straight lines in between. Points that lie on the line
/// between their neighbours, but for 1/510 of colour and 0.0001 of opacity, are left out: each
/// costs time at each sample.
/// @param opacity, color  ascending places, at least one knot each
std::vector<Transfer::Point> joined(const Curve& opacity, const Curve& color);

/// Numbers between blanks. @throws RequestError naming what is none
std::vector<double> numbers_in(std::string_view line, const std::string& where,
                               const std::string& field);

/// A curve as volume properties of VTK's family list it: how many numbers follow, then a value and
/// `parts` shares a point (one of opacity, three of colour). @throws RequestError
Curve listed_curve(std::string_view line, const std::string& where, const std::string& field,
                   std::size_t parts);

/// A volume property of these.
/// @param gradient  opacity by the length of the gradient; empty: none
/// @param unit      length that opacities are for [mm]
TransferSpec property_of(const Curve& opacity, const Curve& gradient, const Curve& color,
                         double unit, const Material& material);

}  // namespace edgewise::transfer
