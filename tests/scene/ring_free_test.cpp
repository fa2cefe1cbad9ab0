#include "scene/ring_free.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <utility>
#include <vector>

namespace edgewise {
namespace {

Request composite(std::vector<Transfer::Point> points) {
    Request want;
    want.job = Job::render;
    want.mode = Mode::composite;
    want.transfer.points = std::move(points);
    return want;
}

/// Values `slope` x, and one pair of neighbours along z that differ by `jump`.
Data ramp(const Extent& n, double slope, double jump) {
    Representation what;
    what.type = Type::f32;
    what.extent = n;
    Data data = Data::make(what, std::pmr::get_default_resource());
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                *data.at<float>(x, y, z) =
                    static_cast<float>(slope * static_cast<double>(x) + (2 * z >= n.z ? jump : 0));
    return data;
}

TEST(RingFree, AStepIsShorterWhereOpacityIsSteeper) {
    const Request gentle = composite({{0, 0, {1, 1, 1}}, {1, 0.04, {1, 1, 1}}});
    const Request steep =
        composite({{0.4, 0, {0.1, 0.1, 0.1}}, {0.5, 0.7, {0.6, 0.6, 0.6}}, {0.6, 0.9, {1, 1, 1}}});
    double before = 1;
    for (const double slope : {0.01, 0.05, 0.1, 0.2, 0.4}) {
        EXPECT_EQ(ring_free_step(gentle, 0, 1, slope), 1) << slope;
        const double step = ring_free_step(steep, 0, 1, slope);
        EXPECT_LE(step, before) << slope;
        before = step;
    }
    EXPECT_EQ(ring_free_step(steep, 0, 1, 0.01), 1);
    EXPECT_LE(before, 0.25);
}

TEST(RingFree, LightTakesTwoSamplesASpacingNarrowEdgesAndSurfacesFour) {
    Request lit = composite({{0, 0, {1, 1, 1}}, {1, 0.1, {1, 1, 1}}});
    lit.shading.by = Shade::phong;
    EXPECT_EQ(ring_free_step(lit, 0, 1, 0.01), 0.5);
    EXPECT_EQ(ring_free_step(lit, 0, 1, 0.24), 0.5);
    EXPECT_EQ(ring_free_step(lit, 0, 1, 0.26), 0.25);
    Request surface;
    surface.job = Job::render;
    surface.mode = mode_named("surface");
    EXPECT_EQ(ring_free_step(surface, 0, 1, 0.3), 0.25);
    Request largest;
    largest.job = Job::render;
    EXPECT_EQ(ring_free_step(largest, 0, 1, 0.3), 1);
}

TEST(RingFree, OpacitiesOfALongerUnitAreSampledMoreSeldom) {
    Request want = composite({{0.4, 0, {0.1, 0.1, 0.1}}, {0.6, 0.9, {1, 1, 1}}});
    const double step = ring_free_step(want, 0, 1, 0.25);
    want.transfer.unit = 40;  // the same opacity takes 40 samples
    EXPECT_LT(step, 1);
    EXPECT_EQ(ring_free_step(want, 0, 1, 0.25), 1);
}

TEST(RingFree, SlopesAreThoseOfWhatIsSeen) {
    const Request want = composite({{100, 0, {1, 1, 1}}, {150, 0.5, {1, 1, 1}}});
    for (const Extent& n : {Extent{160, 30, 20}, Extent{160, 9, 40}}) {
        // All differences are of one sample along x, where opacities are neither 0 nor full.
        EXPECT_NEAR(seen_slope(ramp(n, 1, 0), want), 1, 1e-5);
        // What is clear, and what is opaque in full, is not looked at.
        EXPECT_EQ(seen_slope(ramp(n, 0.1, 0), want), 0);
    }
    EXPECT_EQ(seen_slope(ramp({4, 4, 4}, 1, 0), want), 0);
}

TEST(RingFree, SlopesAreBySpacing) {
    Request want = composite({{100, 0, {1, 1, 1}}, {150, 0.5, {1, 1, 1}}});
    want.spacing = {2, 1, 4};
    EXPECT_NEAR(seen_slope(ramp({160, 30, 20}, 1, 0), want), 0.5, 1e-5);
}

TEST(RingFree, SlopesOfAThousandthCount) {
    // A plane of jumps through a volume: one pair of 60 along z, one of 180 in all.
    const Request want = composite({{100, 0, {1, 1, 1}}, {1500, 0.5, {1, 1, 1}}});
    EXPECT_NEAR(seen_slope(ramp({160, 30, 60}, 1, 700), want), 700, 1e-3);
}

}  // namespace
}  // namespace edgewise
