// PNGs of many stripes: what libpng reads again is what was written, and the bytes do not depend on
// the number of threads.
#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <tbb/task_arena.h>

#include "io/png_data.hpp"
#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

/// Noise, then ramps, then one value: what each filter and each effort of deflate is for.
template <class T>
std::vector<T> picture(std::int64_t width, std::int64_t height, int channels) {
    std::vector<T> values(static_cast<std::size_t>(width * height * channels));
    std::mt19937 bits(7);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t third = 3 * i / values.size();
        const auto x = i / static_cast<std::size_t>(channels) % static_cast<std::size_t>(width);
        values[i] = third == 0 ? static_cast<T>(bits()) : third == 1 ? static_cast<T>(7 * x) : T{9};
    }
    return values;
}

template <class T>
void expect_kept(const Scratch& scratch, Type type, std::int64_t width, std::int64_t height,
                 int channels) {
    Header what;
    what.volume = false;
    what.extent = {width, height, 1};
    what.type = type;
    what.channels = channels;
    what.alpha = channels % 2 == 0 ? Alpha::straight : Alpha::none;
    const auto values = picture<T>(width, height, channels);
    const std::string path = scratch.path("a.png");
    write(path, what, values.data());
    const Loaded got = loaded(path);
    ASSERT_EQ(got.header.extent, what.extent);
    ASSERT_EQ(got.header.channels, channels);
    EXPECT_EQ(samples_of<T>(got), values) << width << " x " << height << " x " << channels;
}

TEST(Png, ManyStripesComeBack) {
    Scratch scratch;
    for (const int channels : {1, 2, 3, 4}) {
        for (const auto& [width, height] : {std::pair{1, 1}, {1, 700}, {301, 3}, {300, 900}}) {
            expect_kept<std::uint8_t>(scratch, Type::u8, width, height, channels);
            expect_kept<std::uint16_t>(scratch, Type::u16, width, height, channels);
        }
    }
    // More than are compressed at once, and rows that are longer than a stripe.
    expect_kept<std::uint8_t>(scratch, Type::u8, 2000, 2700, 1);
    expect_kept<std::uint16_t>(scratch, Type::u16, 70'000, 18, 3);
}

TEST(Png, BytesDoNotDependOnThreads) {
    const auto values = picture<std::uint8_t>(1900, 1400, 3);
    const PngRows rows{reinterpret_cast<const std::byte*>(values.data()), 1900 * 3, 1400, 3, 1};
    std::vector<std::vector<std::byte>> written;
    for (const int threads : {1, 2, 3}) {
        tbb::task_arena arena(threads);
        arena.execute([&] {
            auto& bytes = written.emplace_back();
            compress_png(rows, [&](std::span<const std::byte> chunk) {
                bytes.insert(bytes.end(), chunk.begin(), chunk.end());
            });
        });
    }
    EXPECT_EQ(written[0], written[1]);
    EXPECT_EQ(written[0], written[2]);
    // A third of it cannot be made smaller; the rest is almost nothing.
    EXPECT_LT(written[0].size(), 0.36 * static_cast<double>(values.size()));
}

}  // namespace
}  // namespace edgewise::store
