#include "graph/radon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

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

std::array<double, 2> radon_direction_at(double degrees) noexcept {
    constexpr double kTurn = 360, kQuarter = 90, kDiagonal = 45;
    const double turned = std::remainder(degrees, kTurn);
    const double quarters = std::nearbyint(turned / kQuarter);
    const double left = turned - quarters * kQuarter;  // at most 45
    const double angle = std::numbers::pi * left / (2 * kQuarter);
    double c = std::cos(angle), s = std::sin(angle);
    if (std::abs(left) == kDiagonal) c = std::sqrt(0.5), s = std::copysign(c, left);
    switch (static_cast<int>(quarters) & 3) {
        case 1:
            return {0 - s, c};
        case 2:
            return {0 - c, 0 - s};
        case 3:
            return {s, 0 - c};
        default:
            return {c, s};
    }
}

std::array<double, 2> RadonSetting::direction(int k) const noexcept {
    return degrees.empty() ? radon_direction(k, angles)
                           : radon_direction_at(degrees[static_cast<std::size_t>(k)]);
}

RadonLines::RadonLines(const Extent& of, const std::array<double, 2>& apart,
                       const RadonSetting& setting)
    : RadonLines(of, apart, setting.angles) {
    degrees = setting.degrees;
}

RadonLines::RadonLines(const Extent& of, const std::array<double, 2>& apart, int count)
    : input(of), spacing(apart), angles(count), step(std::min(apart[0], apart[1])) {
    const double wide = static_cast<double>(of.x + 1) * apart[0];
    const double high = static_cast<double>(of.y + 1) * apart[1];
    diagonal = std::sqrt(wide * wide + high * high);
    offsets = 2 * static_cast<std::int64_t>(std::ceil(diagonal / (2 * step))) + 1;
}

std::array<double, 2> RadonLines::slopes(int k) const noexcept {
    const auto [c, s] = degrees.empty() ? radon_direction(k, angles)
                                        : radon_direction_at(degrees[static_cast<std::size_t>(k)]);
    return {c * spacing[0] / step, -(s * spacing[1] / step)};
}

RadonBack::RadonBack(const Extent& of, double apart, const RadonSetting& setting)
    : sinogram(of), step(apart), image{setting.size[0], setting.size[1], of.z} {
    if (image.x < 1 || image.y < 1) {
        // Offsets reach half the diagonal of an image that is one sample larger.
        const double half = static_cast<double>((of.x - 1) / 2);
        auto side = static_cast<std::int64_t>(std::floor(half * std::sqrt(2.0))) - 1;
        // Often one less has as many offsets. Of two the even one is meant.
        const double less = static_cast<double>(side) / std::sqrt(2.0);
        if (side % 2 != 0 && std::ceil(less) == half) --side;
        image.x = image.y = std::max<std::int64_t>(1, side);
    }
    const auto n = static_cast<std::size_t>(of.y);
    weights.assign(n, std::numbers::pi / static_cast<double>(n));
    for (std::size_t k = 0; k < n; ++k)
        directions.push_back(setting.direction(static_cast<int>(k)));
    if (setting.degrees.empty()) return;
    // A line and the one half a turn further are the same.
    constexpr double kHalfTurn = 180;
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t k = 0; k < n; ++k) {
        const double within = std::fmod(setting.degrees[k], kHalfTurn);
        order.emplace_back(within < 0 ? within + kHalfTurn : within, k);
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < n; ++i) {
        const double next = i + 1 < n ? order[i + 1].first : order[0].first + kHalfTurn;
        const double before = i > 0 ? order[i - 1].first : order[n - 1].first - kHalfTurn;
        weights[order[i].second] = std::numbers::pi / kHalfTurn * (next - before) / 2;
    }
}

}  // namespace edgewise
