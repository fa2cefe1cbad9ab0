#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <span>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

Header volume_of(Type type) {
    Header what;
    what.extent = {5, 4, 3};
    what.type = type;
    what.spacing = {0.5, 2, 3};
    what.origin = {-10, 20.25, 3};
    // x to the back, y to the right, z up: a quarter turn about z
    what.direction = {Vector{0, 1, 0}, Vector{-1, 0, 0}, Vector{0, 0, 1}};
    what.unit = "mm";
    what.anatomical = true;
    return what;
}

template <class T>
std::vector<T> counted(std::size_t count) {
    std::vector<T> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<T>(3 * i + 1);
    return values;
}

TEST(Write, VolumesKeepSamplesAndGeometry) {
    Scratch scratch;
    for (const char* ending : {".nii", ".nii.gz", ".nrrd", ".mha", ".mhd"}) {
        const std::string path = scratch.path(std::string("a") + ending);
        const Header what = volume_of(Type::f32);
        const auto values = counted<float>(60);
        write(path, what, values.data());
        const Loaded got = loaded(path);
        EXPECT_EQ(samples_of<float>(got), values) << ending;
        EXPECT_EQ(got.header.extent, what.extent) << ending;
        EXPECT_EQ(got.header.orientation, "PRS") << ending;
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_EQ(got.header.spacing[axis], what.spacing[axis]) << ending;
            EXPECT_EQ(got.header.origin[axis], what.origin[axis]) << ending;
            EXPECT_EQ(got.header.direction[axis], what.direction[axis]) << ending;
        }
        EXPECT_EQ(got.header.unit, "mm") << ending;
        EXPECT_TRUE(got.header.warnings.empty()) << ending << got.header.warnings[0];
    }
}

/// Whatever a format says that it writes comes back: every type, grey and colour, image and volume.
TEST(Write, EveryFormatKeepsEveryTypeThatItLists) {
    Scratch scratch;
    int combinations = 0;
    for (const Format& format : formats())
        for (const Type type : format.types)
            for (const int channels : {1, 2, 3, 4})
                for (const bool volume : {false, true}) {
                    Header what = volume_of(type);
                    what.volume = volume;
                    what.channels = channels;
                    if (!volume) what.extent.z = 1;
                    const std::string path = scratch.path("a" + format.endings[0]);
                    if (!cannot_write(path, what).empty()) continue;
                    // Bytes of small numbers, whatever their type: f16 and f32 stay finite.
                    const auto count = static_cast<std::size_t>(what.extent.samples() * channels);
                    std::vector<std::uint8_t> bytes(count * bytes_of(type));
                    for (std::size_t i = 0; i < bytes.size(); ++i)
                        bytes[i] = static_cast<std::uint8_t>(i * 37 % 60);
                    write(path, what, bytes.data());
                    const Loaded got = loaded(path);
                    ++combinations;
                    const std::string label = format.name + " " + std::string(name_of(type)) +
                                              (volume ? " volume " : " image ") +
                                              std::to_string(channels);
                    EXPECT_EQ(got.header.extent, what.extent) << label;
                    EXPECT_EQ(got.header.volume, volume) << label;
                    // They have no grey, and GIF is read with alpha (animation_test.cpp).
                    if (format.name == "GIF" ||
                        (channels == 1 && (format.name == "WebP" || format.name == "Radiance HDR")))
                        continue;
                    EXPECT_EQ(got.header.channels, channels) << label;
                    if (loaded_type(type) == type && format.name != "JPEG" &&
                        format.name != "Radiance HDR") {
                        ASSERT_EQ(got.samples.bytes(), bytes.size()) << label;
                        EXPECT_EQ(std::memcmp(got.samples.data(), bytes.data(), bytes.size()), 0)
                            << label;
                    }
                    const bool geometry = format.name == "NIfTI" || format.name == "NRRD" ||
                                          format.name == "MetaImage";
                    if (!volume || !geometry) continue;
                    EXPECT_EQ(got.header.spacing, what.spacing) << label;
                    EXPECT_EQ(got.header.origin, what.origin) << label;
                    EXPECT_EQ(got.header.direction, what.direction) << label;
                    EXPECT_EQ(got.header.orientation, "PRS") << label;
                }
    EXPECT_GT(combinations, 100);
}

TEST(Write, NiftiSaysTheRotationTwice) {
    // A reader that prefers the qform must see the same geometry: the sform is taken away.
    Scratch scratch;
    const std::string path = scratch.path("a.nii");
    Header what = volume_of(Type::u8);
    const auto values = counted<std::uint8_t>(60);
    for (int turn = 0; turn < 4; ++turn) {
        write(path, what, values.data());
        std::string bytes = bytes_in(path);
        put(bytes, 254, std::int16_t{0});
        const Header got = inspect(scratch.put("b.nii", bytes));
        for (int axis = 0; axis < 3; ++axis)
            for (int row = 0; row < 3; ++row) {
                // The quaternion is f32: 2^-24 in each of its entries, at most four of them a sum.
                EXPECT_NEAR(got.direction[axis][row], what.direction[axis][row], 4 * 6e-8);
                EXPECT_EQ(got.origin[row], what.origin[row]);
            }
        std::rotate(what.direction.begin(), what.direction.begin() + 1, what.direction.end());
        if (turn == 1) what.direction[0][1] = -what.direction[0][1];  // a left-handed one
        if (turn == 2) std::swap(what.direction[0], what.direction[1]);
    }
}

TEST(Write, NiftiKeepsSlopeLabelsAndChannels) {
    Scratch scratch;
    Header what = volume_of(Type::i16);
    what.values = {0.5, -1000};
    what.labels = true;
    what.channels = 2;
    const auto values = counted<std::int16_t>(120);
    write(scratch.path("a.nii.gz"), what, values.data());
    const Loaded got = loaded(scratch.path("a.nii.gz"));
    EXPECT_EQ(got.header.values, what.values);
    EXPECT_TRUE(got.header.labels);
    EXPECT_EQ(got.header.channels, 2);
    EXPECT_EQ(samples_of<std::int16_t>(got), values);
}

TEST(Write, PlainNrrdIsWhatASimpleReaderExpects) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {3, 2, 1};
    what.type = Type::u16;
    const auto values = counted<std::uint16_t>(6);
    write(scratch.path("a.nrrd"), what, values.data());
    EXPECT_EQ(bytes_in(scratch.path("a.nrrd")),
              "NRRD0004\ntype: uint16\ndimension: 2\nsizes: 3 2\nspacings: 1 1\nendian: "
              "little\nencoding: raw\n\n" +
                  raw(values));
}

TEST(Write, PicturesKeepEveryValue) {
    Scratch scratch;
    for (const char* ending : {".png", ".tif", ".nrrd", ".mha"})
        for (int channels = 1; channels <= 4; ++channels)
            for (Type type : {Type::u8, Type::u16}) {
                Header what;
                what.volume = false;
                what.extent = {7, 5, 1};
                what.channels = channels;
                what.type = type;
                what.alpha = channels % 2 == 0 ? Alpha::straight : Alpha::none;
                const std::string path = scratch.path(std::string("p") + ending);
                const auto values = counted<std::uint16_t>(static_cast<std::size_t>(35 * channels));
                write(path, what, values.data());
                const Loaded got = loaded(path);
                EXPECT_EQ(got.header.type, type) << path;
                EXPECT_EQ(got.header.channels, channels) << path;
                EXPECT_FALSE(got.header.volume) << path;
                EXPECT_EQ(std::memcmp(got.samples.data(), values.data(), got.samples.bytes()), 0)
                    << path << channels;
                if (std::string_view(ending) == ".png" || std::string_view(ending) == ".tif") {
                    EXPECT_EQ(got.header.alpha, what.alpha) << path;
                }
            }
}

TEST(Write, TiffOfSeveralPagesIsAVolume) {
    Scratch scratch;
    for (Type type : {Type::i8, Type::i16, Type::f32}) {
        Header what;
        what.extent = {5, 4, 3};
        what.type = type;
        const auto values = counted<float>(60);
        write(scratch.path("a.tif"), what, values.data());
        const Loaded got = loaded(scratch.path("a.tif"));
        EXPECT_EQ(got.header.extent, what.extent);
        EXPECT_TRUE(got.header.volume);
        EXPECT_EQ(got.header.type, type);
        EXPECT_EQ(std::memcmp(got.samples.data(), values.data(), got.samples.bytes()), 0);
    }
}

TEST(Write, ExrComesBackThroughOpenExr) {
    Scratch scratch;
    for (int channels : {1, 3, 4}) {
        Header what;
        what.volume = false;
        what.extent = {19, 37, 1};  // 37 rows: two blocks of 16 and one of 5
        what.channels = channels;
        what.type = Type::f32;
        auto values = counted<float>(static_cast<std::size_t>(19 * 37 * channels));
        values[0] = -0.1f;
        write(scratch.path("a.exr"), what, values.data());
        try {
            EXPECT_EQ(samples_of<float>(loaded(scratch.path("a.exr"))), values) << channels;
        } catch (const InputError& error) {
            if (std::strstr(error.what(), "cannot be opened")) GTEST_SKIP() << error.what();
            throw;
        }
    }
}

TEST(Write, JpegStaysCloseAndKeepsProfileAndExif) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {32, 16, 1};
    what.channels = 3;
    what.icc.assign(70000, std::byte{5});  // longer than one marker
    what.exif.assign(20, std::byte{0});
    std::vector<std::uint8_t> values(32 * 16 * 3);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(i / 3 % 32 * 4 + i / 96 * 8);
    write(scratch.path("a.jpg"), what, values.data());
    const Loaded got = loaded(scratch.path("a.jpg"));
    EXPECT_EQ(got.header.icc, what.icc);
    EXPECT_EQ(got.header.exif, what.exif);
    const auto read = samples_of<std::uint8_t>(got);
    // At quality 95 the coarsest divisors are 10 to 12: half of that, a few coefficients together.
    for (std::size_t i = 0; i < values.size(); ++i) ASSERT_NEAR(read[i], values[i], 12) << i;
}

TEST(Write, ExifOrientationIsAppliedOnceAndReset) {
    Scratch scratch;
    // 274 SHORT 1 = orientation, in a big-endian TIFF block of one entry.
    std::string exif("MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\0\0\0\0\0\0\0", 26);
    Header what;
    what.volume = false;
    what.extent = {3, 2, 1};
    const std::vector<std::uint8_t> values{1, 2, 3, 4, 5, 6};
    // What a viewer shows of the rows "1 2 3 / 4 5 6" (EXIF 2.3, tag 274).
    const std::vector<std::vector<std::uint8_t>> upright{
        {1, 2, 3, 4, 5, 6}, {3, 2, 1, 6, 5, 4}, {6, 5, 4, 3, 2, 1}, {4, 5, 6, 1, 2, 3},
        {1, 4, 2, 5, 3, 6}, {4, 1, 5, 2, 6, 3}, {6, 3, 5, 2, 4, 1}, {3, 6, 2, 5, 1, 4}};
    for (int orientation = 1; orientation <= 8; ++orientation) {
        exif[19] = static_cast<char>(orientation);
        const auto bytes = std::as_bytes(std::span(exif));
        what.exif.assign(bytes.begin(), bytes.end());
        write(scratch.path("a.png"), what, values.data());
        const Loaded got = loaded(scratch.path("a.png"));
        EXPECT_EQ(got.header.extent, orientation < 5 ? (Extent{3, 2, 1}) : (Extent{2, 3, 1}))
            << orientation;
        EXPECT_EQ(samples_of<std::uint8_t>(got), upright[static_cast<std::size_t>(orientation - 1)])
            << orientation;
        write(scratch.path("b.png"), got.header, got.samples.data());
        EXPECT_EQ(samples_of<std::uint8_t>(loaded(scratch.path("b.png"))),
                  samples_of<std::uint8_t>(got))
            << orientation;
    }
}

TEST(Write, PngKeepsProfileAndColourChunks) {
    Scratch scratch;
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const Loaded photo = loaded(data + "/img_2d/hdr_room.png");
    write(scratch.path("a.png"), photo.header, photo.samples.data());
    const Loaded got = loaded(scratch.path("a.png"));
    EXPECT_EQ(got.header.icc, photo.header.icc);
    EXPECT_EQ(got.header.png_chunks, photo.header.png_chunks);
    EXPECT_EQ(samples_of<std::uint16_t>(got), samples_of<std::uint16_t>(photo));
}

TEST(Write, EqualInputGivesEqualBytes) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {8, 8, 1};
    const auto values = counted<float>(64);
    for (const char* ending : {".png", ".jpg", ".tif", ".nii.gz", ".nrrd", ".mha", ".exr"}) {
        what.type = std::string_view(ending) == ".exr" ? Type::f32 : Type::u8;
        const std::string a = scratch.path(std::string("a") + ending),
                          b = scratch.path(std::string("b") + ending);
        write(a, what, values.data());
        write(b, what, values.data());
        EXPECT_EQ(bytes_in(a), bytes_in(b)) << ending;
    }
}

TEST(Write, FailureLeavesTheOldFileAndNothingElse) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {8, 8, 1};
    what.type = Type::f32;
    const auto values = counted<float>(64);
    scratch.put("old.png", "precious");
    EXPECT_THROW(write(scratch.path("old.png"), what, values.data()),
                 RequestError);  // no f32 in PNG
    EXPECT_EQ(bytes_in(scratch.path("old.png")), "precious");
    EXPECT_THROW(write(scratch.path("absent/a.nrrd"), what, values.data()), RunError);
    EXPECT_THROW(write(scratch.path("a.unknown"), what, values.data()), RequestError);
    EXPECT_EQ(scratch.files(), 1u);
    if (!std::filesystem::exists("/dev/full")) return;
    // A link, so that the ending is known; the device itself is never replaced.
    for (const char* ending : {".nrrd", ".nii.gz", ".exr", ".tif"}) {
        const std::string link = scratch.path(std::string("full") + ending);
        std::filesystem::create_symlink("/dev/full", link);
        EXPECT_THROW(write(link, what, values.data()), RunError) << ending;
        EXPECT_TRUE(std::filesystem::is_symlink(link)) << ending;
    }
}

TEST(Formats, AreFoundByTheLongestEnding) {
    EXPECT_EQ(format_of("a.NII.GZ")->name, "NIfTI");
    EXPECT_EQ(format_of("a.b.tiff")->name, "TIFF");
    EXPECT_EQ(format_of("a.gz"), nullptr);
    Header what;
    what.extent = {2, 2, 2};
    EXPECT_NE(cannot_write("a.png", what), "");
    EXPECT_EQ(cannot_write("a.tif", what), "");
    what.values = {2, 0};
    EXPECT_NE(cannot_write("a.tif", what), "");
    EXPECT_EQ(cannot_write("a.nii", what), "");
}

}  // namespace
}  // namespace edgewise::store
