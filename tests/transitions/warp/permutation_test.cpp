#include "transitions/warp/permutation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <random>

#include "transitions/warp/backward.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;

constexpr Extent kObject{19, 16, 13}, kScreen{22, 20, 18};

Vec3 centre(const Extent& n) { return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2; }

Request request_of(const Matrix3d& a, const Extent& from, const Extent& to) {
    Request want;
    want.job = Job::warp;
    want.axes = from.z == 1 ? 2 : 3;
    want.input = from;
    want.screen = to;
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = a;
    map.topRightCorner<3, 1>() = centre(to) - a * centre(from);
    want.views = Placement(map);
    return want;
}

Data noise(const Extent& extent) {
    Representation what;
    what.axes = extent.z == 1 ? 2 : 3;
    what.extent = extent;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 random(3);
    std::uniform_real_distribution<float> value;
    for (std::int64_t i = 0; i < extent.samples(); ++i) data.as<float>()[i] = value(random);
    return data;
}

Data warped(const Transition& edge, const Data& in, const Ask& ask, const Offer& offer) {
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    return out;
}

double largest_difference(const Data& a, const Data& b) {
    double worst = 0;
    for (std::int64_t i = 0; i < a.what.samples(); ++i)
        worst = std::max(worst, std::abs(double(a.as<float>()[i]) - b.as<float>()[i]));
    return worst;
}

/// A random map, the wilder the less `tame` it is, scaled to the determinant 1 or -1.
Matrix3d equiareal_map(bool image, int tame, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (;;) {
        Matrix3d a = Matrix3d::Identity();
        for (int k = 0; k < 9; ++k) a(k / 3, k % 3) += 1.5 / (1 + tame * tame) * normal(random);
        if (tame == 0) a.col(0) *= std::exp(2 * normal(random));
        if (image) a.row(2) = a.col(2).transpose() = Vec3::UnitZ();
        const double det = std::abs(a.determinant());
        if (det < 0.01) continue;
        if (!image) return a / std::cbrt(det);
        a.topLeftCorner<2, 2>() /= std::sqrt(det);
        return a;
    }
}

TEST(PermutationEdge, EquiarealMapsHoldUnderTheHaloOrAreRefusedForIt) {
    std::mt19937 random(9);
    const Transition edge = permutation_warp(), direct = backward_warp();
    const Scene scene;
    int offered = 0, refused = 0;
    for (int i = 0; i < 600; ++i) {
        const bool image = i % 4 == 0;
        const Matrix3d a = equiareal_map(image, i % 3, random);
        const Extent from = image ? Extent{31, 26, 1} : kObject;
        const Extent to = image ? Extent{40, 40, 1} : kScreen;
        const Request want = request_of(a, from, to);
        const Ask ask{want, scene};
        const Data in = noise(from);
        const Offer offer = edge.offer(in.what, ask, {{"filter", std::string("foh")}});
        if (!offer.refused.empty()) {
            ++refused;
            EXPECT_NE(offer.refused.find("halo"), std::string::npos) << offer.refused << "\n" << a;
            continue;
        }
        ++offered;
        const Offer gathered = direct.offer(in.what, ask, {{"filter", std::string("foh")}});
        // Both keep positions to 2^-22 of a sample, where three axes change by the range at most.
        EXPECT_LE(
            largest_difference(warped(edge, in, ask, offer), warped(direct, in, ask, gathered)),
            2e-6)
            << a;
    }
    EXPECT_GT(offered, 200);
    EXPECT_GT(refused, 5);
}

TEST(PermutationEdge, RotationsAreNeverRefused) {
    std::mt19937 random(10);
    std::normal_distribution<double> normal;
    const Transition edge = permutation_warp();
    const Scene scene;
    Representation what;
    what.extent = kObject;
    for (int i = 0; i < 2000; ++i) {
        const Matrix3d a =
            Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                .normalized()
                .matrix();
        const Request want = request_of(a, kObject, kScreen);
        for (const char* filter : {"me", "zoh", "foh"})
            ASSERT_EQ(edge.offer(what, {want, scene}, {{"filter", std::string(filter)}}).refused,
                      "")
                << a;
    }
}

TEST(PermutationEdge, MapsThatScaleAreRefusedWithTheirDeterminant) {
    const Request want = request_of(1.1 * Matrix3d::Identity(), kObject, kScreen);
    const Scene scene;
    Representation what;
    what.extent = kObject;
    const Offer offer =
        permutation_warp().offer(what, {want, scene}, {{"filter", std::string("foh")}});
    EXPECT_NE(offer.refused.find("1.33"), std::string::npos) << offer.refused;
}

}  // namespace
}  // namespace edgewise
