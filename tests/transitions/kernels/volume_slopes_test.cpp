// Derivatives along lines, beside splines that are solved for in f64.
#include "transitions/kernels/volume_slopes.hpp"

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/transitions/kernels/spectrum_testing.hpp"
#include "tests/transitions/kernels/spline_slopes.hpp"

namespace edgewise::kernels {
namespace {

Eigen::VectorXd differences(const Eigen::VectorXd& samples) {
    const Eigen::Index n = samples.size();
    Eigen::VectorXd slopes(n);
    for (Eigen::Index i = 0; i < n; ++i)
        slopes[i] =
            (samples[std::min(i + 1, n - 1)] - samples[std::max<Eigen::Index>(i - 1, 0)]) / 2;
    return slopes;
}

TEST(VolumeSlopes, AreThoseOfEachLine) {
    for (const Extent& n : {Extent{9, 7, 8}, Extent{1, 5, 2}, Extent{2, 1, 3}, Extent{17, 3, 1}}) {
        PlainVolume volume = noise(n, 0);
        Grid grid = volume.grid();
        grid.values = {-3, 1000};
        const std::int64_t strides[3] = {1, n.x, n.x * n.y};
        for (int axis = 0; axis < 3; ++axis)
            for (const SlopesOf by : {SlopesOf::spline, SlopesOf::differences}) {
                std::vector<float> got(static_cast<std::size_t>(n.samples()));
                volume_slopes(grid, axis, by, 998, got.data(), kMemory, {});
                for (std::int64_t first = 0; first < n.samples(); ++first) {
                    if (first / strides[axis] % n[axis] != 0) continue;
                    Eigen::VectorXd line(n[axis]);
                    for (std::int64_t i = 0; i < n[axis]; ++i)
                        line[i] =
                            -3. *
                            volume.samples[static_cast<std::size_t>(first + i * strides[axis])];
                    const Eigen::VectorXd want =
                        by == SlopesOf::spline ? spline_slopes(line) : differences(line);
                    // The prefilter keeps 3e-6 of the range, which is 3 here.
                    for (std::int64_t i = 0; i < n[axis]; ++i)
                        ASSERT_NEAR(got[static_cast<std::size_t>(first + i * strides[axis])],
                                    want[i], 1e-5)
                            << axis << " " << i << " of " << n[axis];
                }
            }
    }
}

TEST(VolumeSlopes, OfIntegersAndForAnyNumberOfThreads) {
    const Extent n{33, 20, 19};
    std::vector<std::int16_t> samples(static_cast<std::size_t>(n.samples()) + 32);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        samples[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(i * 7919 % 4001 - 2000);
    const Grid grid{samples.data(), Type::i16, n, 1, {0.5, 3}};
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<float> one(static_cast<std::size_t>(n.samples())), all(one);
        {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
            volume_slopes(grid, axis, SlopesOf::spline, 0, one.data(), kMemory, {});
        }
        volume_slopes(grid, axis, SlopesOf::spline, 0, all.data(), kMemory, {});
        EXPECT_EQ(one, all);
        volume_slopes(grid, axis, SlopesOf::differences, 0, all.data(), kMemory, {});
        const std::int64_t stride = axis == 0 ? 1 : axis == 1 ? n.x : n.x * n.y;
        const std::int64_t at = (9 * n.y + 8) * n.x + 7;
        EXPECT_EQ(all[static_cast<std::size_t>(at)],
                  0.25F * static_cast<float>(samples[static_cast<std::size_t>(at + stride)] -
                                             samples[static_cast<std::size_t>(at - stride)]));
    }
}

}  // namespace
}  // namespace edgewise::kernels
