// Volumes turned by phases of spectra: beside the field that their samples are taken of, and turned
// on and on until they stand as before.
#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <numbers>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/warp/phase_shears.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise {
namespace {

using ValueAt = std::function<double(const Vec3&)>;

Vec3 middle_of(const Extent& n) {
    return 0.5 * Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1));
}

/// A linear map about the middle of a volume.
Mat4 about_middle(const Eigen::Matrix3d& linear, const Extent& n, const Vec3& shift) {
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = linear;
    map.topRightCorner<3, 1>() = middle_of(n) - linear * middle_of(n) + shift;
    return map;
}

Eigen::Matrix3d turn_about(const Vec3& axis, double degrees) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized())
        .toRotationMatrix();
}

struct Turned {
    Request want;
    Scene scene;

    Turned(const Extent& n, const Mat4& map) {
        want.job = Job::warp;
        want.axes = 3;
        want.input = want.screen = n;
        want.views = Placement(map);
    }
    Offer offer(const Data& in) const { return phase_shears().offer(in.what, {want, scene}, {}); }
    Data of(const Data& in) const {
        const Offer made = offer(in);
        EXPECT_EQ(made.refused, "");
        Data out = Data::make(made.to, std::pmr::new_delete_resource());
        Context context{.memory = std::pmr::new_delete_resource()};
        phase_shears().run(made, {want, scene}, in, out, Region::all(made.to.extent), context);
        return out;
    }
};

Data sampled(const Extent& n, const ValueAt& field) {
    Representation what;
    what.extent = n;
    what.axes = 3;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                *data.at<float>(x, y, z) =
                    static_cast<float>(field(Vec3(double(x), double(y), double(z))));
    return data;
}

/// The turned volume as the input of what follows.
Data as_object(const Data& screen) {
    Representation what;
    what.extent = screen.what.extent;
    what.axes = 3;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::memcpy(data.as<char>(), screen.as<char>(), data.samples.bytes());
    return data;
}

/// Samples hold these blobs but for 1e-8: their spectra fade as fast as they do.
double volume_blobs(const Vec3& p, const Vec3& middle) {
    const auto blob = [&](const Vec3& at, double wide, double top) {
        return top * std::exp(-(p - middle - at).squaredNorm() / (2 * wide * wide));
    };
    return blob({2, -1, 3}, 2.7, 80) - blob({-3, 2, -1}, 2.6, 60) + blob({1, 3, -2}, 3, 30);
}

// Values are up to 80. Four passes are off by some 2^-24 log2 n of that each. Twelve turns round
// alike, so their errors add.
constexpr double kFew = 1e-4, kMany = 6 * kFew;

TEST(PhaseVolumes, AnyTurnIsTheFieldItself) {
    const Extent n{50, 47, 52};
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int repeated = 0; repeated < 12; ++repeated) {
        const Vec3 axis(normal(random), normal(random), normal(random));
        Eigen::Matrix3d linear = turn_about(axis, 30.0 * repeated + 7);
        if (repeated % 3 == 1) linear.col(1) *= -1;  // a mirror image
        if (repeated == 2) linear = turn_about(Vec3::UnitX(), 40);
        if (repeated == 3) linear = turn_about(Vec3::UnitY(), 90);
        const Mat4 map = about_middle(linear, n, {0.3, -0.4, 1.2});
        const Data in = sampled(n, [&](const Vec3& p) { return volume_blobs(p, middle_of(n)); });
        const Data out = Turned(n, map).of(in);
        const Mat4 back = map.inverse();
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    const Vec3 p =
                        (back * Eigen::Vector4d(double(x), double(y), double(z), 1)).head<3>();
                    bool inside = true;
                    for (int axis_of = 0; axis_of < 3; ++axis_of)
                        inside =
                            inside && p[axis_of] > -0.4 && p[axis_of] < double(n[axis_of]) - 0.6;
                    if (!inside) continue;
                    ASSERT_NEAR(*out.at<float>(x, y, z), volume_blobs(p, middle_of(n)), kFew)
                        << repeated << " at " << x << ' ' << y << ' ' << z;
                }
    }
}

TEST(PhaseVolumes, TwelveTurnsByThirtyDegreesGiveTheVolumeBack) {
    const Extent n{52, 52, 52};
    const Data in = sampled(n, [&](const Vec3& p) { return volume_blobs(p, middle_of(n)); });
    const Turned turn(n, about_middle(turn_about({1, 2, -0.7}, 30), n, Vec3::Zero()));
    Data now = as_object(turn.of(in));
    double moved = 0;
    for (std::int64_t i = 0; i < n.samples(); ++i)
        moved = std::max(moved, std::abs(double(now.as<float>()[i]) - in.as<float>()[i]));
    EXPECT_GT(moved, 10);
    for (int repeated = 1; repeated < 12; ++repeated) now = as_object(turn.of(now));
    for (std::int64_t i = 0; i < n.samples(); ++i)
        ASSERT_NEAR(now.as<float>()[i], in.as<float>()[i], kMany) << i;
}

/// Of a volume that shears up to the k-th have moved, frequency f is at L^-T f. What this holds
/// within half a cycle a sample on each axis is kept.
TEST(PhaseVolumes, EveryTurnKeepsABallOfFrequencies) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    double least = std::numeric_limits<double>::infinity();
    for (int repeated = 0; repeated < 3000; ++repeated) {
        const Eigen::Quaterniond turn(normal(random), normal(random), normal(random),
                                      normal(random));
        const Eigen::Matrix3d linear = turn.normalized().toRotationMatrix();
        const Mat4 map = about_middle(linear, {1, 1, 1}, Vec3::Zero());
        const kernels::Affine affine = kernels::affine_of(map);
        const auto chain = shear_chain(affine);
        ASSERT_TRUE(chain.has_value());
        ASSERT_LE(chain->count, 4);
        Eigen::Matrix3d moved = Eigen::Matrix3d::Zero();
        for (int i = 0; i < 3; ++i)
            moved(i, chain->from[std::size_t(i)]) = chain->sign[std::size_t(i)];
        for (int k = 0; k < chain->count; ++k) {
            Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
            for (int i = 0; i < 3; ++i)
                shear(chain->shears[std::size_t(k)].axis, i) +=
                    chain->shears[std::size_t(k)].by[std::size_t(i)];
            moved = shear * moved;
            for (int i = 0; i < 3; ++i)
                least = std::min(least, 0.5 / moved.inverse().col(i).norm());
        }
        ASSERT_LT((moved - linear).cwiseAbs().maxCoeff(), 1e-9);
    }
    EXPECT_GT(least, 0.39);
}

TEST(PhaseVolumes, BytesDoNotDependOnThreads) {
    const Extent n{31, 18, 23};
    std::mt19937 random(9);
    const Data in = sampled(n, [&](const Vec3&) { return double(random() % 1000); });
    const Turned turn(n, about_middle(turn_about({1, -1, 0.4}, 50), n, {0.2, 0, 0}));
    std::vector<Data> outs;
    for (const std::size_t threads : {1u, 4u}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        outs.push_back(turn.of(in));
    }
    EXPECT_EQ(std::memcmp(outs[0].as<char>(), outs[1].as<char>(), outs[0].samples.bytes()), 0);
}

TEST(PhaseVolumes, OddSizesAndConstants) {
    for (const Extent& n : {Extent{1, 1, 1}, Extent{9, 1, 1}, Extent{1, 1, 7}, Extent{5, 6, 1},
                            Extent{1, 30, 2}, Extent{3, 200, 5}}) {
        const Data in = sampled(n, [](const Vec3&) { return 42.0; });
        for (const double degrees : {0.0, 15.0, 90.0, 123.0}) {
            const Eigen::Matrix3d linear = turn_about({1, 2, 3}, degrees);
            const Mat4 map = about_middle(linear, n, Vec3::Zero());
            const Data out = Turned(n, map).of(in);
            for (std::int64_t z = 0; z < n.z; ++z)
                for (std::int64_t y = 0; y < n.y; ++y)
                    for (std::int64_t x = 0; x < n.x; ++x) {
                        const Vec3 p = linear.transpose() *
                                           (Vec3(double(x), double(y), double(z)) - middle_of(n)) +
                                       middle_of(n);
                        bool inside = true, near = false;
                        for (int axis = 0; axis < 3; ++axis) {
                            inside = inside && p[axis] >= -0.5 && p[axis] <= double(n[axis]) - 0.5;
                            near = near || std::abs(p[axis] + 0.5) < 1e-6 ||
                                   std::abs(p[axis] - double(n[axis]) + 0.5) < 1e-6;
                        }
                        if (near) continue;
                        ASSERT_NEAR(*out.at<float>(x, y, z), inside ? 42 : 0, kFew) << degrees;
                    }
        }
    }
}

TEST(PhaseVolumes, GridsThatNoMemoryHoldsAreRefused) {
    Representation what;
    what.extent = {1000000000, 1, 1};
    what.axes = 3;
    Turned turn(what.extent, about_middle(turn_about({1, 2, 3}, 45), what.extent, Vec3::Zero()));
    EXPECT_NE(phase_shears().offer(what, {turn.want, turn.scene}, {}).refused.find("grid"),
              std::string::npos);
}

}  // namespace
}  // namespace edgewise
