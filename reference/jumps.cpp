#include "reference/jumps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace edgewise {
namespace {

/// Whether a value is that of a sample of the level that was asked for: all filters make the same
/// of many of these, and the level was lowered by more than they round. It is no matter of rounding
/// then, on either side.
bool is_plateau(double margin, double plateau) {
    return plateau > 0 && std::abs(std::abs(margin) - plateau) <= plateau / 2;
}

double share_of(double a, double b, double low, double high, const Nearby& nearby) {
    if (std::isnan(a) || std::isnan(b)) return 0;
    const auto known_to = [&](double margin) {
        return is_plateau(margin, nearby.plateau) ? 0 : nearby.rounding / 2;
    };
    const double from = std::clamp(std::min(a - known_to(a), b - known_to(b)), low, high);
    const double to = std::clamp(std::max(a + known_to(a), b + known_to(b)), low, high);
    return (to - from) / (high - low);
}

}  // namespace

double share_between(double a, double b, const Nearby& nearby) noexcept {
    if (nearby.within > 0) return share_of(a, b, -nearby.within, nearby.within, nearby);
    // A value that is the level is a sample, which no filter has rounded.
    const auto may_be = [&](double margin) {
        return margin != 0 && std::abs(margin) <= nearby.rounding &&
               !is_plateau(margin, nearby.plateau);
    };
    return (a >= 0) != (b >= 0) || may_be(a) || may_be(b) ? 1 : 0;
}

double share_above(double a, double b, const Nearby& nearby) noexcept {
    return share_of(a, b, 0, nearby.within, nearby);
}

double nearby_of(std::span<const RayLook> looks, double plateau) {
    constexpr std::size_t kRays = 192;     // a standard error of 7 %
    constexpr double kLargestShare = 0.1;  // of the spread of margins
    std::vector<double> away;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const RayLook& look : looks) {
        if (!std::isfinite(look.margin) || look.jump == 0 || is_plateau(look.margin, plateau))
            continue;
        away.push_back(std::abs(look.margin));
        low = std::min(low, look.margin);
        high = std::max(high, look.margin);
    }
    if (away.empty() || !(low < high)) return 0;
    const std::size_t rays = std::min(kRays, away.size() - 1);
    std::nth_element(away.begin(), away.begin() + static_cast<std::ptrdiff_t>(rays), away.end());
    return std::min(away[rays], kLargestShare * (high - low));
}

void count_nearby(RayLook& look, double within) noexcept {
    if (!(within > 0)) return;
    for (std::size_t i = 0; i < look.squares.size(); ++i)
        look.squares[i] = look.jump * share_between(look.margin, look.margins[i], {within, 0});
}

}  // namespace edgewise
