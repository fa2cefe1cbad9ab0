#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/reader.hpp"

namespace edgewise::store {

/// Numbers written as text, as the bytes of native numbers of a type; 64-bit integers where `wide`
/// says so.
std::unique_ptr<Stream> text_stream(std::unique_ptr<Stream> from, Type type, Wide wide,
                                    std::string file);
/// Bytes written as pairs of hexadecimal digits, with blanks anywhere.
std::unique_ptr<Stream> hex_stream(std::unique_ptr<Stream> from, std::string file);

/// Native 64-bit integers as doubles, or as they are (Wide::as_bits). @return how many of them f64
/// rounds
std::int64_t wide_numbers(const std::byte* from, std::size_t count, Wide wide, std::byte* to);
/// 64-bit integers as native doubles.
/// @param rounded  counts those that f64 rounds, and outlives the stream
std::unique_ptr<Stream> wide_stream(std::unique_ptr<Stream> from, Wide wide, bool big_endian,
                                    std::string file, std::int64_t& rounded);
/// Says that some were rounded.
void tell_wide(const Header&, std::int64_t rounded, std::vector<Message>& warnings);

}  // namespace edgewise::store
