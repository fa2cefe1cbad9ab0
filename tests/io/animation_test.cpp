#include "io/animation.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "graph/errors.hpp"
#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

Header picture_of(std::int64_t width, std::int64_t height, int channels, Type type = Type::u8) {
    Header what;
    what.volume = false;
    what.extent = {width, height, 1};
    what.channels = channels;
    what.type = type;
    return what;
}

/// What a GIF holds, decoded from its specification.
struct Gif {
    std::size_t width = 0, height = 0;
    bool repeats = false;
    std::vector<int> delays;                        // hundredths of a second
    std::vector<std::vector<std::uint8_t>> frames;  // red, green, blue

    explicit Gif(const std::string& bytes) : bytes_(bytes) {
        EXPECT_EQ(bytes.substr(0, 6), "GIF89a");
        at_ = 6;
        width = number(), height = number();
        const int flags = byte();
        at_ += 2;
        std::string shared;
        if (flags & 0x80) shared = take(3 << ((flags & 7) + 1));
        for (int kind = byte(); kind != 0x3b; kind = byte()) {
            if (kind == 0x21) {
                extension();
                continue;
            }
            if (kind != 0x2c) {
                ADD_FAILURE() << "block " << kind;
                return;
            }
            at_ += 8;
            const int local = byte();
            const std::string table = local & 0x80 ? take(3 << ((local & 7) + 1)) : shared;
            std::vector<std::uint8_t> pixels;
            for (const int place : places())
                for (int c = 0; c < 3; ++c)
                    pixels.push_back(static_cast<std::uint8_t>(table.at(3 * place + c)));
            EXPECT_EQ(pixels.size(), 3 * width * height);
            frames.push_back(pixels);
        }
        EXPECT_EQ(at_, bytes.size());
    }

 private:
    int byte() { return static_cast<std::uint8_t>(bytes_.at(at_++)); }
    std::size_t number() {
        const int low = byte();
        return static_cast<std::size_t>(low + 256 * byte());
    }
    std::string take(int count) {
        at_ += static_cast<std::size_t>(count);
        return bytes_.substr(at_ - static_cast<std::size_t>(count),
                             static_cast<std::size_t>(count));
    }
    std::string blocks() {
        std::string data;
        for (int size = byte(); size > 0; size = byte()) data += take(size);
        return data;
    }
    void extension() {
        const int label = byte();
        const std::string data = blocks();
        if (label == 0xf9)
            delays.push_back(static_cast<std::uint8_t>(data[1]) +
                             256 * static_cast<std::uint8_t>(data[2]));
        if (label == 0xff) repeats = data == std::string("NETSCAPE2.0\1\0\0", 14);
    }
    /// LZW: each new entry is the one before and the first of what follows.
    std::vector<int> places() {
        const int bits = byte();
        const std::string data = blocks();
        const int clear = 1 << bits;
        std::vector<std::vector<int>> table;
        const auto begin = [&] {
            table.clear();
            for (int i = 0; i < clear + 2; ++i) table.push_back({i});
        };
        begin();
        std::vector<int> out, before;
        int length = bits + 1;
        for (std::size_t bit = 0; bit + length <= 8 * data.size();) {
            int code = 0;
            for (int i = 0; i < length; ++i, ++bit)
                code |= (static_cast<std::uint8_t>(data[bit / 8]) >> bit % 8 & 1) << i;
            if (code == clear) {
                begin();
                before.clear();
                length = bits + 1;
                continue;
            }
            if (code == clear + 1) return out;
            std::vector<int> now = code < static_cast<int>(table.size()) ? table[code] : before;
            if (code >= static_cast<int>(table.size())) now.push_back(before.at(0));
            out.insert(out.end(), now.begin(), now.end());
            if (!before.empty() && table.size() < 4096) {
                before.push_back(now[0]);
                table.push_back(before);
            }
            if (static_cast<int>(table.size()) == 1 << length && length < 12) ++length;
            before = now;
        }
        ADD_FAILURE() << "no end code";
        return out;
    }

    const std::string& bytes_;
    std::size_t at_ = 0;
};

std::vector<std::uint8_t> noise(std::size_t count, int most, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> value(0, most);
    std::vector<std::uint8_t> values(count);
    for (auto& one : values) one = static_cast<std::uint8_t>(value(random));
    return values;
}

TEST(Animation, GreyFramesOfAGifAreKept) {
    Scratch scratch;
    const std::string path = scratch.path("a.gif");
    // Noise fills the table of codes and empties it, several times.
    const Header what = picture_of(301, 157, 1);
    std::vector<std::vector<std::uint8_t>> frames;
    Animation animation(path, what, {.frames = 4, .fps = 15});
    for (unsigned i = 0; i < 4; ++i) {
        frames.push_back(noise(301 * 157, i == 2 ? 0 : 255 >> i, i));
        animation.add(frames.back().data());
    }
    EXPECT_FALSE(std::filesystem::exists(path)) << "before it is whole";
    animation.commit();
    const Gif gif(bytes_in(path));
    ASSERT_EQ(gif.frames.size(), 4u);
    EXPECT_TRUE(gif.repeats);
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t pixel = 0; pixel < frames[i].size(); ++pixel)
            for (std::size_t c = 0; c < 3; ++c)
                ASSERT_EQ(gif.frames[i][3 * pixel + c], frames[i][pixel]) << i << ' ' << pixel;
    // A fifteenth of a second is no whole number of hundredths; together they are right.
    EXPECT_EQ(gif.delays, (std::vector<int>{7, 6, 7, 7}));
}

/// A GIF of so many pictures, each of one level that is its number.
Gif counted(const std::string& path, int frames, double fps) {
    Animation animation(path, picture_of(3, 2, 1), {.frames = frames, .fps = fps});
    for (int i = 0; i < frames; ++i) {
        const std::vector<std::uint8_t> pixels(6, static_cast<std::uint8_t>(i));
        animation.add(pixels.data());
    }
    animation.commit();
    return Gif(bytes_in(path));
}

TEST(Animation, NoPictureOfAGifIsShorterThanViewersKeep) {
    Scratch scratch;
    const std::string path = scratch.path("a.gif");
    for (const double fps : {0.5, 7.0, 12.5, 15.0, 24.0, 29.97, 30.0, 40.0, 49.0, 50.0, 51.0, 59.94,
                             60.0, 75.0, 99.0, 100.0})
        for (const int frames : {2, 3, 7, 30, 100, 255}) {
            const Gif gif = counted(path, frames, fps);
            const int left_out = frames_left_out(path, {frames, fps});
            ASSERT_EQ(gif.frames.size() + static_cast<std::size_t>(left_out),
                      static_cast<std::size_t>(frames));
            if (fps <= 50) {
                EXPECT_EQ(left_out, 0) << fps;
            }
            if (gif.delays.empty()) continue;
            double lasts = 0;
            for (const int delay : gif.delays) {
                EXPECT_GE(delay, 2) << fps << " of " << frames;
                lasts += delay;
            }
            // Whole hundredths, and a single picture lasts for two.
            EXPECT_NEAR(lasts, std::max(2.0, 100 * frames / fps), 0.5 + 1e-9) << fps << frames;
            // Each picture is on where it belongs: to within half a hundredth; where some are left
            // out, to within one of them (two hundredths at most) and half a hundredth each of the
            // picture's place and of how long all last.
            double at = 0;
            for (std::size_t i = 0; i < gif.frames.size(); ++i) {
                const double belongs = 100 * gif.frames[i][0] / fps;
                EXPECT_NEAR(at, belongs, fps <= 50 ? 0.51 : 3.01) << fps << ' ' << frames;
                at += gif.delays[i];
            }
        }
    EXPECT_EQ(frames_left_out("a.gif", {30, 60}), 5);
    EXPECT_EQ(frames_left_out("a.gif", {100, 100}), 50);
    EXPECT_EQ(frames_left_out("a.apng", {30, 60}), 0);
    EXPECT_EQ(frames_left_out("a.mp4", {30, 60}), 0);
}

TEST(Animation, FewColoursOfAGifAreKept) {
    Scratch scratch;
    for (const int colours : {1, 2, 3, 5, 17, 256}) {
        const std::string path = scratch.path("a.gif");
        std::vector<std::uint8_t> pixels;
        for (const int place : noise(40 * 30, 255, 7)) {
            const int i = place % colours;
            for (const int part : {i, 255 - i, i * 7 % 256})
                pixels.push_back(static_cast<std::uint8_t>(part));
        }
        write(path, picture_of(40, 30, 3), pixels.data());
        const Gif gif(bytes_in(path));
        ASSERT_EQ(gif.frames.size(), 1u) << "one picture";
        EXPECT_TRUE(gif.delays.empty());
        EXPECT_FALSE(gif.repeats);
        EXPECT_EQ(gif.frames[0], pixels) << colours;
    }
}

TEST(Animation, ManyColoursOfAGifAreNear) {
    Scratch scratch;
    const std::string path = scratch.path("a.gif");
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 128; ++x) {
            const bool ground = x < 30;
            for (const int part : {2 * x, 2 * y, 255 - x - y})
                pixels.push_back(static_cast<std::uint8_t>(ground ? 1 : part));
        }
    write(path, picture_of(128, 128, 3), pixels.data());
    const Gif gif(bytes_in(path));
    double square = 0, mean = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double off = double(gif.frames[0][i]) - pixels[i];
        square += off * off, mean += off;
        if (i / 3 % 128 < 30) {
            ASSERT_EQ(gif.frames[0][i], 1) << "the background stays";
        }
    }
    // A plane of 196 x 256 levels in 255 boxes: sides of 14, so 14 / sqrt(12) a channel, and errors
    // that are spread add as much.
    EXPECT_LT(std::sqrt(square / double(pixels.size())), 9);
    EXPECT_LT(std::abs(mean / double(pixels.size())), 0.5) << "errors are spread";
}

std::uint32_t big(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
    return value;
}

TEST(Animation, EachFrameOfAnApngIsAPng) {
    Scratch scratch;
    for (const Type type : {Type::u8, Type::u16})
        for (const int channels : {1, 2, 3, 4}) {
            const Header what = picture_of(67, 45, channels, type);
            const std::size_t bytes = 67 * 45 * channels * bytes_of(type);
            const std::string path = scratch.path("a.apng");
            Animation animation(path, what, {.frames = 3, .fps = 12.5});
            std::vector<std::vector<std::uint8_t>> frames;
            for (unsigned i = 0; i < 3; ++i) {
                frames.push_back(noise(bytes, 200, i));
                animation.add(frames.back().data());
            }
            animation.commit();
            // Its chunks, and the files that single frames would be.
            const std::string file = bytes_in(path);
            std::string header, sequence;
            std::vector<std::string> data;
            for (std::size_t at = 8; at < file.size(); at += 12 + big(file, at)) {
                const std::string name = file.substr(at + 4, 4);
                const std::string body = file.substr(at + 8, big(file, at));
                if (name == "IHDR") header = file.substr(0, at + 12 + body.size());
                if (name == "acTL") {
                    EXPECT_EQ(big(body, 0), 3u);
                    EXPECT_EQ(big(body, 4), 0u);
                }
                if (name == "fcTL") {
                    EXPECT_EQ(big(body, 4), 67u);
                    EXPECT_EQ(big(body, 8), 45u);
                    EXPECT_EQ(big(body, 20), 800u << 16 | 10000u);
                    data.emplace_back();
                }
                if (name == "fcTL" || name == "fdAT") sequence += body.substr(0, 4);
                if (name == "IDAT") {
                    ASSERT_EQ(data.size(), 1u);
                    data.back() += body;
                }
                if (name == "fdAT") {
                    ASSERT_GT(data.size(), 1u);
                    data.back() += body.substr(4);
                }
            }
            ASSERT_EQ(data.size(), 3u);
            for (std::size_t i = 0; i < sequence.size() / 4; ++i)
                EXPECT_EQ(big(sequence, 4 * i), i);
            for (std::size_t i = 0; i < 3; ++i) {
                const std::string one = scratch.path("one.png");
                write(one, what, frames[i].data());
                const std::string png = bytes_in(one);
                std::string packed;
                for (std::size_t at = 8; at < png.size(); at += 12 + big(png, at))
                    if (png.substr(at + 4, 4) == "IDAT") packed += png.substr(at + 8, big(png, at));
                EXPECT_EQ(data[i], packed) << i;
                EXPECT_EQ(png.substr(0, header.size()), header);
            }
            // Whoever knows no animations sees the first frame.
            const Loaded got = loaded(path);
            EXPECT_EQ(0, std::memcmp(got.samples.data(), frames[0].data(), bytes));
        }
}

TEST(Animation, RefusesWhatNoAnimationIs) {
    Scratch scratch;
    EXPECT_THROW(Animation(scratch.path("a.png"), picture_of(4, 4, 1), {.frames = 2}),
                 RequestError);
    EXPECT_THROW(Animation(scratch.path("a.gif"), picture_of(4, 4, 4), {.frames = 2}),
                 RequestError);
    EXPECT_THROW(Animation(scratch.path("a.gif"), picture_of(70000, 1, 1), {.frames = 2}),
                 RequestError);
    EXPECT_THROW(Animation(scratch.path("none/a.gif"), picture_of(4, 4, 1), {.frames = 2}),
                 RunError);
    const std::string path = scratch.path("short.gif");
    const std::vector<std::uint8_t> pixels(16);
    Animation animation(path, picture_of(4, 4, 1), {.frames = 2});
    animation.add(pixels.data());
    EXPECT_THROW(animation.commit(), RunError);
    EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace edgewise::store
