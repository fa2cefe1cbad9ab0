#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace edgewise {

/// How one stored number is written. Complex samples are pairs of f32.
enum class Type : std::uint8_t { u8, i8, u16, i16, u32, i32, f16, f32, f64, c64 };

/// Bytes of one stored number; c64 counts both parts (8).
std::size_t bytes_of(Type type) noexcept;
/// "u8" ... "c64", as the command line and the JSON write them.
std::string_view name_of(Type type) noexcept;
/// The inverse of name_of. Throws RequestError for a name it does not know.
Type type_named(std::string_view name);
bool is_integer(Type type) noexcept;
/// The least and greatest value that the type can hold (for floating types the finite range).
std::array<double, 2> limits_of(Type type) noexcept;

/// Samples along x, y and z; x runs fastest in memory. An image has z = 1.
struct Extent {
    std::int64_t x = 1, y = 1, z = 1;

    std::int64_t samples() const noexcept { return x * y * z; }
    std::int64_t operator[](int axis) const noexcept { return axis == 0 ? x : axis == 1 ? y : z; }
    std::int64_t& operator[](int axis) noexcept { return axis == 0 ? x : axis == 1 ? y : z; }
    friend bool operator==(const Extent&, const Extent&) = default;
};

/// A half-open box of sample indices: begin <= index < end on every axis.
struct Region {
    std::array<std::int64_t, 3> begin{0, 0, 0}, end{0, 0, 0};

    static Region all(const Extent& extent) noexcept {
        return {{0, 0, 0}, {extent.x, extent.y, extent.z}};
    }
    Extent extent() const noexcept {
        return {end[0] - begin[0], end[1] - begin[1], end[2] - begin[2]};
    }
    bool empty() const noexcept {
        return end[0] <= begin[0] || end[1] <= begin[1] || end[2] <= begin[2];
    }
    friend bool operator==(const Region&, const Region&) = default;
};

/// What stored numbers mean: value = slope * stored + offset.
struct ValueMap {
    double slope = 1, offset = 0;

    double operator()(double stored) const noexcept { return slope * stored + offset; }
    bool identity() const noexcept { return slope == 1 && offset == 0; }
    friend bool operator==(const ValueMap&, const ValueMap&) = default;
};

}  // namespace edgewise
