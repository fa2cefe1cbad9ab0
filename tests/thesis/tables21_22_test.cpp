// Tables 21 and 22 of [W93]: volumes of 128^3 turned about x, y and z by 5 to 45 degrees, and by
// 45, and the absolute error summed along the rays.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <memory_resource>
#include <numbers>
#include <tbb/parallel_for.h>
#include <vector>

#include "transitions/warp/backward.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 128;
constexpr double kCentre = 63.5, kWhite = 65535;  // 16 bits

/// A body's intensity at a position from the centre [voxel].
using Body = std::function<double(const Vec3&)>;

double sphere(const Vec3& p) { return kWhite * std::max(0.0, 1 - p.norm() / 32); }
double cube(const Vec3& p) { return p.cwiseAbs().maxCoeff() <= 31.5 ? kWhite : 0; }

/// About the centre of the volume.
Mat4 centred(const Eigen::Matrix3d& linear) {
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    map.translate(Vec3::Constant(kCentre));
    map.linear() = linear;
    map.translate(Vec3::Constant(-kCentre));
    return map.matrix();
}

/// EQ 37, by the same angle about all axes [degree].
Mat4 turned(double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    for (const int axis : {2, 1, 0}) turn = turn * Eigen::AngleAxisd(angle, Vec3::Unit(axis));
    return centred(turn);
}

/// The same as nine shears of one axis by another, three for each axis (EQ 10), the first one
/// first.
std::vector<Mat4> nine_shears(double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    std::vector<Mat4> shears;
    for (int axis = 0; axis < 3; ++axis) {
        const int i = (axis + 1) % 3, j = (axis + 2) % 3;
        const auto shear = [&](int row, int column, double by) {
            Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
            linear(row, column) = by;
            shears.push_back(centred(linear));
        };
        shear(i, j, -std::tan(angle / 2));
        shear(j, i, std::sin(angle));
        shear(i, j, -std::tan(angle / 2));
    }
    return shears;
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

/// The volume, warped by an edge of the library, as 16 bits.
Data warped(const Data& in, const Mat4& map, const std::string& filter, double (*whole)(double)) {
    Request want;
    want.job = Job::warp;
    want.input = want.screen = in.what.extent;
    want.views = Placement(map);
    const Scene scene;
    const Ask ask{want, scene};
    const Transition edge = backward_warp();
    const Offer offer = edge.offer(in.what, ask, {{"filter", filter}});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    Data bits = Data::make(in.what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < out.what.samples(); ++i)
        bits.as<std::uint16_t>()[i] =
            static_cast<std::uint16_t>(std::clamp(whole(double(out.as<float>()[i])), 0.0, kWhite));
    return bits;
}

/// The turned volume as one of the thesis's three algorithms makes it.
Data made(const Data& in, double degrees, const std::string& by) {
    if (by != "multipass") return warped(in, turned(degrees), by, std::nearbyint);
    // "Truncated to integers after every pass". Linear interpolation of whole numbers between whole
    // numbers is one up to rounding.
    Data now = Data::sharing(in, in.what);
    for (const Mat4& shear : nine_shears(degrees))
        now = warped(now, shear, "foh", [](double v) { return std::floor(v + 1e-3); });
    return now;
}

/// The body itself at T^-1 of every voxel.
std::vector<double> turned_body(const Body& body, double degrees) {
    const Mat4 back = turned(degrees).inverse();
    std::vector<double> values(kSide * kSide * kSide);
    tbb::parallel_for(std::int64_t{0}, kSide, [&](std::int64_t z) {
        for (std::int64_t i = z * kSide * kSide; i < (z + 1) * kSide * kSide; ++i)
            values[std::size_t(i)] =
                body((back * place(i).homogeneous()).head<3>() - Vec3::Constant(kCentre));
    });
    return values;
}

Errors errors_of(const Data& out, const std::vector<double>& expected) {
    std::vector<double> rays(kSide * kSide);
    for (std::int64_t i = 0; i < out.what.samples(); ++i)
        rays[std::size_t(i % (kSide * kSide))] +=
            std::abs(double(out.as<std::uint16_t>()[i]) - expected[std::size_t(i)]);
    Errors errors{.max = *std::max_element(rays.begin(), rays.end())};
    for (const double ray : rays) errors.mean += ray / double(rays.size());
    return errors;
}

/// By algorithm, in the order of `by`.
std::vector<Errors> errors_of(const Body& body, double degrees,
                              const std::vector<std::string>& by) {
    const Data in = sampled(body);
    const std::vector<double> expected = turned_body(body, degrees);
    std::vector<Errors> errors;
    for (const std::string& algorithm : by)
        errors.push_back(errors_of(made(in, degrees, algorithm), expected));
    return errors;
}

// The sphere tells the algorithms apart; of the cube the edge is all the error. A ray through the
// cube can miss at most two edge voxels by all of 65535, which zero-order hold does. Tolerances are
// what the formulas themselves, evaluated with numpy, differ from the printed figures by.
TEST(Table22, Sphere) {
    const auto errors = errors_of(sphere, 45, {"zoh", "multipass", "foh"});
    EXPECT_NEAR(errors[0].mean, 3977, 0.01 * 3977);
    EXPECT_NEAR(errors[1].mean, 802, 0.01 * 802);
    EXPECT_NEAR(errors[2].mean, 259, 0.015 * 259);
}

TEST(Table22, Cube) {
    const auto errors = errors_of(cube, 45, {"zoh", "multipass", "foh"});
    EXPECT_NEAR(errors[0].mean, 48372, 0.005 * 48372);
    EXPECT_EQ(errors[0].max, 131070);
    EXPECT_NEAR(errors[1].mean, 65028, 0.005 * 65028);
    EXPECT_NEAR(errors[2].mean, 48309, 0.01 * 48309);
}

// Its caption says 45 degrees, its text the mean of 5 to 45; the text is right.
TEST(Table21, MeansOfFiveAngles) {
    const std::vector<std::string> by = {"zoh", "multipass", "foh"};
    const auto means = [&](const Body& body) {
        std::array<double, 3> sum{};
        for (const double degrees : {5, 15, 25, 35, 45}) {
            const auto errors = errors_of(body, degrees, by);
            for (std::size_t i = 0; i < 3; ++i) sum[i] += errors[i].mean / 5;
        }
        return sum;
    };
    const auto of_sphere = means(sphere), of_cube = means(cube);
    constexpr std::array<double, 3> kSphere = {4079, 775, 260}, kCube = {48370, 64068, 48385};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(of_sphere[i], kSphere[i], 0.015 * kSphere[i]) << by[i];
        EXPECT_NEAR(of_cube[i], kCube[i], 0.005 * kCube[i]) << by[i];
    }
}

}  // namespace
}  // namespace edgewise
