// GIF 89a: pictures of at most 256 colours, compressed by LZW with codes of growing length.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "io/frames.hpp"
#include "io/palette.hpp"
#include "io/reader.hpp"

namespace edgewise::store {
namespace {

/// Codes of growing length, in blocks of at most 255 bytes.
class Lzw {
 public:
    /// @param bits  of a place, at least 2
    Lzw(Replacement& out, int bits) : out_(out), bits_(bits) {
        out_.write(std::as_bytes(std::span(&bits_, 1)));
        clear();
    }

    void add(std::span<const std::uint8_t> places) {
        for (const std::uint8_t place : places) {
            if (prefix_ < 0) {
                prefix_ = place;
                continue;
            }
            const std::uint32_t key = static_cast<std::uint32_t>(prefix_) << 8 | place;
            Entry& entry = find(key);
            if (entry.key == key) {
                prefix_ = entry.code;
                continue;
            }
            put(prefix_);
            grow();
            if (next_ < kCodes)
                entry = {key, next_++};
            else
                clear();
            prefix_ = place;
        }
    }

    void finish() {
        if (prefix_ >= 0) {
            put(prefix_);
            grow();
        }
        put((1 << bits_) + 1);
        if (filled_ > 0) put_byte();
        if (size_ > 0) flush();
        constexpr std::uint8_t kEnd = 0;
        out_.write(std::as_bytes(std::span(&kEnd, 1)));
    }

 private:
    static constexpr int kCodes = 4096;
    static constexpr std::uint32_t kNone = ~0u;
    static constexpr std::size_t kSlots = 16384;
    struct Entry {
        std::uint32_t key = kNone;  // code of what comes before, and a place
        int code = 0;
    };

    Entry& find(std::uint32_t key) {
        std::size_t slot = key * 2654435761u >> 18;
        while (table_[slot].key != kNone && table_[slot].key != key) slot = (slot + 1) % kSlots;
        return table_[slot];
    }
    /// A reader knows one entry less, and its codes grow when that one does not fit.
    void grow() {
        if (next_ == 1 << length_ && length_ < 12) ++length_;
    }
    void clear() {
        if (length_ == 0) length_ = bits_ + 1;
        put(1 << bits_);
        table_.assign(kSlots, {});
        next_ = (1 << bits_) + 2;
        length_ = bits_ + 1;
    }
    void put(int code) {
        waiting_ |= static_cast<std::uint32_t>(code) << filled_;
        filled_ += length_;
        while (filled_ >= 8) put_byte();
    }
    void put_byte() {
        block_[++size_] = static_cast<std::uint8_t>(waiting_ & 0xff);
        waiting_ >>= 8;
        filled_ -= 8;
        if (size_ == 255) flush();
    }
    void flush() {
        block_[0] = static_cast<std::uint8_t>(size_);
        out_.write(std::as_bytes(std::span(block_).first(size_ + 1)));
        size_ = 0;
    }

    Replacement& out_;
    const std::uint8_t bits_;
    std::vector<Entry> table_;
    int next_ = 0, length_ = 0, prefix_ = -1;
    std::uint32_t waiting_ = 0;
    int filled_ = 0;  // bits that wait
    std::array<std::uint8_t, 256> block_{};
    std::size_t size_ = 0;
};

class GifFrames final : public FrameWriter {
 public:
    GifFrames(Replacement& out, const Header& what, const Pace& pace)
        : out_(out),
          width_(static_cast<std::size_t>(what.extent.x)),
          height_(static_cast<std::size_t>(what.extent.y)),
          channels_(static_cast<std::size_t>(what.channels)),
          moves_(pace.frames > 1),
          pace_(pace) {
        text("GIF89a");
        number(width_), number(height_);
        // Grey levels are their own places in a table that all pictures share.
        const bool grey = channels_ == 1;
        bytes({static_cast<std::uint8_t>(grey ? 0xf7 : 0x70), 0, 0});
        for (int level = 0; grey && level < 256; ++level) {
            const auto part = static_cast<std::uint8_t>(level);
            bytes({part, part, part});
        }
        if (!moves_) return;
        bytes({0x21, 0xff, 11});
        text("NETSCAPE2.0");
        bytes({3, 1, 0, 0, 0});  // again, for ever
    }

    void add(const void* samples) override {
        const std::span pixels(static_cast<const std::uint8_t*>(samples),
                               width_ * height_ * channels_);
        const std::optional<int> place = pace_.place_of(frame_++);
        if (!place) return;
        if (moves_) {
            bytes({0x21, 0xf9, 4, 0x04});
            number(static_cast<std::size_t>(pace_.delay(*place)));
            bytes({0, 0});
        }
        bytes({0x2c, 0, 0, 0, 0});
        number(width_), number(height_);
        if (channels_ == 1)
            add_grey(pixels);
        else
            add_colours(pixels);
    }

    void finish() override { bytes({0x3b}); }

 private:
    void add_grey(std::span<const std::uint8_t> pixels) {
        bytes({0});
        Lzw codes(out_, 8);
        codes.add(pixels);
        codes.finish();
    }

    void add_colours(std::span<const std::uint8_t> pixels) {
        const Palette palette = palette_of(pixels);
        const int bits = std::max(1, static_cast<int>(std::bit_width(palette.colours.size() - 1)));
        bytes({static_cast<std::uint8_t>(0x80 | (bits - 1))});
        for (std::size_t i = 0; i < std::size_t{1} << bits; ++i) {
            const Rgb colour = i < palette.colours.size() ? palette.colours[i] : Rgb{};
            bytes({colour[0], colour[1], colour[2]});
        }
        Lzw codes(out_, std::max(2, bits));
        Indexed indexed(palette, width_);
        std::vector<std::uint8_t> places(width_);
        for (std::size_t y = 0; y < height_; ++y) {
            indexed.row(pixels.subspan(3 * y * width_, 3 * width_), places);
            codes.add(places);
        }
        codes.finish();
    }

    void bytes(std::initializer_list<std::uint8_t> values) {
        out_.write(std::as_bytes(std::span(values.begin(), values.size())));
    }
    void text(std::string_view words) { out_.write(std::as_bytes(std::span(words))); }
    void number(std::size_t value) {
        bytes({static_cast<std::uint8_t>(value & 0xff), static_cast<std::uint8_t>(value >> 8)});
    }

    Replacement& out_;
    const std::size_t width_, height_, channels_;
    const bool moves_;
    const GifPace pace_;
    int frame_ = 0;
};

}  // namespace

GifPace::GifPace(const Pace& pace) noexcept
    : frames_(pace.frames), shown_(pace.frames), lasts_(100), places_(pace.fps) {
    constexpr double kLeast = 2;  // [0.01 s]
    if (lasts_ / places_ >= kLeast) return;
    lasts_ = std::max(kLeast, std::round(frames_ * lasts_ / places_));
    shown_ = std::min(frames_, static_cast<int>(lasts_ / kLeast));
    places_ = shown_;
}

std::optional<int> GifPace::place_of(int frame) const noexcept {
    // The first frame of each of so many equal stretches.
    const auto first = [&](std::int64_t place) { return (place * frames_ + shown_ - 1) / shown_; };
    const auto place = static_cast<std::int64_t>(frame) * shown_ / frames_;
    if (first(place) != frame) return std::nullopt;
    return static_cast<int>(place);
}

int GifPace::delay(int place) const noexcept {
    constexpr double kMost = 65535;
    const auto at = [&](int i) { return std::round(lasts_ * i / places_); };
    return static_cast<int>(std::min(at(place + 1) - at(place), kMost));
}

std::unique_ptr<FrameWriter> gif_frames(Replacement& out, const Header& what, const Pace& pace) {
    return std::make_unique<GifFrames>(out, what, pace);
}

void write_gif(Replacement& out, const Header& what, const void* samples) {
    GifFrames frames(out, what, {.frames = 1});
    frames.add(samples);
    frames.finish();
}

}  // namespace edgewise::store
