// Animated PNG: the first picture is an ordinary PNG's, the others follow in chunks of their own
// (PNG, third edition, 11.3.6).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <zlib.h>

#include "io/frames.hpp"
#include "io/png_data.hpp"

namespace edgewise::store {
namespace {

void append(Bytes& to, std::uint32_t value, int bytes) {
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
        to.push_back(static_cast<std::byte>(value >> shift & 0xff));
}

/// Seconds from a picture to the next, as a fraction.
struct Delay {
    std::uint32_t numerator, denominator;  // 16 bits each
};
Delay delay_of(double fps) {
    const double whole = std::round(fps);
    if (fps >= 1 && std::abs(fps - whole) < 1e-9) return {1, static_cast<std::uint32_t>(whole)};
    const double unit = fps < 1 ? 100 : 10000;  // a hundredth of a second lasts to 655 s
    return {static_cast<std::uint32_t>(std::clamp(std::round(unit / fps), 1.0, 65535.0)),
            static_cast<std::uint32_t>(unit)};
}

class ApngFrames final : public FrameWriter {
 public:
    ApngFrames(Replacement& out, const Header& what, const Pace& pace)
        : out_(out), what_(what), pace_(pace) {
        constexpr std::array<unsigned char, 8> kSignature{0x89, 'P',  'N',  'G',
                                                          '\r', '\n', 0x1a, '\n'};
        constexpr std::array<std::uint32_t, 4> kColours{0, 4, 2, 6};  // grey, with alpha, ...
        out_.write(std::as_bytes(std::span(kSignature)));
        Bytes header;
        append_size(header);
        append(header, what.type == Type::u16 ? 16 : 8, 1);
        append(header, kColours[static_cast<std::size_t>(what.channels - 1)], 1);
        append(header, 0, 3);  // compression, filters, interlacing
        chunk("IHDR", header);
        Bytes control;
        append(control, static_cast<std::uint32_t>(pace.frames), 4);
        append(control, 0, 4);  // for ever
        chunk("acTL", control);
    }

    void add(const void* samples) override {
        Bytes control;
        append(control, sequence_++, 4);
        append_size(control);
        append(control, 0, 4);
        append(control, 0, 4);  // at the left, at the top
        const Delay delay = delay_of(pace_.fps);
        append(control, delay.numerator, 2);
        append(control, delay.denominator, 2);
        append(control, 0, 2);  // the next picture takes the place of this one
        chunk("fcTL", control);
        const std::size_t sample = bytes_of(what_.type);
        compress_png({.first = static_cast<const std::byte*>(samples),
                      .stride = static_cast<std::size_t>(what_.extent.x * what_.channels) * sample,
                      .height = what_.extent.y,
                      .channels = what_.channels,
                      .bytes = static_cast<int>(sample)},
                     [&](std::span<const std::byte> part) {
                         if (first_) return chunk("IDAT", part);
                         Bytes numbered;
                         append(numbered, sequence_++, 4);
                         numbered.insert(numbered.end(), part.begin(), part.end());
                         chunk("fdAT", numbered);
                     });
        first_ = false;
    }

    void finish() override { chunk("IEND", {}); }

 private:
    void append_size(Bytes& to) const {
        append(to, static_cast<std::uint32_t>(what_.extent.x), 4);
        append(to, static_cast<std::uint32_t>(what_.extent.y), 4);
    }

    void chunk(std::string_view name, std::span<const std::byte> content) {
        Bytes head;
        append(head, static_cast<std::uint32_t>(content.size()), 4);
        for (const char letter : name) head.push_back(static_cast<std::byte>(letter));
        const auto sum = [](uLong before, std::span<const std::byte> bytes) {
            return crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
        };
        uLong check = sum(crc32(0, nullptr, 0), std::span(head).subspan(4));
        // Without data zlib would begin again.
        if (!content.empty()) check = sum(check, content);
        Bytes tail;
        append(tail, static_cast<std::uint32_t>(check), 4);
        out_.write(head);
        out_.write(content);
        out_.write(tail);
    }

    Replacement& out_;
    const Header what_;
    const Pace pace_;
    std::uint32_t sequence_ = 0;
    bool first_ = true;
};

}  // namespace

std::unique_ptr<FrameWriter> apng_frames(Replacement& out, const Header& what, const Pace& pace) {
    return std::make_unique<ApngFrames>(out, what, pace);
}

}  // namespace edgewise::store
