#include "transitions/filters/keys6.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {
namespace {

void weights(double f, double* w) {
    w[0] = f * (1 + f * (-2 + f)) / 12;
    w[1] = f * (-8 + f * (15 - 7 * f)) / 12;
    w[2] = 1 + f * f * (-28 + 16 * f) / 12;
    w[3] = f * (8 + f * (20 - 16 * f)) / 12;
    w[4] = f * (-1 + f * (-6 + 7 * f)) / 12;
    w[5] = f * f * (1 - f) / 12;
}

}  // namespace

/// Cubic convolution over six samples: through the samples themselves, fourth order. Keys, "Cubic
/// convolution interpolation for digital image processing", IEEE Trans. Acoustics, Speech, and
/// Signal Processing 29(6), 1981, section V.
Filter keys6_filter() {
    return {.name = "keys6",
            .help = "cubic convolution over six samples",
            .taps = 6,
            .positive = false,
            .order = 4,
            .noise_gain = 0.9188,  // root of the integral of the squared kernel, by quadrature
            .operations = 34,
            .weights = weights,
            .response = [](double frequency) {
                // The transform of the kernel, by the midpoint rule over its support.
                constexpr int kPieces = 200;
                double sum = 0;
                for (int i = 0; i < kPieces; ++i) {
                    const double f = (i + 0.5) / kPieces;
                    double w[6];
                    weights(f, w);
                    for (int tap = 0; tap < 6; ++tap)
                        sum += w[tap] * std::cos(2 * std::numbers::pi * frequency * (f + 2 - tap));
                }
                return sum / kPieces;
            }};
}

}  // namespace edgewise
