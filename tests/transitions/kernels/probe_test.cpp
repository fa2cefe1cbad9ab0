#include "transitions/kernels/probe.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace edgewise::kernels {
namespace {

TEST(Probe, DoesTheOperationsThatItCounts) {
    std::int64_t done = 0;
    const float sum = probe_operations(10'000, done);
    EXPECT_GE(done, 10'000);
    // Two vectors go to 0.4, their distance from it by 9/16 each time; eight operations a lane.
    const std::int64_t lanes = std::lround(sum / 0.8f);
    ASSERT_GT(lanes, 0);
    EXPECT_NEAR(sum, 0.8 * double(lanes), 1e-5 * double(lanes));
    EXPECT_EQ(done % (16 * lanes), 0);
    EXPECT_LT(done, 10'000 + 16 * lanes);
}

TEST(Probe, StreamCopiesEveryLength) {
    for (std::int64_t n = 0; n < 100; ++n) {
        std::vector<float> from(n + 1, 7), to(n + 1, -1);
        for (std::int64_t i = 0; i < n; ++i) from[i] = float(i);
        probe_stream(from.data(), to.data(), n);
        for (std::int64_t i = 0; i < n; ++i) ASSERT_EQ(to[i], float(i));
        EXPECT_EQ(to[n], -1) << "written beyond " << n;
    }
}

TEST(Probe, GatherReadsEveryPositionOnceAndWraps) {
    std::vector<float> volume(1024);
    for (std::size_t i = 0; i < volume.size(); ++i) volume[i] = float(i % 61);
    std::vector<std::int32_t> steps(64), begins{0, -400, 4000, 8, 1 << 20};
    for (std::int32_t i = 0; i < 64; ++i) steps[i] = 4 * (i * 37 - 100);
    const std::int32_t wrap = 4096 - 4;
    float sum = 0;  // whole numbers far below 2^24: the order does not matter
    for (const std::int32_t begin : begins)
        for (const std::int32_t step : steps) sum += volume[((begin + step) & wrap) / 4];
    EXPECT_EQ(probe_gather(volume.data(), {steps.data(), 64, begins.data(), 5, wrap}), sum);
}

}  // namespace
}  // namespace edgewise::kernels
