#pragma once

#include <cstdint>
#include <stdexcept>

#include "graph/samples.hpp"

namespace edgewise::surface {

/// An isovalue among stored numbers. A sample is inside where its value is at least the isovalue.
///
/// Values are slope * stored + offset in f64. Whether a sample is inside is decided by comparing
/// stored numbers alone, with exactly the same outcome.
struct Level {
    /// Inside: stored >= bound, or stored <= bound where `falls`. Held exactly by the samples'
    /// type.
    double bound = 0;
    bool falls = false;  // values fall as stored numbers grow
    bool none = false;   // no stored number is inside
    float at = 0;        // the isovalue as a stored number: where edges are cut
};

/// Whether samples of a type can be cut: u8, i8, u16, i16 and f32. Others are converted first.
bool can_be_cut(Type type) noexcept;

/// @param type  one that can be cut
/// @param values  of a slope other than 0
Level level_of(double isovalue, Type type, const ValueMap& values);

/// Calls body with a value of the type of samples that can be cut.
/// @throws std::logic_error for others
template <class Body>
decltype(auto) with_cut_type(Type type, Body body) {
    switch (type) {
        case Type::u8:
            return body(std::uint8_t{});
        case Type::i8:
            return body(std::int8_t{});
        case Type::u16:
            return body(std::uint16_t{});
        case Type::i16:
            return body(std::int16_t{});
        case Type::f32:
            return body(float{});
        default:
            throw std::logic_error("samples of a type that cannot be cut");
    }
}

}  // namespace edgewise::surface
