#include "transitions/warp/counts.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// One shear of a rule: a product, a sum, and the rounding that makes it one-to-one.
constexpr Operations kShear{1, 1, 1};

/// FIGURE 30 and 27: the inverse of a rotation in 2D takes its centre from the rule (4 M + 2 A) or
/// adds it (4 M + 4 A); in 3D 9 M + 6 A either way.
Operations inverse_of(int axes, double additions_2d) {
    const Operations rounding{0, 0, static_cast<double>(axes)};
    return axes == 2 ? Operations{4, additions_2d, 0} + rounding : Operations{9, 6, 0} + rounding;
}

}  // namespace

double points(int order, int axes) noexcept { return std::pow(order + 1, axes); }

double interpolation_steps(int order, int axes, int processors) noexcept {
    double steps = 0;
    for (int axis = 0; axis < axes; ++axis)
        for (int level = 1; level <= order; ++level)
            steps += std::ceil(points(order, axis) * level / processors);
    return steps;
}

double interpolations(int order, int axes) noexcept { return interpolation_steps(order, axes, 1); }

double interpolation_speedup(int order, int axes, int processors) noexcept {
    return interpolations(order, axes) / interpolation_steps(order, axes, processors);
}

double interpolation_efficiency(int order, int axes, int processors) noexcept {
    return interpolation_speedup(order, axes, processors) / processors;
}

WarpCounts forward_counts(int order, int axes) noexcept {
    WarpCounts counts;
    counts.rule = (axes == 2 ? 3 : 5) * kShear;
    counts.inverse = inverse_of(axes, 2);
    counts.filter = interpolations(order, axes) * kInterpolation;
    counts.local = std::max(1.0, points(order, axes) - 1);
    counts.global = 1;
    return counts;
}

WarpCounts backward_counts(int order, int axes) noexcept {
    WarpCounts counts;
    counts.inverse = inverse_of(axes, 4);
    counts.filter = interpolations(order, axes) * kInterpolation;
    counts.congested = points(order, axes);
    return counts;
}

WarpCounts multipass_counts(int passes) noexcept {
    // Offset of the line, floor, fraction; one interpolation; one read of a neighbour.
    constexpr Operations kPlace{1, 2, 1};
    WarpCounts counts;
    counts.filter = passes * (kPlace + kInterpolation);
    counts.local = passes;
    counts.global = 1;
    return counts;
}

}  // namespace edgewise
