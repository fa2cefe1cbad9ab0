#include "transitions/project/shear_warp_runs.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp.hpp"
#include "transitions/shade/runs.hpp"
#include "transitions/warp/axis_permutation.hpp"

namespace edgewise {
namespace {

using Points = std::vector<Transfer::Point>;

const Points kFaint = {{0.3, 0, {0, 0, 0.2}}, {1, 0.02, {1, 0.5, 0}}};
const Points kOpaque = {{0.5, 0, {1, 1, 1}}, {0.6, 1, {1, 1, 1}}};
const Points kShell = {{0.4, 0, {1, 0, 0}}, {0.5, 0.6, {0, 1, 0}}, {0.6, 0, {0, 0, 1}}};
const Points kNothing = {{5, 0, {1, 1, 1}}, {6, 1, {1, 1, 1}}};

Vec3 centre(const Extent& n) { return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2; }

/// Turned about the centre; a sample is `spacing` units along each axis.
Request turned(Mode mode, const Extent& input, const Vec3& degrees, const Points& points,
               const Vec3& spacing = Vec3::Ones()) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.input = input;
    want.spacing = spacing;
    const double longest = (centre(input) * 2).cwiseProduct(spacing).norm() + 2;
    const auto side = static_cast<std::int64_t>(std::ceil(longest));
    want.screen = {side + 3, side, side};
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    for (int axis = 0; axis < 3; ++axis)
        turn = (Eigen::AngleAxisd(degrees[axis] * EIGEN_PI / 180, Vec3::Unit(axis)).matrix() * turn)
                   .eval();
    turn = (turn * spacing.asDiagonal()).eval();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = turn;
    map.topRightCorner<3, 1>() = centre(want.screen) - turn * centre(input);
    want.views = Placement(map);
    want.transfer.points = points;
    return want;
}

template <class T>
Data samples_of(const Extent& extent, Type type, const ValueMap& values) {
    Representation what;
    what.extent = extent;
    what.type = type;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 random(3);
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x) {
                // Balls with a rough skin in empty space, 0 to 1.
                const double wave = std::sin(0.19 * double(x) + 1) * std::cos(0.17 * double(y + z));
                const double noise = 0.1 * double(random() % 1000) / 1000;
                const double value = wave > 0 ? std::min(1.0, wave + noise) : 0;
                *data.at<T>(x, y, z) = static_cast<T>((value - values.offset) / values.slope);
            }
    return data;
}

Data balls(const Extent& extent) { return samples_of<float>(extent, Type::f32, {}); }

Parameters by(const std::string& filter) { return {{"filter", filter}}; }

Data made(const Transition& edge, const Data& in, const Offer& offer, const Ask& ask,
          const Region& region) {
    Data out = edge.attaches ? Data::sharing(in, offer.to)
                             : Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, region, context);
    return out;
}

Data made(const Transition& edge, const Data& in, const Ask& ask, const Parameters& with) {
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "") << edge.name;
    return made(edge, in, offer, ask, Region::all(offer.to.extent));
}

/// The picture by runs and that of all voxels.
void expect_same(const Data& in, const Ask& ask) {
    const Data with_runs = made(visible_runs(), in, ask, {});
    for (const char* filter : {"zoh", "foh"}) {
        const Data got = made(shear_warp_runs(), with_runs, ask, by(filter));
        const Data expected = made(shear_warp(), in, ask, by(filter));
        ASSERT_EQ(0, std::memcmp(got.samples.data(), expected.samples.data(),
                                 static_cast<std::size_t>(got.what.bytes())))
            << filter << ' ' << ask.want.mode->name;
    }
}

TEST(ShearWarpRuns, AreThePictureOfAllVoxelsToTheBit) {
    const Extent n{150, 61, 43};
    const Data inputs[] = {balls(n), samples_of<std::uint8_t>(n, Type::u8, {1 / 255., 0}),
                           samples_of<std::int16_t>(n, Type::i16, {-1 / 3000., 1}),
                           samples_of<double>(n, Type::f64, {})};
    const Scene scene;
    for (const Data& in : inputs)
        for (const Points& points : {kFaint, kOpaque, kShell, kNothing})
            for (const Vec3& degrees : {Vec3(0, 0, 0), Vec3(20, -31, 100), Vec3(170, 13, 5)}) {
                const Request want = turned(mode_named("composite"), n, degrees, points);
                expect_same(in, {want, scene});
            }
}

TEST(ShearWarpRuns, AreSoInEveryModeThatTakesThem) {
    const Extent n{70, 31, 43};
    const Data in = balls(n);
    const Scene scene;
    int took = 0;
    for (const Mode mode : modes()) {
        const Request want = turned(mode, n, Vec3(20, -31, 10), kShell);
        const Ask ask{want, scene};
        if (!visible_runs().offer(in.what, ask, {}).refused.empty()) continue;
        expect_same(in, ask);
        ++took;
    }
    EXPECT_EQ(took, 2);  // by opacity and by level
}

TEST(ShearWarpRuns, AreSoOfOddShapesAndSpacings) {
    const Scene scene;
    for (const Extent& n : {Extent{1, 1, 1}, Extent{20, 9, 1}, Extent{1, 9, 9}, Extent{9, 1, 7},
                            Extent{301, 3, 5}, Extent{33, 40, 2}}) {
        const Data in = balls(n);
        for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(1, 1.3, 1), Vec3(1, 1, 0.6)})
            for (const Points& points : {kFaint, kOpaque}) {
                const Request want =
                    turned(mode_named("composite"), n, Vec3(3, 11, 40), points, spacing);
                expect_same(in, {want, scene});
            }
    }
}

/// Slices across rays along x and y, each with its own extent.
TEST(ShearWarpRuns, FollowSlicesThatLieAcrossTheRays) {
    const Extent n{60, 37, 45};
    const Data in = balls(n);
    const Scene scene;
    for (const Vec3& degrees : {Vec3(80, 5, 0), Vec3(5, 80, 0), Vec3(5, -80, 0)}) {
        const Request want = turned(mode_named("composite"), n, degrees, kShell);
        const Ask ask{want, scene};
        EXPECT_NE(shear_warp().offer(in.what, ask, by("foh")).refused, "");
        expect_same(made(axis_permutation_warp(), in, ask, {{"to", "aligned"}}), ask);
    }
}

/// A smooth volume, against rays through the trilinear field: what slices and a second
/// interpolation add is what project.shear_warp states for it.
TEST(ShearWarpRuns, AreNearARayCast) {
    const Extent n{48, 44, 40};
    Data in = balls(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                *in.at<float>(x, y, z) = static_cast<float>(std::exp(
                    -(Vec3(double(x), double(y), double(z)) - centre(n)).squaredNorm() / 150));
    const Request want = turned(mode_named("composite"), n, Vec3(15, 25, 0),
                                {{0.2, 0, {1, 1, 1}}, {1, 0.3, {1, 1, 1}}});
    const Scene scene;
    const Ask ask{want, scene};
    const Data got = made(shear_warp_runs(), made(visible_runs(), in, ask, {}), ask, by("foh"));
    Parameters fine = by("foh");
    fine.set("step", 0.25);
    const Data cast = made(ray_cast(), in, ask, fine);
    double squares = 0, largest = 0;
    const std::int64_t count = got.what.samples() * got.what.channels;
    for (std::int64_t i = 0; i < count; ++i) {
        squares += std::pow(double(got.as<float>()[i]) - double(cast.as<float>()[i]), 2);
        largest = std::max(largest, double(cast.as<float>()[i]));
    }
    EXPECT_GT(largest, 0.5);
    EXPECT_LT(std::sqrt(squares / double(count)), 0.01 * largest);
}

TEST(ShearWarpRuns, SamplesThatAreNotFiniteAreKeptToThemselves) {
    const Extent n{40, 33, 21};
    Data in = balls(n);
    for (std::int64_t i = 7; i < n.samples(); i += 101)
        in.as<float>()[i] = i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                       : std::numeric_limits<float>::infinity();
    const Request want = turned(mode_named("composite"), n, Vec3(10, 20, 0), kShell);
    Scene scene;
    scene.non_finite = 270;
    const Ask ask{want, scene};
    const Data with_runs = made(visible_runs(), in, ask, {});
    const Data got = made(shear_warp_runs(), with_runs, ask, by("zoh"));
    const Data expected = made(shear_warp(), in, ask, by("zoh"));
    EXPECT_EQ(0, std::memcmp(got.samples.data(), expected.samples.data(),
                             static_cast<std::size_t>(got.what.bytes())));
    const std::string refused = shear_warp_runs().offer(with_runs.what, ask, by("foh")).refused;
    EXPECT_NE(refused.find("270 samples are not finite"), std::string::npos) << refused;
}

TEST(ShearWarpRuns, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{150, 61, 43};
    const Data in = balls(n);
    const Scene scene;
    for (const Points& points : {kFaint, kOpaque}) {
        const Request want = turned(mode_named("composite"), n, Vec3(20, -31, 100), points);
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(shear_warp_runs(), made(visible_runs(), in, ask, {}), ask, by("foh"));
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                     static_cast<std::size_t>(one.what.bytes())));
        const Data with_runs = made(visible_runs(), in, ask, {});
        const Offer offer = shear_warp_runs().offer(with_runs.what, ask, by("foh"));
        const Region box{{50, 13, 0}, {111, 66, 1}};
        const Data part = made(shear_warp_runs(), with_runs, offer, ask, box);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(50, y, 0), one.at<float>(50, y, 0),
                                     61 * sizeof(float) * one.what.channels));
    }
}

TEST(ShearWarpRuns, CountsFollowWhatIsSeen) {
    const Extent n{96, 96, 96};
    const Request want = turned(mode_named("composite"), n, Vec3(10, 20, 0), kOpaque);
    const auto work = [&](double seen, double taken) {
        Scene scene;
        scene.facts = {{"runs/seen", seen},
                       {"runs/row", 2},
                       {"cast/all", 100},
                       {"cast/taken", 80},
                       {"cast/bricks", 100 * taken}};
        const Ask ask{want, scene};
        Representation what;
        what.extent = n;
        const Offer runs = visible_runs().offer(what, ask, {});
        EXPECT_EQ(runs.refused, "");
        EXPECT_LE(runs.to.facet_bytes, 1.2 * what.bytes());
        const Offer offer = shear_warp_runs().offer(runs.to, ask, by("foh"));
        EXPECT_EQ(offer.refused, "");
        return shear_warp_runs().work(offer, ask, 0).operations;
    };
    const double voxels = double(n.samples());
    EXPECT_NEAR(work(0.3, 0.2) - work(0.3, 0.1), work(0.2, 0.9) - work(0.1, 0.9), 1);
    EXPECT_GT(work(0.3, 0.2) - work(0.3, 0.1), 0.1 * voxels * 20);
    EXPECT_EQ(work(0.3, 0.3), work(0.3, 0.9));
}

TEST(ShearWarpRuns, FactsAreThoseOfTheRows) {
    const Extent n{100, 20, 10};
    Data in = balls(n);
    std::fill_n(in.as<float>(), n.samples(), 0.0f);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y) {
            for (std::int64_t x = 20; x < 30; ++x) *in.at<float>(x, y, z) = 1;
            *in.at<float>(80, y, z) = 1;
        }
    const Request want = turned(mode_named("composite"), n, Vec3(0, 0, 0), kOpaque);
    std::map<std::string, double> facts;
    visible_runs().count(in, want, facts, std::pmr::new_delete_resource());
    // Cells 19 to 29 and 79 to 80.
    EXPECT_DOUBLE_EQ(facts["runs/seen"], 0.13);
    EXPECT_DOUBLE_EQ(facts["runs/row"], 2);
}

TEST(ShearWarpRuns, RefuseWithTheNumberThatBrokeTheLimit) {
    const Extent n{40, 33, 21};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto refused = [&](const Request& want) {
        return visible_runs().offer(what, {want, scene}, {}).refused;
    };
    const Request fine = turned(mode_named("composite"), n, Vec3(10, 20, 0), kShell);
    EXPECT_EQ(refused(fine), "");
    EXPECT_NE(refused(turned(mode_named("mip"), n, Vec3(10, 20, 0), kShell)), "");
    Request eye = fine;
    eye.eye = Eye{{0, 0, -100}, 0};
    EXPECT_NE(refused(eye).find("finite distance"), std::string::npos);
    Request clipped = fine;
    clipped.clips.resize(1);
    EXPECT_NE(refused(clipped).find("clip"), std::string::npos);
    Request all = fine;
    all.transfer.points = {{0, 0.1, {1, 1, 1}}};
    EXPECT_NE(refused(all).find("every value may be seen"), std::string::npos);
    what.extent.x = 70000;
    EXPECT_NE(refused(fine).find("rows of 70000 samples"), std::string::npos);
    what.extent = n;
    scene.facts = {{"runs/seen", 0.95}, {"cast/all", 10}, {"cast/taken", 9.9}};
    EXPECT_NE(refused(fine).find("95 % of the samples are seen"), std::string::npos);
    scene.facts["cast/taken"] = 2;  // most are hidden
    EXPECT_EQ(refused(fine), "");
    what.facets = {"others"};
    EXPECT_NE(refused(fine), "");
    what.facets = {};
    const Request steep = turned(mode_named("composite"), n, Vec3(10, 80, 0), kShell);
    EXPECT_NE(shear_warp_runs().offer(what, {steep, scene}, by("foh")).refused.find("at most 1"),
              std::string::npos);
}

}  // namespace
}  // namespace edgewise
