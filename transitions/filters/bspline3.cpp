#include "transitions/filters/bspline3.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {

/// The cubic B-spline through the samples: weights of its coefficients, which filter.prefilter
/// makes. Unser, "Splines: a perfect fit for signal and image processing", 1999.
Filter bspline3_filter() {
    return {.name = "bspline3",
            .help = "the cubic B-spline through the samples",
            .taps = 4,
            .coefficients = true,
            .order = 4,
            // Root of the integral of the squared cardinal spline.
            .noise_gain = 0.935,
            .operations = 16,
            .weights =
                [](double f, double* weights) {
                    const double g = 1 - f;
                    weights[0] = g * g * g / 6;
                    weights[1] = 2.0 / 3 - f * f * (2 - f) / 2;
                    weights[2] = 2.0 / 3 - g * g * (1 + f) / 2;
                    weights[3] = f * f * f / 6;
                },
            .response =
                [](double frequency) {
                    const double x = std::numbers::pi * frequency;
                    const double sinc = x == 0 ? 1 : std::sin(x) / x;
                    return 3 * std::pow(sinc, 4) / (2 + std::cos(2 * x));
                }};
}

}  // namespace edgewise
