#include "io/number_streams.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <span>
#include <type_traits>

#include "graph/with_type.hpp"
#include "io/text.hpp"

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
class WideNumbers {
 public:
    WideNumbers(bool swaps, const std::string& file) : swaps_(swaps), file_(file) {}
    /// @return how many there are, at data()
    std::size_t next(Stream& from, std::size_t count) {
        count = std::min(count, kChunkNumbers);
        const auto part = std::span(bytes_).first(8 * count);
        read_all(from, part, file_);
        if (swaps_) swap_bytes(part.data(), 8, static_cast<std::int64_t>(count));
        return count;
    }
    const std::byte* data() const { return bytes_.data(); }

 private:
    bool swaps_;
    const std::string& file_;
    Bytes bytes_ = Bytes(8 * kChunkNumbers);
};

class WideStream : public Stream {
 public:
    WideStream(std::unique_ptr<Stream> from, Wide wide, bool big_endian, std::string file,
               std::int64_t& rounded)
        : from_(std::move(from)),
          wide_(wide),
          file_(std::move(file)),
          numbers_(big_endian, file_),
          rounded_(rounded) {}

    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done + 8 <= into.size()) {
            const std::size_t count = numbers_.next(*from_, (into.size() - done) / 8);
            rounded_ += wide_numbers(numbers_.data(), count, wide_, into.data() + done);
            done += 8 * count;
        }
        return done;
    }
    bool skip(std::uint64_t bytes) override { return from_->skip(bytes); }

 private:
    std::unique_ptr<Stream> from_;
    Wide wide_;
    std::string file_;
    WideNumbers numbers_;
    std::int64_t& rounded_;
};

template <class T>
std::int64_t to_doubles(const std::byte* from, std::size_t count, std::byte* to) {
    // What rounds up to 2^63 or 2^64 must not be cast back.
    constexpr double kBeyond = std::is_signed_v<T> ? 0x1p63 : 0x1p64;
    std::int64_t rounded = 0;
    for (std::size_t i = 0; i < count; ++i) {
        T value;
        std::memcpy(&value, from + 8 * i, 8);
        const double number = static_cast<double>(value);
        rounded += !(number < kBeyond && static_cast<T>(number) == value);
        std::memcpy(to + 8 * i, &number, 8);
    }
    return rounded;
}

}  // namespace

std::unique_ptr<Stream> text_stream(std::unique_ptr<Stream> from, Type type, Wide wide,
                                    std::string file) {
    return std::make_unique<TextStream>(std::move(from), type, wide, std::move(file));
}

std::unique_ptr<Stream> hex_stream(std::unique_ptr<Stream> from, std::string file) {
    return std::make_unique<HexStream>(std::move(from), std::move(file));
}

std::int64_t wide_numbers(const std::byte* from, std::size_t count, Wide wide, std::byte* to) {
    if (wide == Wide::as_bits) {
        std::memcpy(to, from, 8 * count);
        return 0;
    }
    return wide == Wide::with_sign ? to_doubles<std::int64_t>(from, count, to)
                                   : to_doubles<std::uint64_t>(from, count, to);
}

std::unique_ptr<Stream> wide_stream(std::unique_ptr<Stream> from, Wide wide, bool big_endian,
                                    std::string file, std::int64_t& rounded) {
    return std::make_unique<WideStream>(std::move(from), wide, big_endian, std::move(file),
                                        rounded);
}

void tell_wide(const Header& header, std::int64_t rounded, std::vector<Message>& warnings) {
    if (rounded == 0) return;
    warnings.push_back(message(
        "{}: {} of its 64-bit integers are beyond 2^53, and f64 rounds them; @labels keeps them",
        header.file, rounded));
}

namespace {

/// Integers that are held by a wider type.
template <class From, class To>
void narrow_each(const Array& from, Array& to) {
    const auto* in = static_cast<const From*>(from.data());
    auto* out = static_cast<To*>(to.data());
    const std::size_t count = from.bytes() / sizeof(From);
    for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<To>(in[i]);
}

template <class From>
Type narrow_from(const Header& header, Type& type, Array& samples,
                 std::pmr::memory_resource* memory, std::vector<Message>& warnings) {
    const auto* numbers = static_cast<const From*>(samples.data());
    const std::size_t count = samples.bytes() / sizeof(From);
    const auto [low, high] = std::minmax_element(numbers, numbers + count);
    Type found = Type::f64;
    for (const Type one : {Type::u32, Type::i32, Type::u16, Type::i16, Type::i8, Type::u8}) {
        const auto [least, most] = limits_of(one);
        if (static_cast<double>(*low) >= least && static_cast<double>(*high) <= most) found = one;
    }
    warnings.push_back(fmt::format("{}: its 64-bit integers of {:.0f} to {:.0f} are read as {}",
                                   header.file, *low, *high, name_of(found)));
    if (bytes_of(found) >= sizeof(From)) return found;
    Array narrow(count * bytes_of(found), memory);
    with_type(found, [&](auto zero) { narrow_each<From, decltype(zero)>(samples, narrow); });
    samples = std::move(narrow);
    type = found;
    return found;
}

}  // namespace

Type narrow_wide(const Header& header, Type& type, Array& samples, std::pmr::memory_resource* from,
                 std::vector<Message>& warnings) {
    return type == Type::f32 ? narrow_from<float>(header, type, samples, from, warnings)
                             : narrow_from<double>(header, type, samples, from, warnings);
}

}  // namespace edgewise::store
