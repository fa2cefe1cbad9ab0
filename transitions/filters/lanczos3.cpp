#include "transitions/filters/lanczos3.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {
namespace {

constexpr int kLobes = 3;

/// sinc(x) sinc(x / 3) for |x| < 3.
double window(double x) {
    const double y = std::numbers::pi * x;
    if (std::abs(x) < 1e-9) return 1;
    return kLobes * std::sin(y) * std::sin(y / kLobes) / (y * y);
}

}  // namespace

/// Sinc windowed by its own middle lobe, three times as wide, and divided by the sum of the weights
/// so that a constant stays one. Duchon, "Lanczos filtering in one and two dimensions", 1979;
/// Turkowski, "Filters for common resampling tasks", 1990.
Filter lanczos3_filter() {
    return {.name = "lanczos3",
            .help = "a windowed sinc",
            .taps = 2 * kLobes,
            .positive = false,
            .order = 1,
            .noise_gain = 0.9452,  // of the normalised weights, by quadrature
            .operations = 100,
            .weights =
                [](double f, double* weights) {
                    double sum = 0;
                    for (int tap = 0; tap < 2 * kLobes; ++tap)
                        sum += weights[tap] = window(tap + 1 - kLobes - f);
                    for (int tap = 0; tap < 2 * kLobes; ++tap) weights[tap] /= sum;
                },
            .response =
                [](double frequency) {
                    // The transform of the kernel, by the trapezoid rule over its support.
                    constexpr int kPieces = 600;
                    double sum = 0;
                    for (int i = -kPieces; i < kPieces; ++i) {
                        const double x = kLobes * (i + 0.5) / kPieces;
                        sum += window(x) * std::cos(2 * std::numbers::pi * frequency * x);
                    }
                    return sum * kLobes / kPieces;
                }};
}

}  // namespace edgewise
