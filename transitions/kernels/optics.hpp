#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "graph/samples.hpp"
#include "graph/small_objects.hpp"

namespace edgewise::kernels {

// Conventions of compositing. Opacity a is per `unit` of length; a piece of length d of one medium
// keeps the transparency (1 - a)^(d / unit) (EQ 53), whatever the number of samples it is cut into.
// A ray keeps pairs (I, t): premultiplied light and the transparency that is left. Pairs join by
// (I1, t1) over (I2, t2) = (I1 + t1 I2, t1 t2), associative, not commutative (Lemmas 4.1, 4.2).

/// Opacity and colour at a value, as a user gives them.
struct OpticsPoint {
    double value = 0, opacity = 0;
    std::array<double, 3> color{0, 0, 0};  // 0..1, not premultiplied
};

/// One stretch between two points: what opacity and colour gain from its start to its end.
struct OpticsRamp {
    float start = 0, inverse_width = 0;  // in stored numbers
    std::array<float, 3> color{0, 0, 0};
    float opacity = 0;

    friend bool operator==(const OpticsRamp&, const OpticsRamp&) = default;
};

/// A piecewise linear transfer function of stored numbers, written as a start and a sum of clamped
/// ramps. No table is sampled, so that no knot is smeared, at any type and any step.
struct Optics {
    std::array<float, 3> color{0, 0, 0};  // below the first point
    float opacity = 0;
    SmallVector<OpticsRamp> ramps;
    bool grey = true;  // red = green = blue throughout: one channel is composited
    double unit = 1;   // length that opacities refer to [t]

    friend bool operator==(const Optics&, const Optics&) = default;
};

/// @param points  ascending values, at least one; constant beyond the end points
/// @param unit    length that the opacities refer to, in the unit of t along rays
/// @param values  what the stored numbers mean; a negative slope is fine
inline Optics optics_of(std::span<const OpticsPoint> points, double unit, const ValueMap& values) {
    SmallVector<OpticsPoint> knots(points.begin(), points.end());
    for (OpticsPoint& knot : knots) knot.value = (knot.value - values.offset) / values.slope;
    if (values.slope < 0) std::reverse(knots.begin(), knots.end());

    Optics optics{.ramps = {}, .unit = unit};
    optics.opacity = static_cast<float>(knots[0].opacity);
    for (int c = 0; c < 3; ++c) optics.color[c] = static_cast<float>(knots[0].color[c]);
    for (std::size_t i = 0; i < knots.size(); ++i) {
        const auto& color = knots[i].color;
        optics.grey = optics.grey && color[0] == color[1] && color[1] == color[2];
        if (i == 0) continue;
        const double width = knots[i].value - knots[i - 1].value;
        OpticsRamp ramp{.start = static_cast<float>(knots[i - 1].value)};
        // Two points at one value are a jump; a finite slope keeps 0 x infinity away.
        constexpr double kSteepest = 1e30;
        ramp.inverse_width = static_cast<float>(width > 1 / kSteepest ? 1 / width : kSteepest);
        ramp.opacity = static_cast<float>(knots[i].opacity - knots[i - 1].opacity);
        for (int c = 0; c < 3; ++c)
            ramp.color[c] = static_cast<float>(color[c] - knots[i - 1].color[c]);
        optics.ramps.push_back(ramp);
    }
    return optics;
}

}  // namespace edgewise::kernels
