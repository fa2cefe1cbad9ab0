#include "reference/random_draw.hpp"

#include <algorithm>
#include <random>

namespace edgewise {
namespace {

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t mixed(std::uint64_t n) noexcept {
    n += 0x9e3779b97f4a7c15;
    n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9;
    n = (n ^ (n >> 27)) * 0x94d049bb133111eb;
    return n ^ (n >> 31);
}

}  // namespace

RandomOrder::RandomOrder(std::int64_t size, std::uint64_t seed) noexcept
    : size_(static_cast<std::uint64_t>(size)), seed_(seed) {
    while (half_ < 31 && (std::uint64_t{1} << (2 * half_)) < size_) ++half_;
}

std::uint64_t RandomOrder::once(std::uint64_t value) const noexcept {
    const std::uint64_t mask = (std::uint64_t{1} << half_) - 1;
    std::uint64_t left = value >> half_, right = value & mask;
    for (std::uint64_t round = 0; round < 4; ++round) {
        const std::uint64_t next = left ^ (mixed(mixed(seed_ + round) + right) & mask);
        left = right;
        right = next;
    }
    return left << half_ | right;
}

std::int64_t RandomOrder::operator[](std::int64_t place) const noexcept {
    // The walk ends: it is a cycle, which began within the range.
    std::uint64_t value = once(static_cast<std::uint64_t>(place));
    while (value >= size_) value = once(value);
    return static_cast<std::int64_t>(value);
}

std::vector<std::size_t> draw_by_chance(std::span<const double> chances, std::uint64_t seed) {
    // Rounding must not leave a candidate that is certain undecided.
    constexpr double kAlmost = 1e-12;
    std::mt19937_64 bits(seed);
    const auto uniform = [&] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
    std::vector<std::size_t> drawn;
    std::size_t open = chances.size();  // whose fate is still open: nobody's
    double chance = 0;                  // that it is drawn
    for (std::size_t next = 0; next < chances.size(); ++next) {
        const double own = chances[next];
        if (!(own > 0)) continue;
        if (own >= 1 - kAlmost) {
            drawn.push_back(next);
            continue;
        }
        if (chance <= kAlmost) {
            open = next;
            chance = own;
            continue;
        }
        // One of the two is decided, the other goes on with what is left of their chances.
        const double both = chance + own;
        if (both < 1) {
            if (uniform() * both < own) open = next;
            chance = both;
        } else {
            const bool next_is_drawn = uniform() * (2 - both) < 1 - chance;
            drawn.push_back(next_is_drawn ? next : open);
            if (!next_is_drawn) open = next;
            chance = both - 1;
        }
    }
    if (chance > kAlmost && uniform() < chance) drawn.push_back(open);
    std::sort(drawn.begin(), drawn.end());
    return drawn;
}

}  // namespace edgewise
