#include "graph/written.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

double stored_number(Type type, double value) noexcept {
    switch (type) {
        case Type::u8:
            return stored_as<std::uint8_t>(value);
        case Type::i8:
            return stored_as<std::int8_t>(value);
        case Type::u16:
            return stored_as<std::uint16_t>(value);
        case Type::i16:
            return stored_as<std::int16_t>(value);
        case Type::u32:
            return stored_as<std::uint32_t>(value);
        case Type::i32:
            return stored_as<std::int32_t>(value);
        case Type::f16:
            return float_of(stored_as<Half>(value));
        default:
            return value;  // results are f32, which the other types hold
    }
}

}  // namespace

bool can_store(Type type, const ValueMap& values, double value) noexcept {
    const double number = (value - values.offset) / values.slope;
    if (type == Type::c64 || !std::isfinite(number)) return false;
    return stored_number(type, number) == number;
}

Half half_of(float value) noexcept {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000);
    const float size = std::abs(value);
    const auto with_sign = [sign](auto magnitude) {
        return Half{static_cast<std::uint16_t>(sign | static_cast<std::uint16_t>(magnitude))};
    };
    if (std::isnan(value)) return with_sign(0x7e00);
    if (size >= 65520) return with_sign(0x7c00);
    // Denormal: multiples of 2^-24, nearbyint rounds halves to even.
    if (size < 0x1p-14F) return with_sign(std::nearbyint(std::ldexp(size, 24)));
    // Rounding to nearest even by adding half of the last kept place; a carry moves the exponent.
    const std::uint32_t magnitude = bits & 0x7fffffff;
    const std::uint32_t rounded = magnitude + 0xfff + (magnitude >> 13 & 1);
    return with_sign((rounded >> 13) - (112 << 10));
}

float float_of(Half half) noexcept {
    const std::uint32_t sign = static_cast<std::uint32_t>(half.bits & 0x8000) << 16;
    const std::uint32_t exponent = half.bits >> 10 & 31;
    const std::uint32_t mantissa = half.bits & 0x3ff;
    if (exponent == 0) {
        const float tiny = static_cast<float>(mantissa) * 0x1p-24f;
        return sign ? -tiny : tiny;
    }
    const std::uint32_t wide = exponent == 31 ? 255 : exponent + 112;
    return std::bit_cast<float>(sign | wide << 23 | mantissa << 13);
}

void round_as(const WrittenAs& how, std::span<double> values) noexcept {
    if (how.type == Type::f64) return;
    const auto kept = [&](double value) {
        if (how.type == Type::f32) return static_cast<double>(static_cast<float>(value));
        return how.values(stored_number(how.type, (value - how.values.offset) / how.values.slope));
    };
    if (!how.straight) {
        for (double& value : values) value = kept(value);
        return;
    }
    const double alpha = values.back();
    const double written = stored_number(how.type, std::clamp(alpha, 0.0, 1.0) * how.opaque);
    for (double& colour : values.first(values.size() - 1))
        colour = kept(alpha > 0 ? colour / alpha : 0) * written / how.opaque;
    values.back() = written / how.opaque;
}

}  // namespace edgewise
