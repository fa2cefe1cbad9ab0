#include "transitions/spectrum/pixel_of_sum.hpp"

#include <array>
#include <cmath>
#include <fmt/format.h>

namespace edgewise {
namespace {

double pixel_of(const Stretch& ray, const Request& want) {
    std::array<double, 4> values{};
    ray.result(want, values.data());
    return values[0];
}

}  // namespace

double pixel_of_sum(const Request& want, double sum, double length) {
    Stretch medium = Stretch::empty(want.mode);
    if (length > 0) medium.add(sum / length, length, want);
    return pixel_of(medium, want);
}

bool grows_with_length(const Request& want) {
    if (want.mode->slices != ModeTraits::Slices::integral) return false;
    const double value = want.zero + 1, once = pixel_of_sum(want, value, 1);
    return pixel_of_sum(want, 2 * value, 2) == 2 * once;
}

double steepness(const Request& want, double low, double high) {
    constexpr double kShort = 1e-3;  // short enough that exp(-x) is straight
    if (!(low < high)) high = low + 1;
    const double change =
        pixel_of_sum(want, high * kShort, kShort) - pixel_of_sum(want, low * kShort, kShort);
    return std::abs(change) / ((high - low) * kShort);
}

std::string no_pixel_of_sum(const Request& want, const Scene& scene) {
    // Half a ray of the lowest and half of the highest value, beside their mean. Where a mode cuts
    // off what lies below (or above) some value between them, only one of the two is cut.
    const double low = scene.low, high = scene.high;
    if (!std::isfinite(low) || !std::isfinite(high)) return {};
    Stretch halves = Stretch::empty(want.mode);
    halves.add(low, 0.5, want);
    halves.add(high, 0.5, want);
    const double expected = pixel_of(halves, want);
    const double got = pixel_of_sum(want, 0.5 * (low + high), 1);
    // Values of a millionth of the range too low are rounding.
    const double most = std::abs(pixel_of_sum(want, high, 1) - pixel_of_sum(want, low, 1));
    if (std::abs(got - expected) <= 1e-7 * most + 1e-14 * std::abs(expected)) return {};
    return fmt::format(
        "{} cuts off some of the values from {} to {}, and a slice knows only what rays add up",
        name_of(want.mode), low, high);
}

}  // namespace edgewise
