#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>

#include "transitions/store/reader.hpp"

namespace edgewise::store {
namespace {

template <class T>
void convert_from(const std::byte* source, std::int64_t count, std::byte* into, std::int64_t stride,
                  Rounding& rounding) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    for (std::int64_t i = 0; i < count; ++i) {
        T stored;
        std::memcpy(&stored, source + i * static_cast<std::int64_t>(sizeof(T)), sizeof stored);
        const double value = static_cast<double>(stored);
        float result = 0;
        // Half of the last place beyond the largest float still rounds to it; a cast of more than
        // that is undefined in C++ though not in IEEE 754.
        if (std::isfinite(value) && std::abs(value) > kLargest) {
            result = std::copysign(std::numeric_limits<float>::infinity(),
                                   static_cast<float>(value > 0 ? 1 : -1));
            ++rounding.beyond;
        } else {
            result = static_cast<float>(value);
            if (static_cast<double>(result) != value && value == value) ++rounding.rounded;
        }
        std::memcpy(into + i * stride * 4, &result, sizeof result);
    }
}

void convert_halves(const std::byte* source, std::int64_t count, std::byte* into,
                    std::int64_t stride) {
    for (std::int64_t i = 0; i < count; ++i) {
        std::uint16_t half;
        std::memcpy(&half, source + i * 2, sizeof half);
        const float result = half_to_float(half);
        std::memcpy(into + i * stride * 4, &result, sizeof result);
    }
}

}  // namespace

float half_to_float(std::uint16_t half) noexcept {
    const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000) << 16;
    const int exponent = (half >> 10) & 31;
    const std::uint32_t mantissa = half & 0x3ff;
    if (exponent == 0) {
        const float tiny = std::ldexp(static_cast<float>(mantissa), -24);
        return sign ? -tiny : tiny;
    }
    const auto wide = static_cast<std::uint32_t>(exponent == 31 ? 255 : exponent + 112);
    return std::bit_cast<float>(sign | wide << 23 | mantissa << 13);
}

std::uint16_t float_to_half(float value) noexcept {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000);
    const float size = std::abs(value);
    if (std::isnan(value)) return static_cast<std::uint16_t>(sign | 0x7e00);
    if (size >= 65520) return static_cast<std::uint16_t>(sign | 0x7c00);
    if (size < 0x1p-14F)  // denormal: multiples of 2^-24, nearbyint rounds halves to even
        return static_cast<std::uint16_t>(
            sign | static_cast<std::uint16_t>(std::nearbyint(std::ldexp(size, 24))));
    // Rounding to nearest even by adding half of the last kept place; a carry moves the exponent.
    const std::uint32_t magnitude = bits & 0x7fffffff;
    const std::uint32_t rounded = magnitude + 0xfff + (magnitude >> 13 & 1);
    return static_cast<std::uint16_t>(sign |
                                      static_cast<std::uint16_t>((rounded >> 13) - (112 << 10)));
}

void swap_bytes(std::byte* data, std::size_t width, std::int64_t count) noexcept {
    const auto swap = [&]<class T>(T) {
        for (std::int64_t i = 0; i < count; ++i) {
            T value;
            std::memcpy(&value, data + i * static_cast<std::int64_t>(sizeof(T)), sizeof value);
            if constexpr (sizeof(T) == 2) value = __builtin_bswap16(value);
            if constexpr (sizeof(T) == 4) value = __builtin_bswap32(value);
            if constexpr (sizeof(T) == 8) value = __builtin_bswap64(value);
            std::memcpy(data + i * static_cast<std::int64_t>(sizeof(T)), &value, sizeof value);
        }
    };
    if (width == 2) swap(std::uint16_t{});
    if (width == 4) swap(std::uint32_t{});
    if (width == 8) swap(std::uint64_t{});
}

void Rounding::convert(Type from, const std::byte* source, std::int64_t count, std::byte* into,
                       std::int64_t stride) {
    if (from == Type::f16) convert_halves(source, count, into, stride);
    if (from == Type::u32) convert_from<std::uint32_t>(source, count, into, stride, *this);
    if (from == Type::i32) convert_from<std::int32_t>(source, count, into, stride, *this);
    if (from == Type::f64) convert_from<double>(source, count, into, stride, *this);
}

void Rounding::tell(const std::string& file, Type from, std::vector<std::string>& warnings) const {
    if (rounded > 0)
        warnings.push_back(fmt::format("{}: {} values of type {} were rounded to f32", file,
                                       rounded, name_of(from)));
    if (beyond > 0)
        warnings.push_back(
            fmt::format("{}: {} values are beyond f32 and count as infinite", file, beyond));
}

}  // namespace edgewise::store
