#include "surface/level.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace edgewise::surface {
namespace {

/// Numbers of a type in ascending order: the place of each, and back.
struct Ordered {
    Type type;

    std::int64_t first() const noexcept { return place(limits_of(type)[0]); }
    std::int64_t last() const noexcept { return place(limits_of(type)[1]); }
    std::int64_t place(double number) const noexcept {
        if (is_integer(type)) return static_cast<std::int64_t>(number);
        const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(number));
        return bits >= 0 ? bits : std::int64_t{std::numeric_limits<std::int32_t>::min()} - bits;
    }
    double number(std::int64_t place) const noexcept {
        if (is_integer(type)) return static_cast<double>(place);
        if (place >= 0) return std::bit_cast<float>(static_cast<std::int32_t>(place));
        return -double(std::bit_cast<float>(static_cast<std::int32_t>(-place)));
    }
};

}  // namespace

bool can_be_cut(Type type) noexcept {
    return type == Type::f32 || (is_integer(type) && bytes_of(type) <= 2);
}

Level level_of(double isovalue, Type type, const ValueMap& values) {
    Level level;
    level.falls = values.slope < 0;
    level.at = static_cast<float>((isovalue - values.offset) / values.slope);
    const Ordered order{type};
    const auto inside = [&](std::int64_t place) { return values(order.number(place)) >= isovalue; };
    // Values are monotonic in the stored number, so bisection finds the first that is inside, seen
    // from the end where values are least.
    std::int64_t out = level.falls ? order.last() + 1 : order.first() - 1;
    std::int64_t in = level.falls ? order.first() : order.last();
    if (!inside(in)) {
        level.none = true;
        return level;
    }
    while (std::abs(in - out) > 1) {
        const std::int64_t middle = out + (in - out) / 2;
        (inside(middle) ? in : out) = middle;
    }
    level.bound = order.number(in);
    return level;
}

}  // namespace edgewise::surface
