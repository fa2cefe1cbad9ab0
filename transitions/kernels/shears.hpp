#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// A unit shear: changes one coordinate by a linear function of the others.
///     coordinate[axis] += by . coordinates + offset          by[axis] is 0
struct Shear {
    int axis = 0;
    std::array<double, 3> by{0, 0, 0};
    double offset = 0;

    double step(const std::array<double, 3>& at) const noexcept {
        return by[0] * at[0] + by[1] * at[1] + by[2] * at[2] + offset;
    }
};

/// An equiareal map of index coordinates as an exact signed permutation followed by unit shears:
///     y[i] = sign[i] * x[from[i]], then shears[0], shears[1], ...
/// With the step of every shear rounded it is the rule M of the permutation warp, one-to-one on the
/// integer points (EQ 22, Theorem 3.1); without rounding it is the map itself.
struct ShearChain {
    std::array<int, 3> from{0, 1, 2};
    std::array<int, 3> sign{1, 1, 1};
    std::array<Shear, 5> shears{};  // four, and one more where a third axis only moves
    int count = 0;
    /// Bound of |T^-1 M x - x| for integer x, along each axis of object space [voxel].
    std::array<double, 3> displacement{0, 0, 0};

    /// The greatest of the three bounds [voxel].
    double bound() const noexcept {
        return std::max({displacement[0], displacement[1], displacement[2]});
    }
    /// No exact permutation is needed before the shears.
    bool starts_in_place() const noexcept {
        return from == std::array<int, 3>{0, 1, 2} && sign == std::array<int, 3>{1, 1, 1};
    }
};

/// Rounds to the nearest integer, halves upward: the same answer whatever the sign, as M needs.
inline double round_half_up(double value) noexcept { return std::floor(value + 0.5); }

/// The signed permutation of a chain alone.
template <class Number>
std::array<Number, 3> permuted(const ShearChain& chain, const std::array<Number, 3>& x) noexcept {
    std::array<Number, 3> y;
    for (int i = 0; i < 3; ++i) y[i] = Number(chain.sign[i]) * x[chain.from[i]];
    return y;
}

/// The map itself: T x.
inline std::array<double, 3> sheared(const ShearChain& chain,
                                     const std::array<double, 3>& x) noexcept {
    std::array<double, 3> y = permuted(chain, x);
    for (int k = 0; k < chain.count; ++k) y[chain.shears[k].axis] += chain.shears[k].step(y);
    return y;
}

/// The rule: the screen site M x of an object site x.
inline std::array<double, 3> screen_site(const ShearChain& chain,
                                         const std::array<double, 3>& x) noexcept {
    std::array<double, 3> y = permuted(chain, x);
    for (int k = 0; k < chain.count; ++k)
        y[chain.shears[k].axis] += round_half_up(chain.shears[k].step(y));
    return y;
}

/// The object site of a screen site: the same steps taken back in reverse order, so M^-1 M x = x.
inline std::array<double, 3> object_site(const ShearChain& chain,
                                         std::array<double, 3> y) noexcept {
    for (int k = chain.count - 1; k >= 0; --k)
        y[chain.shears[k].axis] -= round_half_up(chain.shears[k].step(y));
    std::array<double, 3> x;
    for (int i = 0; i < 3; ++i) x[chain.from[i]] = chain.sign[i] * y[i];
    return x;
}

/// From one sample of the lines that pass k interpolates along to the next, in object space
/// [voxel]: what the shears before it made of the pass's axis.
std::array<double, 3> line_of_pass(const ShearChain& chain, int k) noexcept;

/// Whether pass k moves lines by parts of a sample, so that it has to interpolate.
bool interpolates(const ShearChain& chain, int k) noexcept;
/// The passes that do so along lines that are slanted in object space: lines of the field that its
/// own interpolation does not follow.
int slanted_passes(const ShearChain& chain) noexcept;
bool is_slanted_pass(const ShearChain& chain, int k) noexcept;

/// Along any axis of object space, samples of such lines are at most so far apart where a warp by
/// passes is worth its while: a line whose samples lie farther apart folds over what lies between.
/// Those of rotations keep within it.
constexpr double kCoarsestLine = 1.25;

/// |T^-1 M x - x| <= half the sum of |(E_1^-1 ... E_k^-1) u_axis(k)| over the shears E_k, because
/// each rounding is off by at most half. Along the axes of object space [voxel].
std::array<double, 3> displacement_bound(const ShearChain& chain) noexcept;

/// |M x - T x|, the same roundings seen from screen space [voxel].
std::array<double, 3> screen_displacement_bound(const ShearChain& chain) noexcept;

}  // namespace edgewise::kernels
