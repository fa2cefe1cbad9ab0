#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>

#include "graph/written.hpp"
#include "io/reader.hpp"

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

float half_to_float(std::uint16_t half) noexcept { return float_of(Half{half}); }

std::uint16_t float_to_half(float value) noexcept { return half_of(value).bits; }

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

void Rounding::tell(const std::string& file, Type from, std::vector<Message>& warnings) const {
    if (rounded > 0)
        warnings.push_back(fmt::format("{}: {} values of type {} were rounded to f32", file,
                                       rounded, name_of(from)));
    if (beyond > 0)
        warnings.push_back(
            fmt::format("{}: {} values are beyond f32 and count as infinite", file, beyond));
}

}  // namespace edgewise::store
