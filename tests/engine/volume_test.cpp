#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <numeric>
#include <string>
#include <vector>

#include "edgewise/edgewise.hpp"
#include "graph/errors.hpp"

namespace edgewise {
namespace {

/// value(x, y, z, channel) of a whole array of 7 x 5 x 4 samples of 3 channels.
std::vector<std::int16_t> counted() {
    std::vector<std::int16_t> all(7 * 5 * 4 * 3);
    std::iota(all.begin(), all.end(), std::int16_t{0});
    return all;
}
constexpr std::ptrdiff_t kSample = 2, kPixel = 3 * kSample, kRow = 7 * kPixel, kSlice = 5 * kRow;

TEST(Volume, SamplesWithGapsAreCopiedAsTheyLie) {
    const auto all = counted();
    struct Case {
        std::ptrdiff_t first;
        std::array<std::ptrdiff_t, 3> strides;
        Extent extent;
        int channels;
        std::function<int(int x, int y, int z, int c)> value;
    };
    const auto at = [](int x, int y, int z, int c) { return c + 3 * (x + 7 * (y + 5 * z)); };
    const Case cases[] = {
        {0, {kPixel, kRow, kSlice}, {7, 5, 4}, 3, at},
        {0,
         {2 * kPixel, kRow, kSlice},
         {4, 5, 4},
         3,  // every second column
         [&](int x, int y, int z, int c) { return at(2 * x, y, z, c); }},
        {kPixel + kRow + kSlice,
         {kPixel, kRow, kSlice},
         {5, 3, 2},
         3,  // a box
         [&](int x, int y, int z, int c) { return at(x + 1, y + 1, z + 1, c); }},
        {4 * kRow,
         {kPixel, -kRow, kSlice},
         {7, 5, 4},
         3,  // upside down
         [&](int x, int y, int z, int c) { return at(x, 4 - y, z, c); }},
        {0,
         {kSlice, kRow, kPixel},
         {4, 5, 7},
         3,  // transposed
         [&](int x, int y, int z, int c) { return at(z, y, x, c); }},
        {kSample,
         {kPixel, kRow, kSlice},
         {7, 5, 4},
         1,  // one channel of three
         [&](int x, int y, int z, int) { return at(x, y, z, 1); }},
        {0,
         {0, kRow, kSlice},
         {6, 5, 4},
         3,  // one column, again and again
         [&](int, int y, int z, int c) { return at(0, y, z, c); }},
    };
    for (const Case& each : cases) {
        const auto* first = reinterpret_cast<const std::byte*>(all.data()) + each.first;
        const Volume volume =
            Volume::copied(first, each.strides, each.extent, 3, each.channels, Type::i16);
        ASSERT_EQ(volume.data()->what.extent, each.extent);
        const auto* samples = volume.data()->as<std::int16_t>();
        for (int z = 0; z < each.extent.z; ++z)
            for (int y = 0; y < each.extent.y; ++y)
                for (int x = 0; x < each.extent.x; ++x)
                    for (int c = 0; c < each.channels; ++c)
                        ASSERT_EQ(*samples++, each.value(x, y, z, c))
                            << x << " " << y << " " << z << " " << c;
    }
}

TEST(Volume, ACopyIsRefusedAsWhatItIsACopyOf) {
    const auto all = counted();
    const auto copied = [&](const Extent& extent, int axes, int channels) {
        return Volume::copied(all.data(), {kPixel, kRow, kSlice}, extent, axes, channels,
                              Type::i16);
    };
    EXPECT_THROW(copied({0, 5, 4}, 3, 3), RequestError);
    EXPECT_THROW(copied({7, 5, 4}, 2, 3), RequestError);
    EXPECT_THROW(copied({7, 5, 4}, 3, 0), RequestError);
}

/// A file of 32-bit integers that f32 does not tell apart, and its volume. The file goes with it.
class FileOfLabels {
 public:
    FileOfLabels() {
        std::vector<std::int32_t> all(kSide * kSide * kSide);
        for (std::size_t i = 0; i < all.size(); ++i)
            all[i] = i % 3 == 0 ? 0 : (1 << 24) + static_cast<std::int32_t>(i % 5);
        write(all);
    }
    ~FileOfLabels() { remove(); }
    void remove() const { std::filesystem::remove(path_); }
    Volume read() const { return Volume::read("raw:" + path_ + ":12x12x12:i32"); }
    static constexpr std::size_t kSide = 12;

 private:
    void write(const std::vector<std::int32_t>& all) const {
        std::ofstream file(path_, std::ios::binary);
        file.write(reinterpret_cast<const char*>(all.data()),
                   static_cast<std::streamsize>(all.size() * sizeof all[0]));
    }
    const std::string path_ = testing::TempDir() + "edgewise_volume_test.raw";
};

std::vector<std::byte> result_of(const Prepared& plan) {
    std::vector<std::byte> bytes(static_cast<std::size_t>(plan.result().bytes()));
    plan.run({.into = bytes});
    return bytes;
}

TEST(Volume, IsReadOnceForManyPlans) {
    const Engine engine = default_engine();
    const FileOfLabels file;
    const Query mip = query_of(Job::render, {{"rotate", "10,20,30"}, {"size", "native"}});
    const Query xray = query_of(Job::render, {{"mode", "xray"}, {"size", "native"}});
    const auto first = result_of(prepare(engine, mip, file.read())),
               second = result_of(prepare(engine, xray, file.read()));
    const Volume loaded = file.read().loaded();
    EXPECT_FALSE(loaded.in_memory());
    EXPECT_EQ(loaded.samples().get(), loaded.loaded().samples().get());
    file.remove();
    const Prepared plan = prepare(engine, mip, loaded);
    EXPECT_EQ(plan.planned().input.data->samples.data(), loaded.samples()->samples.data());
    EXPECT_TRUE(plan.planned().input.identity.has_value());
    EXPECT_EQ(result_of(plan), first);
    EXPECT_EQ(result_of(prepare(engine, xray, loaded)), second);
    EXPECT_THROW(prepare(engine, mip, file.read()), InputError);
}

TEST(Volume, KeepsDigitsThatItsSamplesInMemoryDoNotHave) {
    const Engine engine = default_engine();
    const FileOfLabels file;
    const Query turned = query_of(Job::warp, {{"labels", true}, {"rotate", "0,0,90"}});
    EXPECT_EQ(result_of(prepare(engine, turned, file.read().loaded())),
              result_of(prepare(engine, turned, file.read())));
}

TEST(Volume, OfMemoryIsLoaded) {
    const auto all = counted();
    const Volume volume = Volume::around(all.data(), {7, 5, 4}, 3, 3, Type::i16, nullptr);
    EXPECT_EQ(volume.loaded().data().get(), volume.data().get());
}

}  // namespace
}  // namespace edgewise
