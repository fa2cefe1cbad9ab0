// Pictures of the kinds that OpenImageIO knows: what is written is read again, and read by small
// parsers of the test's own that follow the formats' descriptions.

#include <cmath>
#include <ctime>
#include <gtest/gtest.h>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

constexpr std::size_t kWidth = 13, kHeight = 9;

Header picture(Type type, int channels, Alpha alpha = Alpha::none) {
    Header what;
    what.volume = false;
    what.extent = {kWidth, kHeight, 1};
    what.type = type;
    what.channels = channels;
    what.alpha = alpha;
    return what;
}

template <class T>
std::vector<T> values_of(int channels) {
    std::vector<T> values(kWidth * kHeight * static_cast<std::size_t>(channels));
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<T>(i * 2654435761u % (sizeof(T) == 1 ? 256 : 65521));
    return values;
}

unsigned byte(const std::string& bytes, std::size_t at) {
    return static_cast<unsigned char>(bytes.at(at));
}
unsigned little(const std::string& bytes, std::size_t at, int width) {
    unsigned value = 0;
    for (int i = width - 1; i >= 0; --i)
        value = value << 8 | byte(bytes, at + static_cast<std::size_t>(i));
    return value;
}
unsigned big(const std::string& bytes, std::size_t at, int width) {
    unsigned value = 0;
    for (int i = 0; i < width; ++i)
        value = value << 8 | byte(bytes, at + static_cast<std::size_t>(i));
    return value;
}
float as_float(unsigned bits) {
    float value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

using Numbers = std::vector<double>;  // rows from the top, channels together

template <class T>
Numbers numbers(const std::vector<T>& values) {
    return {values.begin(), values.end()};
}

/// Writes a picture and returns the bytes of the file.
template <class T>
std::string written(const Scratch& scratch, const std::string& name, const Header& what,
                    const std::vector<T>& values, const WriteOptions& options = {}) {
    write(scratch.path(name), what, values.data(), options);
    return bytes_in(scratch.path(name));
}

/// Netpbm and PFM: three words of a header, one blank, samples.
Numbers parse_pnm(const std::string& bytes) {
    std::size_t at = 0;
    const auto word = [&] {
        const std::size_t end = bytes.find_first_of(" \n", at);
        const std::string found = bytes.substr(at, end - at);
        at = end + 1;
        return found;
    };
    const std::string kind = word(), width = word(), height = word(), last = word();
    EXPECT_EQ(width + "x" + height, "13x9");
    const bool floats = kind == "PF" || kind == "Pf";
    const std::size_t channels = kind == "PF" || kind == "P6" ? 3 : 1;
    const int size = floats ? 4 : last == "65535" ? 2 : 1;
    EXPECT_EQ(last, floats ? "-1.0" : size == 2 ? "65535" : "255");
    Numbers all;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t i = 0; i < kWidth * channels; ++i) {
            const std::size_t row = floats ? kHeight - 1 - y : y;
            const std::size_t from =
                at + (row * kWidth * channels + i) * static_cast<std::size_t>(size);
            all.push_back(floats ? as_float(little(bytes, from, 4)) : big(bytes, from, size));
        }
    EXPECT_EQ(bytes.size(), at + all.size() * static_cast<std::size_t>(size));
    return all;
}

/// Uncompressed BMP of 8 (grey palette), 24 or 32 bits, bottom row first.
Numbers parse_bmp(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 2), "BM");
    EXPECT_EQ(little(bytes, 2, 4), bytes.size());
    EXPECT_EQ(little(bytes, 18, 4), kWidth);
    EXPECT_EQ(little(bytes, 22, 4), kHeight);
    const std::size_t pixel = little(bytes, 28, 2) / 8, stride = (kWidth * pixel + 3) / 4 * 4;
    Numbers all;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x) {
            const std::size_t at = little(bytes, 10, 4) + (kHeight - 1 - y) * stride + x * pixel;
            if (pixel == 1)  // through the palette
                all.push_back(byte(bytes, 14 + little(bytes, 14, 4) + 4 * byte(bytes, at)));
            for (const std::size_t c : {2u, 1u, 0u, 3u})
                if (pixel > 1 && c < pixel) all.push_back(byte(bytes, at + c));
        }
    return all;
}

/// Uncompressed TGA of grey, grey with alpha, colour, colour with alpha.
Numbers parse_tga(const std::string& bytes) {
    EXPECT_EQ(byte(bytes, 1), 0u);
    EXPECT_EQ(little(bytes, 12, 2), kWidth);
    EXPECT_EQ(little(bytes, 14, 2), kHeight);
    const std::size_t pixel = byte(bytes, 16) / 8;
    EXPECT_EQ(byte(bytes, 2), pixel < 3 ? 3u : 2u);
    const bool down = (byte(bytes, 17) & 0x20) != 0;
    Numbers all;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x) {
            const std::size_t row = down ? y : kHeight - 1 - y;
            const std::size_t at = 18 + byte(bytes, 0) + (row * kWidth + x) * pixel;
            for (std::size_t c = 0; c < pixel; ++c)
                all.push_back(byte(bytes, at + (pixel >= 3 && c < 3 ? 2 - c : c)));
        }
    return all;
}

/// SGI as stored: planes of channels, bottom row first, big-endian.
Numbers parse_sgi(const std::string& bytes) {
    EXPECT_EQ(big(bytes, 0, 2), 474u);
    EXPECT_EQ(byte(bytes, 2), 0u);
    const int size = static_cast<int>(byte(bytes, 3));
    const std::size_t channels = big(bytes, 10, 2) == 0 ? 1 : big(bytes, 10, 2);
    EXPECT_EQ(big(bytes, 6, 2), kWidth);
    EXPECT_EQ(big(bytes, 8, 2), kHeight);
    Numbers all;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x)
            for (std::size_t c = 0; c < channels; ++c)
                all.push_back(big(bytes,
                                  512 + ((c * kHeight + kHeight - 1 - y) * kWidth + x) *
                                            static_cast<std::size_t>(size),
                                  size));
    return all;
}

/// DPX of one element with 8, 16 or 32 bits and no padding (SMPTE 268M), either byte order.
Numbers parse_dpx(const std::string& bytes) {
    const bool is_big = bytes.substr(0, 4) == "SDPX";
    const auto number = [&](std::size_t at, int width) {
        return is_big ? big(bytes, at, width) : little(bytes, at, width);
    };
    EXPECT_EQ(number(772, 4), kWidth);
    EXPECT_EQ(number(776, 4), kHeight);
    const unsigned kind = byte(bytes, 800);
    const std::size_t channels = kind == 50 ? 3 : kind == 51 ? 4 : 1;
    const int size = static_cast<int>(byte(bytes, 803)) / 8;
    Numbers all;
    for (std::size_t i = 0; i < kWidth * kHeight * channels; ++i) {
        const unsigned bits = number(number(4, 4) + i * static_cast<std::size_t>(size), size);
        all.push_back(size == 4 ? as_float(bits) : bits);
    }
    return all;
}

/// Radiance: a header of lines, then flat or run-length coded rows of RGBE.
Numbers parse_hdr(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 2), "#?");
    std::size_t at = bytes.find("\n\n") + 2;
    const std::size_t end = bytes.find('\n', at);
    EXPECT_EQ(bytes.substr(at, end - at), "-Y 9 +X 13");
    at = end + 1;
    Numbers all;
    for (std::size_t y = 0; y < kHeight; ++y) {
        std::string planes;
        if (byte(bytes, at) == 2 && byte(bytes, at + 1) == 2) {
            for (at += 4; planes.size() < 4 * kWidth;) {
                const std::size_t count = byte(bytes, at++);
                if (count > 128) {
                    planes += std::string(count - 128, bytes.at(at++));
                } else {
                    planes += bytes.substr(at, count);
                    at += count;
                }
            }
        } else {
            for (std::size_t c = 0; c < 4; ++c)
                for (std::size_t x = 0; x < kWidth; ++x) planes += bytes.at(at + 4 * x + c);
            at += 4 * kWidth;
        }
        for (std::size_t x = 0; x < kWidth; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                all.push_back(std::ldexp(byte(planes, c * kWidth + x),
                                         static_cast<int>(byte(planes, 3 * kWidth + x)) - 136));
    }
    return all;
}

TEST(Pictures, OtherReadersSeeTheSame) {
    Scratch scratch;
    const auto check = [&](const char* name, Numbers (*parse)(const std::string&), auto kind,
                           std::vector<int> counts) {
        using T = decltype(kind);
        const Type type = sizeof(T) == 1 ? Type::u8 : sizeof(T) == 2 ? Type::u16 : Type::f32;
        for (const int channels : counts) {
            auto values = values_of<T>(channels);
            if (type == Type::f32) values[5] = static_cast<T>(-0.25);
            const std::string bytes = written(scratch, name, picture(type, channels), values);
            EXPECT_EQ(parse(bytes), numbers(values)) << name << channels << name_of(type);
        }
    };
    for (const char* name : {"a.pnm", "a.pgm"}) check(name, parse_pnm, std::uint8_t{}, {1});
    for (const char* name : {"a.pnm", "a.ppm"}) check(name, parse_pnm, std::uint16_t{}, {3});
    check("a.ppm", parse_pnm, std::uint8_t{}, {3});
    check("a.pgm", parse_pnm, std::uint16_t{}, {1});
    check("a.pfm", parse_pnm, float{}, {1, 3});
    check("a.bmp", parse_bmp, std::uint8_t{}, {1, 3, 4});
    check("a.tga", parse_tga, std::uint8_t{}, {1, 2, 3, 4});
    check("a.sgi", parse_sgi, std::uint8_t{}, {1, 2, 3, 4});
    check("a.sgi", parse_sgi, std::uint16_t{}, {1, 3, 4});
    check("a.dpx", parse_dpx, std::uint8_t{}, {1, 3, 4});
    check("a.dpx", parse_dpx, std::uint16_t{}, {1, 3, 4});
    check("a.dpx", parse_dpx, float{}, {1, 3, 4});
}

TEST(Pictures, GreyBecomesColourWhereThereIsNoGrey) {
    Scratch scratch;
    const auto values = values_of<std::uint8_t>(1);
    for (const char* name : {"a.webp", "a.ppm"}) {
        written(scratch, name, picture(Type::u8, 1), values);
        const Loaded got = loaded(scratch.path(name));
        ASSERT_EQ(got.header.channels, 3) << name;
        const auto read = samples_of<std::uint8_t>(got);
        for (std::size_t i = 0; i < read.size(); ++i)
            ASSERT_EQ(read[i], values[i / 3]) << name << i;
    }
}

TEST(Pictures, RadianceKeepsEightBitsOfTheLargest) {
    Scratch scratch;
    for (const int channels : {1, 3}) {
        auto values = values_of<float>(channels);
        for (float& value : values) value /= 300;
        values[3] = -1;
        values[4] = std::nanf("");
        values[5] = 1e-30f;
        const std::string bytes = written(scratch, "a.hdr", picture(Type::f32, channels), values);
        const Numbers seen = parse_hdr(bytes);
        const auto read = samples_of<float>(loaded(scratch.path("a.hdr")));
        ASSERT_EQ(read.size(), seen.size());
        for (std::size_t i = 0; i < seen.size(); i += 3)
            for (std::size_t c = 0; c < 3; ++c) {
                const auto given = [&](std::size_t k) {
                    const float value = values[channels == 1 ? i / 3 : i + k];
                    return value > 0 ? value : 0;
                };
                // The mantissa of the largest is 128 to 255, and is cut off. Readers take the lower
                // end of a step, or its middle.
                const double step = std::max({given(0), given(1), given(2)}) / 128;
                EXPECT_NEAR(seen[i + c], given(c), step) << i + c;
                EXPECT_NEAR(read[i + c], seen[i + c], step / 2) << i + c;
            }
    }
}

/// Straight colour that is written to a format of multiplied colour, and the reverse.
TEST(Pictures, AlphaIsWhatTheFormatHolds) {
    Scratch scratch;
    for (const Format& format : formats()) {
        const std::string name = "a" + format.endings[0];
        for (const Alpha alpha : {Alpha::straight, Alpha::premultiplied}) {
            const Header bytes = picture(Type::u8, 4, alpha), floats = picture(Type::f32, 4, alpha);
            const bool as_bytes = cannot_write(name, bytes).empty();
            if (format.library.empty() || (!as_bytes && !cannot_write(name, floats).empty()))
                continue;
            std::vector<float> values(kWidth * kHeight * 4);
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] =
                    i % 4 == 3 ? static_cast<float>(i / 4 % 6 * 51) : static_cast<float>(i % 6 * 3);
            const std::vector<std::uint8_t> narrow(values.begin(), values.end());
            for (float& value : values) value /= 255;
            write(scratch.path(name), as_bytes ? bytes : floats,
                  as_bytes ? static_cast<const void*>(narrow.data()) : values.data());
            const Loaded got = loaded(scratch.path(name));
            EXPECT_EQ(got.header.alpha, format.alpha) << name;
            ASSERT_EQ(got.header.channels, 4) << name;
            for (std::size_t i = 0; i < values.size(); ++i) {
                const double a = values[i / 4 * 4 + 3];
                double expected = values[i];
                if (i % 4 != 3 && alpha != format.alpha)
                    expected = alpha == Alpha::straight ? expected * a : a == 0 ? 0 : expected / a;
                const double read =
                    as_bytes ? samples_of<std::uint8_t>(got)[i] / 255.0 : samples_of<float>(got)[i];
                // Half of a step of 8 bits where they were changed.
                const double bound = alpha == format.alpha ? 0 : as_bytes ? 0.5 / 255 : 1e-6;
                ASSERT_NEAR(read, std::min(expected, 1.0), bound + 1e-7) << name << " " << i;
            }
        }
    }
}

TEST(Pictures, HalvesStayHalves) {
    Scratch scratch;
    std::vector<std::uint16_t> halves(kWidth * kHeight * 3);
    for (std::size_t i = 0; i < halves.size(); ++i)
        halves[i] = static_cast<std::uint16_t>(0x3c00 + i);  // 1 and what follows
    written(scratch, "a.exr", picture(Type::f16, 3), halves);
    const Loaded got = loaded(scratch.path("a.exr"));
    EXPECT_EQ(inspect(scratch.path("a.exr")).type, Type::f16);
    const auto read = samples_of<float>(got);
    for (std::size_t i = 0; i < halves.size(); ++i)
        ASSERT_EQ(read[i], 1 + static_cast<float>(i) / 1024) << i;
}

TEST(Pictures, QualityLosesSomething) {
    Scratch scratch;
    Header what = picture(Type::u8, 3);
    what.extent = {96, 64, 1};
    std::vector<std::uint8_t> values(96 * 64 * 3);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] =
            static_cast<std::uint8_t>(100 + 60 * std::sin(static_cast<double>(i / 3 % 96) / 9) +
                                      40 * std::cos(static_cast<double>(i / 288) / 7) +
                                      static_cast<double>(i * 2654435761u % 7));
    for (const char* name : {"a.webp", "a.jp2", "a.j2k"}) {
        const std::string whole = written(scratch, name, what, values);
        EXPECT_EQ(samples_of<std::uint8_t>(loaded(scratch.path(name))), values) << name;
        const std::string lossy = written(scratch, name, what, values, {80});
        EXPECT_LT(lossy.size(), whole.size() / 2) << name;
        const auto read = samples_of<std::uint8_t>(loaded(scratch.path(name)));
        double squares = 0;
        for (std::size_t i = 0; i < values.size(); ++i) squares += std::pow(read[i] - values[i], 2);
        // 6 grey levels of noise with a deviation of 2, of which nothing needs to stay.
        EXPECT_LT(std::sqrt(squares / static_cast<double>(values.size())), 4) << name;
    }
    // The codestream alone has no boxes.
    EXPECT_EQ(bytes_in(scratch.path("a.j2k")).substr(0, 4), "\xff\x4f\xff\x51");
    EXPECT_EQ(bytes_in(scratch.path("a.jp2")).substr(4, 4), "jP  ");
}

/// A stripe or a point has no room for the resolutions of a large picture.
TEST(Pictures, SmallAndNarrowOnes) {
    Scratch scratch;
    for (const Format& format : formats())
        for (const Extent extent : {Extent{1, 1, 1}, Extent{200, 1, 1}, Extent{1, 150, 1}}) {
            Header what = picture(format.types.empty() ? Type::u8 : format.types[0], 3);
            what.extent = extent;
            const std::string path = scratch.path("a" + format.endings[0]);
            if (!cannot_write(path, what).empty() || format.name == "JPEG") continue;
            const std::vector<std::uint8_t> bytes(200 * 3 * 8);
            write(path, what, bytes.data());
            const Loaded got = loaded(path);
            EXPECT_EQ(got.header.extent, extent) << path;
            const std::vector<std::uint8_t> samples = samples_of<std::uint8_t>(got);
            // GIF is read with alpha, all opaque.
            const bool alpha = format.name == "GIF";
            for (std::size_t i = 0; i < samples.size(); ++i) {
                ASSERT_EQ(samples[i], alpha && i % 4 == 3 ? 255 : 0) << path;
            }
        }
}

TEST(Pictures, NoFileTellsTheTimeOrItsName) {
    Scratch scratch;
    const std::time_t now = std::time(nullptr);
    const std::string year = std::to_string(1900 + std::localtime(&now)->tm_year);
    const std::vector<float> values(kWidth * kHeight * 4, 0.5f);
    for (const Format& format : formats()) {
        const Header what = picture(format.types.empty() ? Type::u8 : format.types.back(), 3);
        if (format.library.empty() || !format.writes) continue;
        const std::string first = written(scratch, "secret" + format.endings[0], what, values);
        EXPECT_EQ(first.find(year), first.npos) << format.name;
        EXPECT_EQ(first.find("secret"), first.npos) << format.name;
        EXPECT_EQ(written(scratch, "other" + format.endings[0], what, values), first)
            << format.name;
    }
}

TEST(Pictures, FailureLeavesTheOldFile) {
    Scratch scratch;
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
    Header what;
    what.volume = false;
    what.extent = {300, 300, 1};
    what.channels = 3;
    std::vector<float> values(300 * 300 * 3);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 977);
    for (const Format& format : formats()) {
        if (format.types.empty() || !format.images) continue;
        what.type = format.types.back();
        const std::string link = scratch.path("full" + format.endings[0]);
        if (!cannot_write(link, what).empty()) continue;
        std::filesystem::create_symlink("/dev/full", link);
        EXPECT_THROW(write(link, what, values.data()), RunError) << format.name;
        EXPECT_TRUE(std::filesystem::is_symlink(link)) << format.name;
    }
    EXPECT_EQ(scratch.files(), 0u);
}

TEST(Pictures, WhatAFormatCannotHoldIsSaid) {
    const auto why = [](const char* path, Type type, int channels, Extent extent = {4, 4, 1}) {
        Header what = picture(type, channels);
        what.extent = extent;
        what.volume = extent.z > 1;
        return cannot_write(path, what);
    };
    EXPECT_EQ(why("a.hdr", Type::f32, 3), "");
    EXPECT_NE(why("a.hdr", Type::f32, 1, {4, 4, 4}), "");
    EXPECT_NE(why("a.hdr", Type::f32, 4), "");
    EXPECT_NE(why("a.hdr", Type::u8, 3), "");
    EXPECT_NE(why("a.bmp", Type::u16, 3), "");
    EXPECT_NE(why("a.bmp", Type::u8, 2), "");
    EXPECT_NE(why("a.bmp", Type::u8, 3, {4, 40000, 1}), "");
    EXPECT_NE(why("a.webp", Type::u8, 3, {16384, 4, 1}), "");
    EXPECT_EQ(why("a.webp", Type::u8, 3, {16383, 4, 1}), "");
    EXPECT_NE(why("a.pgm", Type::u8, 3), "");
    EXPECT_NE(why("a.pbm", Type::u8, 1), "");
    EXPECT_EQ(why("a.gif", Type::u8, 3), "");
    EXPECT_NE(why("a.gif", Type::u8, 4), "");
    EXPECT_NE(why("a.gif", Type::u16, 1), "");
    EXPECT_NE(why("a.psd", Type::u8, 3), "");
    EXPECT_NE(why("a.jp2", Type::f32, 1), "");
    EXPECT_EQ(why("a.J2K", Type::u16, 1), "");
}

// Files that are only read
// --------------------------------------------------------------------------

std::string big_number(unsigned value, int width) {
    std::string text;
    for (int i = width - 1; i >= 0; --i) text += static_cast<char>(value >> 8 * i);
    return text;
}

/// A Photoshop file without layers: three planes of 2 x 2.
std::string psd(unsigned width, unsigned height) {
    return "8BPS" + big_number(1, 2) + std::string(6, '\0') + big_number(3, 2) +
           big_number(height, 4) + big_number(width, 4) + big_number(8, 2) + big_number(3, 2) +
           std::string(12, '\0') + std::string(2, '\0') + "abcdefghijkl";
}

/// A GIF of 2 x 2 with four colours; LZW codes of 3 bits: clear 0 1 2 3 end.
std::string gif(unsigned side) {
    const std::string size{static_cast<char>(side), static_cast<char>(side >> 8)};
    const auto bytes = [](std::initializer_list<int> all) {
        std::string text;
        for (const int one : all) text += static_cast<char>(one);
        return text;
    };
    return "GIF87a" + size + size +
           bytes({0x81, 0, 0, 10, 11, 12, 20, 21, 22, 30, 31, 32, 40, 41, 42}) +
           bytes({0x2c, 0, 0, 0, 0, 2, 0, 2, 0, 0, 2, 3}) +
           // 100 000 001 010 | 011 101, lowest bits first
           bytes({0x44, 0x34, 0x5, 0, 0x3b});
}

TEST(Pictures, KindsThatAreOnlyRead) {
    Scratch scratch;
    const Loaded layers = loaded(scratch.put("a.psd", psd(2, 2)));
    EXPECT_EQ(layers.header.format, "PSD");
    EXPECT_EQ(samples_of<char>(layers),
              (std::vector<char>{'a', 'e', 'i', 'b', 'f', 'j', 'c', 'g', 'k', 'd', 'h', 'l'}));
    // By its first bytes, whatever it is called.
    EXPECT_EQ(inspect(scratch.put("b.picture", psd(2, 2))).format, "PSD");
    const std::string mask = "P1\n3 2\n0 1 0\n1 1 1\n";
    EXPECT_EQ(samples_of<std::uint8_t>(loaded(scratch.put("a.pbm", mask))),
              (std::vector<std::uint8_t>{255, 0, 255, 0, 0, 0}));
}

TEST(Pictures, BadFilesAreRefusedByName) {
    Scratch scratch;
    const auto values = values_of<float>(4);
    for (const Format& format : formats()) {
        if (format.library.empty() || !format.writes) continue;
        const std::string name = "a" + format.endings[0];
        const std::string whole = written(scratch, name, picture(format.types.back(), 3), values);
        // Behind the samples of a TGA there is more.
        const std::size_t half = format.name == "TGA" ? 200 : whole.size() / 2;
        for (const std::size_t bytes : {half, std::size_t{30}, std::size_t{5}}) {
            const std::string why = refusal(scratch.put(name, whole.substr(0, bytes)));
            EXPECT_NE(why.find(name), std::string::npos) << name << bytes << ": " << why;
        }
        const std::string why = refusal(scratch.put(name, std::string(5000, 'x')));
        EXPECT_NE(why.find(name), std::string::npos) << name << ": " << why;
    }
}

TEST(Pictures, HugeSizesAreRefusedBeforeAnyoneBelievesThem) {
    Scratch scratch;
    const auto refused = [&](const std::string& name, const std::string& bytes) {
        const std::string why = refusal(scratch.put(name, bytes));
        EXPECT_NE(why.find(name), std::string::npos) << name << ": " << why;
    };
    refused("a.psd", psd(30000, 30000));
    refused("a.gif", gif(65535));
    refused("a.ppm", "P6\n60000 60000\n255\nabc");
    refused("a.pgm", "P5\n4000000000 4000000000\n255\nabc");
    refused("a.pfm", "PF\n60000 60000\n-1.0\nabc");
    refused("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\nabcd");
    const auto change = [&](const std::string& name, Type type, auto spoil) {
        std::string bytes = written(scratch, name, picture(type, 3), values_of<float>(3));
        spoil(bytes);
        refused(name, bytes);
    };
    const auto put_big = [](std::string& bytes, std::size_t at, unsigned value, int width) {
        bytes.replace(at, static_cast<std::size_t>(width), big_number(value, width));
    };
    change("a.bmp", Type::u8, [](std::string& b) { put(b, 18, 30000), put(b, 22, 30000); });
    change("a.tga", Type::u8, [](std::string& b) {
        put(b, 12, std::uint16_t{65000}), put(b, 14, std::uint16_t{65000});
    });
    change("a.sgi", Type::u8,
           [&](std::string& b) { put_big(b, 6, 65000, 2), put_big(b, 8, 65000, 2); });
    change("a.jp2", Type::u8, [&](std::string& b) {
        const std::size_t at = b.find("\xff\x4f\xff\x51");
        put_big(b, at + 8, 60000, 4), put_big(b, at + 12, 60000, 4);
    });
    change("a.webp", Type::u8, [](std::string& b) { put(b, 21, 0x0fffffff); });
    change("a.dpx", Type::u8, [](std::string& b) {
        const bool is_big = b[0] == 'S';
        const std::string side = is_big ? big_number(60000, 4) : std::string("\x60\xea\0\0", 4);
        b.replace(772, 8, side + side);
    });
    change("a.exr", Type::f32, [](std::string& b) {
        const std::size_t at = b.find("dataWindow") + 11 + 6 + 4;
        put(b, at + 8, 2000000000), put(b, at + 12, 2000000000);
    });
}

}  // namespace
}  // namespace edgewise::store
