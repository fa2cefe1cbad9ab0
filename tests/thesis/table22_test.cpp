// Table 22 of [W93]: volumes of 128^3 turned by 45 degrees about x, y and z, and the absolute error
// summed along the rays.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <memory_resource>
#include <numbers>

#include "transitions/warp/backward.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 128;
constexpr double kCentre = 63.5, kWhite = 65535;  // 16 bits

/// A body's intensity at a position from the centre [voxel].
using Body = std::function<double(const Vec3&)>;

double sphere(const Vec3& p) { return kWhite * std::max(0.0, 1 - p.norm() / 32); }
double cube(const Vec3& p) { return p.cwiseAbs().maxCoeff() <= 31.5 ? kWhite : 0; }

/// EQ 37.
Mat4 turned_by_45_degrees() {
    Eigen::Affine3d turn = Eigen::Affine3d::Identity();
    turn.translate(Vec3::Constant(kCentre));
    for (const int axis : {2, 1, 0})
        turn.rotate(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::Unit(axis)));
    turn.translate(Vec3::Constant(-kCentre));
    return turn.matrix();
}

Vec3 place(std::int64_t i) {
    return Vec3(double(i % kSide), double(i / kSide % kSide), double(i / (kSide * kSide)));
}

Data sampled(const Body& body) {
    Representation what;
    what.extent = {kSide, kSide, kSide};
    what.type = Type::u16;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < what.samples(); ++i)
        data.as<std::uint16_t>()[i] =
            static_cast<std::uint16_t>(std::lround(body(place(i) - Vec3::Constant(kCentre))));
    return data;
}

struct Errors {
    double mean = 0, max = 0;  // over rays, of sums along z
};

/// The warped volume, rounded to 16 bits, against the body at T^-1 of every voxel.
Errors errors_of(const Body& body, const char* filter) {
    const Mat4 turn = turned_by_45_degrees(), back = turn.inverse();
    const Data in = sampled(body);
    Request want;
    want.job = Job::warp;
    want.input = want.screen = in.what.extent;
    want.views = Placement(turn);
    const Scene scene;
    const Ask ask{want, scene};
    const Transition edge = backward_warp();
    const Offer offer = edge.offer(in.what, ask, {{"filter", std::string(filter)}});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    std::vector<double> rays(kSide * kSide);
    for (std::int64_t i = 0; i < out.what.samples(); ++i) {
        const Vec3 p = (back * place(i).homogeneous()).head<3>() - Vec3::Constant(kCentre);
        rays[std::size_t(i % (kSide * kSide))] +=
            std::abs(std::nearbyint(double(out.as<float>()[i])) - body(p));
    }
    Errors errors{.max = *std::max_element(rays.begin(), rays.end())};
    for (const double ray : rays) errors.mean += ray / double(rays.size());
    return errors;
}

// The sphere tells the holds apart; of the cube the edge is all the error. A ray through the cube
// can miss at most two edge voxels by all of 65535, which zero-order hold does.
TEST(Table22, ZeroOrderHoldOfTheSphere) {
    EXPECT_NEAR(errors_of(sphere, "zoh").mean, 3977, 0.01 * 3977);
}

TEST(Table22, FirstOrderHoldOfTheSphere) {
    EXPECT_NEAR(errors_of(sphere, "foh").mean, 259, 0.015 * 259);
}

TEST(Table22, ZeroOrderHoldOfTheCube) {
    const Errors errors = errors_of(cube, "zoh");
    EXPECT_NEAR(errors.mean, 48372, 0.005 * 48372);
    EXPECT_EQ(errors.max, 131070);
}

TEST(Table22, FirstOrderHoldOfTheCube) {
    EXPECT_NEAR(errors_of(cube, "foh").mean, 48309, 0.01 * 48309);
}

}  // namespace
}  // namespace edgewise
