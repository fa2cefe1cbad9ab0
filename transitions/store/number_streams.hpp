#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "transitions/store/reader.hpp"

namespace edgewise::store {

/// Numbers written as text, as the bytes of native numbers of a type; 64-bit integers where `wide`
/// says so.
std::unique_ptr<Stream> text_stream(std::unique_ptr<Stream> from, Type type, Wide wide,
                                    std::string file);
/// Bytes written as pairs of hexadecimal digits, with blanks anywhere.
std::unique_ptr<Stream> hex_stream(std::unique_ptr<Stream> from, std::string file);

/// The smallest type that holds each of some 64-bit integers; f64 where none does.
struct Narrowed {
    Type type = Type::f64;
    std::string range;  // "-3 to 993"
    bool exact = true;  // false: f64 rounds some of them
};
/// Reads all of them. @throws InputError short data
Narrowed narrowest(Stream& from, std::int64_t count, Wide wide, bool big_endian,
                   const std::string& file);
/// 64-bit integers as native numbers of a type that holds them (or f64, rounded).
std::unique_ptr<Stream> narrow_stream(std::unique_ptr<Stream> from, Wide wide, bool big_endian,
                                      Type type, std::string file);

}  // namespace edgewise::store
