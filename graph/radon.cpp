#include "graph/radon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace edgewise {
namespace {

constexpr JobTraits kRadon{.name = "radon",
                           .help = "integrals along lines of an image (sinogram), or Hough votes",
                           .target = "hough/scalar"};
constinit const Job kRadonJob{kRadon};

}  // namespace

const Job& radon_job() noexcept { return kRadonJob; }

std::array<double, 2> radon_direction(int k, int angles) noexcept {
    const auto n = static_cast<double>(angles), at = static_cast<double>(k);
    // From the nearest axis: at most 45 degrees.
    const auto turned = [](double share) {
        const double angle = std::numbers::pi * share;
        const bool diagonal = std::abs(share) == 0.25;
        return std::array<double, 2>{diagonal ? std::sqrt(0.5) : std::cos(angle),
                                     diagonal ? std::sqrt(0.5) : std::sin(angle)};
    };
    if (4 * at <= n) return turned(at / n);
    if (4 * at <= 3 * n) {
        const double left = n - 2 * at;  // to 90 degrees
        const auto [c, s] = turned(std::abs(left) / (2 * n));
        return {left < 0 ? -s : s, c};
    }
    const auto [c, s] = turned((n - at) / n);
    return {-c, s};
}

RadonLines::RadonLines(const Extent& of, const std::array<double, 2>& apart, int count) noexcept
    : input(of), spacing(apart), angles(count), step(std::min(apart[0], apart[1])) {
    const double wide = static_cast<double>(of.x + 1) * apart[0];
    const double high = static_cast<double>(of.y + 1) * apart[1];
    diagonal = std::sqrt(wide * wide + high * high);
    offsets = 2 * static_cast<std::int64_t>(std::ceil(diagonal / (2 * step))) + 1;
}

std::array<double, 2> RadonLines::slopes(int k) const noexcept {
    const auto [c, s] = radon_direction(k, angles);
    return {c * spacing[0] / step, -(s * spacing[1] / step)};
}

}  // namespace edgewise
