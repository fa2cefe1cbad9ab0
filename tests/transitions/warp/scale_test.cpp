#include "transitions/warp/scale.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <string>

#include "transitions/warp/permutation.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;

constexpr Extent kInput{16, 16, 23};
const Vec3 kSpacing(3.2, 3.2, 1.5);  // of the bundled CT

Vec3 centre(const Extent& n) { return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2; }

/// Pictures of a turned volume, pixels of `pixel` and steps of 1.5 along the rays.
Request turned(const std::vector<Matrix3d>& turns, const Vec3& spacing = kSpacing,
               const Vec3& pixel = Vec3::Constant(1.5)) {
    Request want;
    want.job = Job::render;
    want.input = kInput;
    want.spacing = spacing;
    want.unit = pixel.z();
    want.screen = {70, 70, 70};
    want.frames = static_cast<int>(turns.size());
    std::vector<Mat4> maps;
    for (const Matrix3d& turn : turns) {
        Mat4 map = Mat4::Identity();
        const Matrix3d linear = pixel.cwiseInverse().asDiagonal() * turn * spacing.asDiagonal();
        map.topLeftCorner<3, 3>() = linear;
        map.topRightCorner<3, 1>() = centre(want.screen) - linear * centre(kInput);
        maps.push_back(map);
    }
    want.views = Placement::each(maps);
    return want;
}

Matrix3d turn(double degrees, const Vec3& axis = Vec3(1, 2, -1)) {
    return Eigen::AngleAxisd(degrees * EIGEN_PI / 180, axis.normalized()).matrix();
}

Representation volume(const Extent& extent = kInput) {
    Representation what;
    what.extent = extent;
    return what;
}

Parameters by(const std::string& filter) { return {{"filter", filter}}; }

std::string refused(const Representation& from, const Request& want, const std::string& filter,
                    const Scene& scene = {}) {
    return scaling().offer(from, {want, scene}, by(filter)).refused;
}

Data made(const Data& in, const Offer& offer, const Ask& ask) {
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    scaling().run(offer, ask, in, out, Region::all(offer.to.extent), context);
    return out;
}

TEST(Scale, LeavesARotationForWhichAPermutationExists) {
    const Request want = turned({turn(25), turn(140), turn(90, Vec3::UnitX())});
    const Scene scene;
    const Ask ask{want, scene};
    // The determinant of the CT's views, by which the rule of shears refuses it.
    EXPECT_NE(permutation_warp().offer(volume(), ask, by("foh")).refused.find("4.55111"),
              std::string::npos);
    const Offer offer = scaling().offer(volume(), ask, by("foh"));
    ASSERT_EQ(offer.refused, "");
    // 16 samples of 3.2 take 34.1 of 1.5; z has that spacing already.
    EXPECT_EQ(offer.to.extent, (Extent{35, 35, 23}));
    EXPECT_EQ(offer.to.kind(), "scaled/scalar");
    for (int view = 0; view < want.frames; ++view) {
        const Matrix3d left = residual(offer.to, want, view).topLeftCorner<3, 3>();
        EXPECT_LE((left * left.transpose() - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
    }
    for (const char* filter : {"me", "zoh", "foh"})
        EXPECT_EQ(permutation_warp().offer(offer.to, ask, by(filter)).refused, "");
}

/// Linear functions come out exactly of filters of order 2 and more, where no border is read.
TEST(Scale, SamplesLieWhereTheirPlacementSays) {
    const Request want = turned({turn(25)});
    const Scene scene;
    const Ask ask{want, scene};
    Data in = Data::make(volume(), std::pmr::new_delete_resource());
    const auto field = [](const Vec3& p) { return 1 + 2 * p.x() - 3 * p.y() + 0.5 * p.z(); };
    for (std::int64_t z = 0; z < kInput.z; ++z)
        for (std::int64_t y = 0; y < kInput.y; ++y)
            for (std::int64_t x = 0; x < kInput.x; ++x)
                *in.at<float>(x, y, z) =
                    static_cast<float>(field(Vec3(double(x), double(y), double(z))));
    for (const char* filter : {"foh", "keys"}) {
        const Offer offer = scaling().offer(in.what, ask, by(filter));
        ASSERT_EQ(offer.refused, "");
        const Data out = made(in, offer, ask);
        const Mat4 to_input = offer.to.placed.at(0).inverse().matrix();
        for (std::int64_t z = 0; z < out.what.extent.z; ++z)
            for (std::int64_t y = 0; y < out.what.extent.y; ++y)
                for (std::int64_t x = 0; x < out.what.extent.x; ++x) {
                    const Vec3 p =
                        (to_input * Eigen::Vector4d(double(x), double(y), double(z), 1)).head<3>();
                    if (p.x() < 2 || p.y() < 2 || p.x() > 13 || p.y() > 13) continue;
                    // f32 rounds some twenty numbers up to 90.
                    ASSERT_NEAR(*out.at<float>(x, y, z), field(p), 20 * 90 * 0x1p-24) << filter;
                }
    }
}

TEST(Scale, CountsAreThoseOfItsSums) {
    const Request want = turned({turn(25)});
    const Scene scene;
    const Ask ask{want, scene};
    const Offer offer = scaling().offer(volume(), ask, by("foh"));
    const Work work = scaling().work(offer, ask, 0);
    // A slice: along z one product and sum for each of 16 x 16 samples, along y two for 16 x 35,
    // along x two and the value map for 35 x 35; foh's weights take no more than one an axis.
    const double slice = 2 * 16 * 16 + 4 * 16 * 35 + 6 * 35 * 35;
    EXPECT_NEAR(work.operations, 23 * slice, 35 + 35 + 23);
    // Along z every sample is read once.
    EXPECT_EQ(work.streamed, 4. * (16 * 16 * 23 + 35 * 35 * 23));
    EXPECT_EQ(work.gathers, 0);
    EXPECT_EQ(work.scratch, 4. * 17 * 16);
}

TEST(Scale, IsNeverSaidToBeExact) {
    const Request want = turned({turn(25)});
    Scene scene;
    scene.facts = {{"combined/foh", 0.02}, {"combined/bspline3", 0.0}, {"field/foh", 0.03}};
    const Ask ask{want, scene};
    const Offer linear = scaling().offer(volume(), ask, by("foh"));
    EXPECT_EQ(scaling().error(linear, ask).bias, 0.02);
    Representation coefficients = volume();
    coefficients.content = "coefficients";
    const Offer spline = scaling().offer(coefficients, ask, by("bspline3"));
    ASSERT_EQ(spline.refused, "");
    EXPECT_EQ(scaling().error(spline, ask).bias, 0);  // it is the field, but for rounding
    EXPECT_GT(scaling().error(spline, ask).noise, 0);
    EXPECT_GE(scaling().error(spline, ask).noise_gain, 1);
    EXPECT_FALSE(scaling().error(spline, ask).copies);
}

/// What a linear hold of the grid adds is the less the finer it is along every axis.
TEST(Scale, FinerGridsLeaveLessToTheWarpBehindThem) {
    Scene scene;
    scene.facts = {{"combined/foh", 0.02}, {"combined/zoh", 0.04}, {"combined/me", 0.05}};
    const auto bias = [&](double pixel, const std::string& filter) {
        const Request want = turned({turn(25)}, kSpacing, Vec3::Constant(pixel));
        const Ask ask{want, scene};
        const Offer scaled = scaling().offer(volume(), ask, by("foh"));
        EXPECT_EQ(scaled.refused, "");
        const Transition warp = permutation_warp();
        return warp.error(warp.offer(scaled.to, ask, by(filter)), ask).bias;
    };
    // The grid is as coarse as the input along z.
    EXPECT_EQ(bias(1.5, "foh"), 0.02);
    EXPECT_EQ(bias(1.5, "me"), 0.05);
    // Of half the spacing: waves of two samples, w = pi, lose 5/3 + cos w / 3 - 4 (1 - cos w) / w^2
    // of their square by a linear hold and 2 - 2 sin(w/2) / (w/2) by the nearest sample.
    const auto linear = [](double w) {
        return 5. / 3 + std::cos(w) / 3 - 4 * (1 - std::cos(w)) / (w * w);
    };
    const auto nearest = [](double w) { return 2 - 2 * std::sin(w / 2) / (w / 2); };
    const double pi = EIGEN_PI;
    EXPECT_NEAR(bias(0.75, "foh"), 0.02 * std::sqrt(linear(pi / 2) / linear(pi)), 2e-5);
    EXPECT_NEAR(bias(0.75, "zoh"), 0.04 * std::sqrt(nearest(pi / 2) / nearest(pi)), 4e-5);
    EXPECT_NEAR(bias(0.75, "me"), 0.05 * std::sqrt(nearest(pi / 2) / nearest(pi)), 5e-5);
}

TEST(Scale, RefusesWithTheReason) {
    const Request want = turned({turn(25)});
    const auto says = [](const std::string& text, const std::string& part) {
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    says(refused(volume(), turned({turn(25)}, Vec3::Constant(2)), "foh"), "equally spaced");
    says(refused(volume(), turned({turn(25)}, Vec3(2, 1, 0.5), Vec3::Ones()), "foh"),
         "determinant is 1");
    says(refused(volume(), turned({turn(25)}, kSpacing, Vec3(4, 4, 1.5)), "foh"),
         "would skip samples that lie 1.5 apart");
    says(refused(volume(), turned({turn(25), 1.1 * turn(25)}), "foh"), "views scale differently");
    says(refused(volume(), want, "bspline3"), "coefficients");
    Scene holes;
    holes.non_finite = 3;
    says(refused(volume(), want, "foh", holes), "3 samples are not finite");
    Representation color = volume();
    color.channels = 3;
    says(refused(color, want, "foh"), "3 channels");
    Request labels = want;
    labels.field = Field::nearest;
    says(refused(volume(), labels, "foh"), "label");
    EXPECT_EQ(refused(volume(), labels, "zoh"), "");
    Request warp = want;
    warp.job = Job::warp;
    says(refused(volume(), warp, "foh"), "rays");
    Request near = want;
    near.eye = Eye{};
    says(refused(volume(), near, "foh"), "finite distance");
    Request clipped = want;
    clipped.clips.resize(1);
    says(refused(volume(), clipped, "foh"), "clip");
    Request lit = want;
    lit.mode = Mode::composite;
    lit.shading.by = Shade::phong;
    says(refused(volume(), lit, "foh"), "light");
}

TEST(Scale, SameBytesForAnyNumberOfThreads) {
    const Request want = turned({turn(25)});
    const Scene scene;
    const Ask ask{want, scene};
    Data in = Data::make(volume(), std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < kInput.samples(); ++i)
        in.as<float>()[i] = static_cast<float>(std::sin(double(i)));
    const Offer offer = scaling().offer(in.what, ask, by("keys"));
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return made(in, offer, ask);
    };
    const Data one = with(1);
    for (const std::size_t threads : {2u, 7u})
        EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                 static_cast<std::size_t>(offer.to.bytes())));
}

}  // namespace
}  // namespace edgewise
