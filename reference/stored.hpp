#pragma once

// Reads stored numbers of any type, for the reference alone: it shares no code with the kernels
// that it judges.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>

#include "graph/data.hpp"

namespace edgewise {

/// A 16-bit float (IEEE 754 binary16) as stored.
struct StoredHalf {
    std::uint16_t bits;

    operator float() const noexcept {
        const int exponent = bits >> 10 & 31;
        const float fraction = static_cast<float>(bits & 1023);
        float value = exponent == 0 ? std::ldexp(fraction, -24)
                                    : std::ldexp(fraction + 1024.f, exponent - 25);
        if (exponent == 31) value = fraction != 0 ? std::nanf("") : HUGE_VALF;
        return bits & 0x8000 ? -value : value;
    }
};

/// Calls body with a value of the C++ type that stands for `type`.
/// @throws std::invalid_argument for complex samples
template <class Body>
decltype(auto) with_stored_type(Type type, Body&& body) {
    switch (type) {
        case Type::u8:
            return body(std::uint8_t{});
        case Type::i8:
            return body(std::int8_t{});
        case Type::u16:
            return body(std::uint16_t{});
        case Type::i16:
            return body(std::int16_t{});
        case Type::u32:
            return body(std::uint32_t{});
        case Type::i32:
            return body(std::int32_t{});
        case Type::f16:
            return body(StoredHalf{});
        case Type::f32:
            return body(float{});
        case Type::f64:
            return body(double{});
        case Type::c64:
            break;
    }
    throw std::invalid_argument("complex samples have no scalar value");
}

/// A stored number as f64, before the value map. StoredHalf goes through float, exactly.
template <class T>
double as_double(T stored) noexcept {
    if constexpr (std::is_same_v<T, StoredHalf>)
        return static_cast<float>(stored);
    else
        return static_cast<double>(stored);
}

/// One value, mapped. `index` counts stored numbers.
inline double value_at(const Data& data, std::int64_t index) {
    return with_stored_type(data.what.type, [&](auto zero) {
        return data.what.values(as_double(data.as<decltype(zero)>()[index]));
    });
}

}  // namespace edgewise
