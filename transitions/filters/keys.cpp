#include "transitions/filters/keys.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {
namespace {

double sinc(double x) { return x == 0 ? 1 : std::sin(x) / x; }

}  // namespace

/// Cubic convolution with a = -1/2 (Catmull-Rom): through the samples themselves, third order.
/// Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans. Acoustics,
/// Speech, and Signal Processing 29(6), 1981; its transform: Park and Schowengerdt, "Image
/// reconstruction by parametric cubic convolution", 1983.
Filter keys_filter() {
    return {.name = "keys",
            .help = "cubic convolution",
            .taps = 4,
            .positive = false,
            .order = 3,
            .noise_gain = std::sqrt(57.0 / 70),  // integral of the squared kernel
            .operations = 15,
            .weights =
                [](double f, double* weights) {
                    weights[0] = f * (-0.5 + f * (1 - 0.5 * f));
                    weights[1] = 1 + f * f * (-2.5 + 1.5 * f);
                    weights[2] = f * (0.5 + f * (2 - 1.5 * f));
                    weights[3] = f * f * (-0.5 + 0.5 * f);
                },
            .response =
                [](double frequency) {
                    constexpr double kA = -0.5;
                    const double x = std::numbers::pi * frequency;
                    if (std::abs(x) < 1e-2) return 1.0;  // 1 - O(x^4)
                    const double s = sinc(x), t = sinc(2 * x);
                    return 3 / (x * x) * (s * s - t) +
                           2 * kA / (x * x) * (3 * t * t - 2 * t - sinc(4 * x));
                }};
}

}  // namespace edgewise
