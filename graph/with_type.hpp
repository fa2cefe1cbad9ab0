#pragma once

#include <cstdint>
#include <stdexcept>

#include "graph/samples.hpp"

namespace edgewise {

/// Calls body with a value of the C++ type that stands for a stored type, and returns what it does.
/// @throws std::logic_error for f16 and complex samples, which are converted when they are read
template <class Body>
decltype(auto) with_type(Type type, Body&& body) {
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
        case Type::f32:
            return body(float{});
        case Type::f64:
            return body(double{});
        case Type::f16:
        case Type::c64:
            break;
    }
    throw std::logic_error("samples of no arithmetic type");
}

}  // namespace edgewise
