#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace edgewise::store {

/// @throws InputError "file: what"
[[noreturn]] void refuse(const std::string& file, const std::string& what);

std::string_view trim(std::string_view text) noexcept;
std::string lower(std::string_view text);
/// Words between blanks.
std::vector<std::string_view> words(std::string_view text);
std::vector<std::string_view> split(std::string_view text, char at);
bool ends_with_any(std::string_view text, const std::vector<std::string>& endings);
/// For messages: no control characters, no longer than a line.
std::string shown(std::string_view text);
/// The same between single quotes.
std::string in_quotes(std::string_view text);

/// A unit of values as a file names it, between quotes or not: "" where it is none that one reads.
std::string unit_of_values(std::string_view text);

/// The whole text as a number, or nothing.
std::optional<std::int64_t> to_integer(std::string_view text) noexcept;
std::optional<double> to_double(std::string_view text) noexcept;

/// All words as numbers. @throws InputError naming file and field
std::vector<double> doubles(const std::string& file, const std::string& field,
                            std::string_view text);
std::vector<std::int64_t> integers(const std::string& file, const std::string& field,
                                   std::string_view text);

/// a * b. @throws InputError where it does not fit into 63 bits
std::int64_t product(const std::string& file, std::int64_t a, std::int64_t b);

/// Sorts "a2" before "a10".
bool numeric_less(std::string_view a, std::string_view b) noexcept;

}  // namespace edgewise::store
