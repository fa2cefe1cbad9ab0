#pragma once

#include <bit>
#include <cstdint>

#include "graph/samples.hpp"

namespace edgewise::kernels {

/// Reads one stored number as f32, by its index.
using ScalarLoad = float (*)(const void* samples, std::int64_t index);

/// IEEE half precision to single, exactly.
inline float float_of_half(std::uint16_t half) noexcept {
    const std::uint32_t sign = (half & 0x8000u) << 16, exponent = (half >> 10) & 31u;
    const std::uint32_t mantissa = half & 1023u;
    if (exponent == 31) return std::bit_cast<float>(sign | 0x7f800000u | (mantissa << 13));
    if (exponent > 0)
        return std::bit_cast<float>(sign | ((exponent + 112) << 23) | (mantissa << 13));
    const float small = static_cast<float>(mantissa) * 0x1p-24f;
    return sign ? -small : small;
}

template <class T>
float load_as_float(const void* samples, std::int64_t index) {
    return static_cast<float>(static_cast<const T*>(samples)[index]);
}

/// The reader of a type; null for complex samples.
inline ScalarLoad scalar_load(Type type) noexcept {
    switch (type) {
        case Type::u8:
            return load_as_float<std::uint8_t>;
        case Type::i8:
            return load_as_float<std::int8_t>;
        case Type::u16:
            return load_as_float<std::uint16_t>;
        case Type::i16:
            return load_as_float<std::int16_t>;
        case Type::u32:
            return load_as_float<std::uint32_t>;
        case Type::i32:
            return load_as_float<std::int32_t>;
        case Type::f16:
            return [](const void* samples, std::int64_t index) {
                return float_of_half(static_cast<const std::uint16_t*>(samples)[index]);
            };
        case Type::f32:
            return load_as_float<float>;
        case Type::f64:
            return load_as_float<double>;
        case Type::c64:
            return nullptr;
    }
    return nullptr;
}

}  // namespace edgewise::kernels
