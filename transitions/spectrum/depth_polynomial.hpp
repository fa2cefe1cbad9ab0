#pragma once

#include <array>
#include <vector>

#include "graph/request.hpp"

namespace edgewise {

/// Light that falls off with depth t as a polynomial of s = 2 t / depth - 1, which is -1 at the
/// volume's nearest corner and 1 at its farthest: numbers keep their digits where t is large.
struct DepthPolynomial {
    static constexpr int kMostDegree = 3;

    std::array<double, kMostDegree + 1> of_s{};  // coefficients of 1, s, s^2, s^3
    double bound = 0;                            // largest difference from the cue

    /// A linear cue as it is, where it does not end inside the depth; an exponential one by its
    /// Chebyshev series exp(-a (1 + s)) = exp(-a) (I0(a) + 2 sum (-1)^k Ik(a) Tk(s)), a = K depth /
    /// 2, up to a degree of 1 to 3. All terms that are left out have one sign at the near end, so
    /// that their sum there is the bound.
    /// Source: Abramowitz, Stegun, Handbook of Mathematical Functions, 9.6.34
    DepthPolynomial(const DepthCue& cue, double depth, int degree);
    double operator()(double s) const noexcept;
};

/// How deep the input's box is in a view, across the view plane [file unit].
double depth_of(const Request& want, int view);
/// The deepest of all views.
double deepest(const Request& want);

/// A factor x^i y^j z^k of the samples.
struct Moment {
    std::array<int, 3> power;
};
/// All of a degree of at most the given one, lower ones first: 4, 10 or 20.
std::vector<Moment> moments_up_to(int degree);

/// s along the axes of samples: s = at_origin + along . u.
struct DepthAxis {
    double at_origin = 0;
    std::array<double, 3> along{};
};
/// What each moment counts for, in the order of moments_up_to(degree).
std::vector<double> moment_weights(const DepthPolynomial& light, const DepthAxis& depth,
                                   int degree);

}  // namespace edgewise
