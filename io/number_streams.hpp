#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "io/reader.hpp"

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
/// Finds it, while the integers go by.
class WideRange {
 public:
    explicit WideRange(Wide wide) : wide_(wide) {}
    /// Native numbers.
    void take(const std::byte* numbers, std::size_t count);
    Narrowed narrowed() const;

 private:
    template <class T>
    struct Range {
        T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::min();
        bool exact = true;
        void take(T value);
        Narrowed narrowed() const;
    };
    Wide wide_;
    Range<std::int64_t> with_sign_;
    Range<std::uint64_t> without_sign_;
};
/// Reads all of them. @throws InputError short data
Narrowed narrowest(Stream& from, std::int64_t count, Wide wide, bool big_endian,
                   const std::string& file);
/// Sets the type that 64-bit integers are read as, and says so in a warning.
/// @throws InputError labels that no type holds exactly
void take_narrowed(Header&, const Narrowed&);
/// Native 64-bit integers as numbers of a type that holds them (or f64, rounded).
void narrow_numbers(const std::byte* from, std::size_t count, Wide wide, Type type, std::byte* to);
/// 64-bit integers as native numbers of a type that holds them (or f64, rounded).
std::unique_ptr<Stream> narrow_stream(std::unique_ptr<Stream> from, Wide wide, bool big_endian,
                                      Type type, std::string file);

}  // namespace edgewise::store
