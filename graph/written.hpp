#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "graph/samples.hpp"

namespace edgewise {

/// A 16-bit float (IEEE 754 binary16) as its bits.
struct Half {
    std::uint16_t bits = 0;
};

/// Rounded to nearest, halves to even; beyond the largest it is infinite.
Half half_of(float value) noexcept;
/// Exact.
float float_of(Half half) noexcept;

/// A number as a file of that type stores it: rounded to nearest, halves to even, clipped at the
/// ends of an integer type; NaN becomes the integer nearest to 0.
template <class T>
T stored_as(double value) noexcept {
    if constexpr (std::is_same_v<T, Half>) {
        return half_of(static_cast<float>(value));
    } else if constexpr (std::is_floating_point_v<T>) {
        return static_cast<T>(value);
    } else {
        // Adding it pushes the fraction out of a double, which rounds halves to even; a call of
        // nearbyint would be ten times as slow.
        constexpr double kPush = 6755399441055744.0;  // 1.5 * 2^52
        constexpr double kLow = std::numeric_limits<T>::min();
        constexpr double kHigh = std::numeric_limits<T>::max();
        if (std::isnan(value)) value = 0;
        value = value < kLow ? kLow : value > kHigh ? kHigh : value;
        return static_cast<T>((value + kPush) - kPush);
    }
}

/// How the results of a warp or filter are stored in a file.
struct WrittenAs {
    Type type = Type::f32;
    ValueMap values = {};
    /// The last channel is the alpha that colours are multiplied by in memory and not in the file.
    bool straight = false;
    double opaque = 1;  // the stored alpha that is opaque

    /// Whether writing changes more of a value than f32 does.
    bool rounds() const noexcept { return is_integer(type) || type == Type::f16; }
    /// Between neighbouring values of an integer type [value].
    double step() const noexcept { return std::abs(values.slope); }
    friend bool operator==(const WrittenAs&, const WrittenAs&) = default;
};

/// Whether some stored number means the value; f32 and f64 are taken to mean any finite one.
bool can_store(Type type, const ValueMap& values, double value) noexcept;

/// Turns one sample of a result (all its channels, as values) into what the file says of it:
/// rounded and clipped. What is promised of an error is promised of this.
void round_as(const WrittenAs& how, std::span<double> values) noexcept;

}  // namespace edgewise
