#include "transitions/filters/foh.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {

/// First-order hold: linear between the two samples beside.
Filter foh_filter() {
    return {.name = "foh",
            .help = "linear interpolation",
            .taps = 2,
            .order = 2,
            .noise_gain = std::sqrt(2.0 / 3),
            .operations = 1,
            .guess = 0.015,
            .weights =
                [](double f, double* weights) {
                    weights[0] = 1 - f;
                    weights[1] = f;
                },
            .response =
                [](double frequency) {
                    const double x = std::numbers::pi * frequency;
                    const double sinc = x == 0 ? 1 : std::sin(x) / x;
                    return sinc * sinc;
                }};
}

}  // namespace edgewise
