#include "transitions/project/parallel_product.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <string>
#include <vector>

#include "transitions/project/combine.hpp"
#include "transitions/warp/permutation.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;

// Larger than a cube of the screen along each axis, and no multiple of it.
constexpr Extent kInput{70, 61, 83}, kScreen{131, 70, 140};

Vec3 centre(const Extent& n) { return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2; }

Request turned(Mode mode, double degrees, const Extent& screen = kScreen) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.input = kInput;
    want.screen = screen;
    const Matrix3d turn =
        Eigen::AngleAxisd(degrees * EIGEN_PI / 180, Vec3(3, -2, 1).normalized()).matrix();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = turn;
    map.topRightCorner<3, 1>() = centre(screen) - turn * centre(kInput);
    want.views = Placement(map);
    want.transfer.points = {{0, 0, {0, 0, 0.2}}, {1, 0.05, {1, 0.5, 0}}};
    return want;
}

/// Smooth, between 0 and 1.
Data waves() {
    Representation what;
    what.extent = kInput;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t z = 0; z < kInput.z; ++z)
        for (std::int64_t y = 0; y < kInput.y; ++y)
            for (std::int64_t x = 0; x < kInput.x; ++x)
                *data.at<float>(x, y, z) = static_cast<float>(
                    0.5 + 0.5 * std::sin(0.2 * double(x)) * std::cos(0.17 * double(y + 2 * z)));
    return data;
}

Data made(const Transition& edge, const Data& in, const Offer& offer, const Ask& ask,
          const Region& region) {
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, region, context);
    return out;
}

Data made(const Transition& edge, const Data& in, const Offer& offer, const Ask& ask) {
    return made(edge, in, offer, ask, Region::all(offer.to.extent));
}

Parameters by(const std::string& filter) { return {{"filter", filter}}; }

TEST(ParallelProduct, IsTheWarpCombinedInAllModes) {
    const Data in = waves();
    const Scene scene;
    for (const Mode mode : modes())
        for (const double degrees : {0.0, 37.0, 155.0})
            for (const char* filter : {"me", "zoh", "foh"}) {
                const Request want = turned(mode, degrees);
                const Ask ask{want, scene};
                const Offer both = parallel_product().offer(in.what, ask, by(filter));
                if (mode->first_hit) {
                    EXPECT_NE(both.refused, "");
                    continue;
                }
                ASSERT_EQ(both.refused, "");
                const Offer warp = permutation_warp().offer(in.what, ask, by(filter));
                const Data screen = made(permutation_warp(), in, warp, ask);
                const Offer rest = combine().offer(warp.to, ask, {});
                const Data expected = made(combine(), screen, rest, ask);
                const Data got = made(parallel_product(), in, both, ask);
                // Sums of up to 102 values of at most 1 in another order: f32 rounds each by 2^-24
                // of the sum so far. Rays that end early leave 2^-12 out, here before a join or
                // there after it.
                const double most = mode->takes_transfer ? 0x1p-12 : 102 * 102 * 0x1p-24;
                for (std::int64_t i = 0; i < both.to.samples() * both.to.channels; ++i)
                    ASSERT_NEAR(got.as<float>()[i], expected.as<float>()[i], most)
                        << mode->name << " " << degrees << " " << filter;
            }
}

/// Integrals through ones are the lengths of rays in a turned cuboid, which add up to its volume.
TEST(ParallelProduct, IntegralsOfAConstantAreLengths) {
    Data in = waves();
    std::fill_n(in.as<float>(), kInput.samples(), 1.0f);
    const Request want = turned(Mode::xray, 37, {140, 140, 140});  // all of it is seen
    const Scene scene;
    const Ask ask{want, scene};
    const Offer offer = parallel_product().offer(in.what, ask, by("foh"));
    const Data got = made(parallel_product(), in, offer, ask);
    double volume = 0;
    for (std::int64_t i = 0; i < offer.to.samples(); ++i) volume += got.as<float>()[i];
    // One ray a pixel is the midpoint rule, good to a thousandth for lengths with a few corners.
    EXPECT_NEAR(volume / double(kInput.samples()), 1, 1e-3);
}

TEST(ParallelProduct, SameBytesForAnyThreadsAndAnyRegion) {
    const Data in = waves();
    const Scene scene;
    for (const Mode mode : {Mode::mip, Mode::xray, Mode::mean, Mode::composite}) {
        const Request want = turned(mode, 37);
        const Ask ask{want, scene};
        const Offer offer = parallel_product().offer(in.what, ask, by("foh"));
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(parallel_product(), in, offer, ask);
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                     static_cast<std::size_t>(offer.to.bytes())));
        const Region box{{50, 13, 0}, {111, 66, 1}};
        const Data part = made(parallel_product(), in, offer, ask, box);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(50, y, 0), one.at<float>(50, y, 0),
                                     61 * sizeof(float) * one.what.channels));
    }
}

TEST(ParallelProduct, CountsHoldThoseOfItsPartsAndTheTree) {
    const Request want = turned(Mode::xray, 37);
    const Scene scene;
    const Ask ask{want, scene};
    Representation what;
    what.extent = kInput;
    const Offer offer = parallel_product().offer(what, ask, by("foh"));
    const Offer warp = permutation_warp().offer(what, ask, by("foh"));
    const Offer rest = combine().offer(warp.to, ask, {});
    const Work work = parallel_product().work(offer, ask, 0);
    const Work parts[] = {permutation_warp().work(warp, ask, 0), combine().work(rest, ask, 0)};
    EXPECT_GT(work.operations, parts[0].operations + parts[1].operations);
    EXPECT_GT(work.streamed, parts[0].streamed + parts[1].streamed);
    EXPECT_EQ(work.traffic.global, parts[0].traffic.global);  // every sample is sent once
    // 3 x 2 x 3 subframes of 64 x 64 pixels and three floats each, where the warp would have kept
    // 131 x 70 x 140 samples.
    EXPECT_EQ(work.workspace, 18. * 64 * 64 * 3 * 4);
    EXPECT_LT(work.workspace, warp.to.bytes());
}

TEST(ParallelProduct, ErrorsAreThoseOfTheWarpThroughTheRule) {
    const Request want = turned(Mode::mip, 37);
    Scene scene;
    scene.facts = {{"combined/foh", 0.02}, {"gain/blur", 3}, {"picture/combined", 0.01}};
    const Ask ask{want, scene};
    Representation what;
    what.extent = kInput;
    const Offer offer = parallel_product().offer(what, ask, by("foh"));
    const Error error = parallel_product().error(offer, ask);
    EXPECT_DOUBLE_EQ(error.bias, 0.06);
    EXPECT_GE(error.noise, 0.01);
    EXPECT_DOUBLE_EQ(error.gain, 3);
}

TEST(ParallelProduct, RefusesForTheReasonsOfItsParts) {
    const Scene scene;
    Representation what;
    what.extent = kInput;
    const auto refused = [&](const Request& want) {
        return parallel_product().offer(what, {want, scene}, by("foh")).refused;
    };
    Request wide = turned(Mode::mip, 10);
    Mat4 map = wide.views.at(0).matrix();
    map.row(0) *= 1.2;
    wide.views = Placement(map);
    EXPECT_NE(refused(wide).find("determinant is 1.2"), std::string::npos) << refused(wide);
    Request clipped = turned(Mode::mip, 10);
    clipped.clips.resize(1);
    EXPECT_NE(refused(clipped).find("clip"), std::string::npos) << refused(clipped);
    Request warp = turned(Mode::mip, 10);
    warp.job = Job::warp;
    EXPECT_NE(refused(warp), "");
    Request labels = turned(Mode::mip, 10);
    labels.field = Field::nearest;
    EXPECT_NE(refused(labels).find("labels"), std::string::npos) << refused(labels);
}

}  // namespace
}  // namespace edgewise
