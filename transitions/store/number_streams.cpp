#include "transitions/store/number_streams.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <span>
#include <type_traits>

#include "transitions/store/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kChunkNumbers = 1 << 12;
constexpr std::size_t kLongestWord = 400;

/// Letters of a stream, one after another.
class Letters {
 public:
    explicit Letters(std::unique_ptr<Stream> from) : from_(std::move(from)) {}
    /// The next, or -1 at the end.
    int next() {
        if (at_ == end_) {
            end_ = from_->read(std::as_writable_bytes(std::span(buffer_)));
            at_ = 0;
            if (end_ == 0) return -1;
        }
        return static_cast<unsigned char>(buffer_[at_++]);
    }

 private:
    std::unique_ptr<Stream> from_;
    std::array<char, 1 << 14> buffer_;
    std::size_t at_ = 0, end_ = 0;
};

bool is_blank(int c) noexcept { return c == ' ' || (c >= '\t' && c <= '\r'); }

class TextStream : public Stream {
 public:
    TextStream(std::unique_ptr<Stream> from, Type type, Wide wide, std::string file)
        : letters_(std::move(from)), type_(type), wide_(wide), file_(std::move(file)) {}

    std::size_t read(std::span<std::byte> into) override {
        const std::size_t width = wide_ == Wide::no ? bytes_of(type_) : 8;
        std::size_t done = 0;
        for (; done + width <= into.size(); done += width) {
            const std::string word = next();
            if (word.empty()) break;
            if (wide_ == Wide::with_sign)
                put_whole<std::int64_t>(word, into.data() + done);
            else if (wide_ == Wide::without_sign)
                put_whole<std::uint64_t>(word, into.data() + done);
            else
                put(word, into.data() + done);
        }
        return done;
    }

 private:
    std::string next() {
        std::string word;
        for (;;) {
            const int c = letters_.next();
            const bool ends = c < 0 || is_blank(c) || c == ',';
            if (!ends) word += static_cast<char>(c);
            if (c < 0 || (ends && !word.empty())) return word;
            if (word.size() > kLongestWord)
                refuse(file_,
                       fmt::format("data hold a word of more than {} letters", kLongestWord));
        }
    }
    template <class T>
    void put_whole(const std::string& word, std::byte* to) {
        T value{};
        const char* const begin = word.data() + word.starts_with('+');
        const char* const end = word.data() + word.size();
        if (const auto [stop, error] = std::from_chars(begin, end, value);
            error != std::errc() || stop != end)
            refuse(file_, "data hold '" + shown(word) + "', expected an integer of 64 bits");
        std::memcpy(to, &value, sizeof value);
    }
    template <class T>
    void put_as(double value, std::byte* to) {
        const T stored = static_cast<T>(value);
        std::memcpy(to, &stored, sizeof stored);
    }
    void put(const std::string& word, std::byte* to) {
        const auto number = to_double(word);
        if (!number) refuse(file_, "data hold '" + shown(word) + "', expected a number");
        double value = *number;
        const auto [low, high] = limits_of(type_);
        if (is_integer(type_) && !(value >= low && value <= high))
            refuse(file_, fmt::format("data hold {}, which {} cannot", value, name_of(type_)));
        switch (type_) {
            case Type::u8:
                return put_as<std::uint8_t>(value, to);
            case Type::i8:
                return put_as<std::int8_t>(value, to);
            case Type::u16:
                return put_as<std::uint16_t>(value, to);
            case Type::i16:
                return put_as<std::int16_t>(value, to);
            case Type::u32:
                return put_as<std::uint32_t>(value, to);
            case Type::i32:
                return put_as<std::int32_t>(value, to);
            case Type::f64:
                return put_as<double>(value, to);
            default:
                // Beyond f32 a cast would be undefined; infinity is what IEEE rounding gives.
                if (value > high || value < low)
                    value = value > 0 ? std::numeric_limits<double>::infinity()
                                      : -std::numeric_limits<double>::infinity();
                return put_as<float>(value, to);
        }
    }

    Letters letters_;
    Type type_;
    Wide wide_;
    std::string file_;
};

class HexStream : public Stream {
 public:
    HexStream(std::unique_ptr<Stream> from, std::string file)
        : letters_(std::move(from)), file_(std::move(file)) {}
    std::size_t read(std::span<std::byte> into) override {
        for (std::size_t done = 0; done < into.size(); ++done) {
            const int high = digit();
            if (high < 0) return done;
            const int low = digit();
            if (low < 0) refuse(file_, "hexadecimal data end inside a byte");
            into[done] = static_cast<std::byte>(16 * high + low);
        }
        return into.size();
    }

 private:
    int digit() {
        int c = letters_.next();
        while (is_blank(c)) c = letters_.next();
        if (c < 0) return -1;
        if (c >= '0' && c <= '9') return c - '0';
        if ((c | 32) >= 'a' && (c | 32) <= 'f') return (c | 32) - 'a' + 10;
        const char letter = static_cast<char>(c);
        refuse(file_, "hexadecimal data hold '" + shown({&letter, 1}) + "'");
    }

    Letters letters_;
    std::string file_;
};

/// Native 64-bit numbers, a chunk at a time.
template <class T>
class WideNumbers {
 public:
    WideNumbers(bool swaps, const std::string& file) : swaps_(swaps), file_(file) {}
    std::span<const T> next(Stream& from, std::size_t count) {
        const auto part = std::span(numbers_).first(std::min(count, numbers_.size()));
        read_all(from, std::as_writable_bytes(part), file_);
        if (swaps_)
            swap_bytes(std::as_writable_bytes(part).data(), sizeof(T),
                       static_cast<std::int64_t>(part.size()));
        return part;
    }

 private:
    bool swaps_;
    const std::string& file_;
    std::array<T, kChunkNumbers> numbers_;
};

template <class T>
Narrowed narrowest_of(Stream& from, std::int64_t count, bool big_endian, const std::string& file) {
    constexpr double kBeyond = std::is_signed_v<T> ? 0x1p63 : 0x1p64;
    WideNumbers<T> numbers(big_endian, file);
    T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::min();
    bool exact = true;
    for (std::int64_t left = count; left > 0;) {
        const auto part = numbers.next(from, static_cast<std::size_t>(left));
        for (const T value : part) {
            low = std::min(low, value);
            high = std::max(high, value);
            // What rounds up to 2^63 or 2^64 must not be cast back.
            const double rounded = static_cast<double>(value);
            exact = exact && rounded < kBeyond && static_cast<T>(rounded) == value;
        }
        left -= static_cast<std::int64_t>(part.size());
    }
    Narrowed narrowed{Type::f64, fmt::format("{} to {}", low, high), exact};
    for (const Type type : {Type::u8, Type::i8, Type::i16, Type::u16, Type::i32, Type::u32}) {
        // Doubles hold the limits of these types; a bound that rounds stays beyond them.
        const auto [least, greatest] = limits_of(type);
        if (static_cast<double>(low) < least || static_cast<double>(high) > greatest) continue;
        narrowed.type = type;
        break;
    }
    return narrowed;
}

template <class T>
class NarrowStream : public Stream {
 public:
    NarrowStream(std::unique_ptr<Stream> from, bool big_endian, Type type, std::string file)
        : from_(std::move(from)),
          type_(type),
          file_(std::move(file)),
          numbers_(big_endian, file_) {}

    std::size_t read(std::span<std::byte> into) override {
        const std::size_t width = bytes_of(type_);
        std::size_t done = 0;
        while (done + width <= into.size()) {
            const auto part = numbers_.next(*from_, (into.size() - done) / width);
            for (const T value : part) {
                put(value, into.data() + done);
                done += width;
            }
        }
        return done;
    }
    bool skip(std::uint64_t bytes) override { return from_->skip(bytes / bytes_of(type_) * 8); }

 private:
    /// The value fits: its range was looked at when the file was described.
    void put(T value, std::byte* to) const {
        if (type_ == Type::f64) {
            const double number = static_cast<double>(value);
            std::memcpy(to, &number, sizeof number);
            return;
        }
        const std::size_t width = bytes_of(type_);
        const bool little = std::endian::native == std::endian::little;
        std::memcpy(to, reinterpret_cast<const std::byte*>(&value) + (little ? 0 : 8 - width),
                    width);
    }

    std::unique_ptr<Stream> from_;
    Type type_;
    std::string file_;
    WideNumbers<T> numbers_;
};

}  // namespace

std::unique_ptr<Stream> text_stream(std::unique_ptr<Stream> from, Type type, Wide wide,
                                    std::string file) {
    return std::make_unique<TextStream>(std::move(from), type, wide, std::move(file));
}

std::unique_ptr<Stream> hex_stream(std::unique_ptr<Stream> from, std::string file) {
    return std::make_unique<HexStream>(std::move(from), std::move(file));
}

Narrowed narrowest(Stream& from, std::int64_t count, Wide wide, bool big_endian,
                   const std::string& file) {
    return wide == Wide::with_sign ? narrowest_of<std::int64_t>(from, count, big_endian, file)
                                   : narrowest_of<std::uint64_t>(from, count, big_endian, file);
}

std::unique_ptr<Stream> narrow_stream(std::unique_ptr<Stream> from, Wide wide, bool big_endian,
                                      Type type, std::string file) {
    if (wide == Wide::with_sign)
        return std::make_unique<NarrowStream<std::int64_t>>(std::move(from), big_endian, type,
                                                            std::move(file));
    return std::make_unique<NarrowStream<std::uint64_t>>(std::move(from), big_endian, type,
                                                         std::move(file));
}

}  // namespace edgewise::store
