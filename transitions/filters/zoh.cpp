#include "transitions/filters/zoh.hpp"

#include <cmath>
#include <numbers>

namespace edgewise {

/// Zero-order hold: the nearest sample.
Filter zoh_filter() {
    return {.name = "zoh",
            .help = "the nearest sample",
            .taps = 1,
            .order = 1,
            .guess = 0.03,
            .weights = [](double, double* weights) { weights[0] = 1; },
            .response =
                [](double frequency) {
                    const double x = std::numbers::pi * frequency;
                    return x == 0 ? 1 : std::sin(x) / x;
                }};
}

}  // namespace edgewise
