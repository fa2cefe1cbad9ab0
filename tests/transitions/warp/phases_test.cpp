// Warps by phases of spectra beside the trigonometric polynomial through the samples, summed
// directly in f64.
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

#include "transitions/warp/phase_shears.hpp"
#include "transitions/warp/phase_shift.hpp"
#include "transitions/warp/spectrum_resample.hpp"

namespace edgewise {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kOutside = -7;

struct PhaseCase {
    Request want;
    Scene scene;
    Data in;

    PhaseCase(const Extent& input, const Extent& screen, const Mat4& map,
              const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& value)
        : in(made(input, value)) {
        want.job = Job::warp;
        want.axes = in.what.axes;
        want.input = input;
        want.screen = screen;
        want.views = Placement(map);
        want.outside = kOutside;
    }
    static Data made(const Extent& input,
                     const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& value) {
        Representation what;
        what.extent = input;
        what.axes = input.z == 1 ? 2 : 3;
        Data data = Data::make(what, std::pmr::new_delete_resource());
        for (std::int64_t z = 0; z < input.z; ++z)
            for (std::int64_t y = 0; y < input.y; ++y)
                for (std::int64_t x = 0; x < input.x; ++x)
                    *data.at<float>(x, y, z) = static_cast<float>(value(x, y, z));
        return data;
    }
    Ask ask() const { return {want, scene}; }
    std::string refused(const Transition& edge) const {
        return edge.offer(in.what, ask(), {}).refused;
    }
    Data by(const Transition& edge) const {
        const Offer offer = edge.offer(in.what, ask(), {});
        EXPECT_EQ(offer.refused, "") << edge.name;
        Data out = Data::make(offer.to, std::pmr::new_delete_resource());
        Context context{.memory = std::pmr::new_delete_resource()};
        edge.run(offer, ask(), in, out, Region::all(offer.to.extent), context);
        return out;
    }
};

/// What sample 0 of n adds at a distance u, of frequencies that n and m samples can both hold.
double dirichlet(double u, std::int64_t n, std::int64_t m) {
    const std::int64_t least = std::min(n, m);
    double sum = 1;
    for (std::int64_t j = 1; 2 * j <= least; ++j)
        sum += (2 * j == least ? 1 : 2) * std::cos(2 * kPi * double(j) * u / double(n));
    return sum / double(n);
}

/// @param places  output samples in a period of each axis
double polynomial(const Data& in, const Vec3& q, const std::array<std::int64_t, 3>& places) {
    const Extent n = in.what.extent;
    double sum = 0;
    std::array<std::vector<double>, 3> weights;
    for (int axis = 0; axis < 3; ++axis)
        for (std::int64_t i = 0; i < n[axis]; ++i)
            weights[std::size_t(axis)].push_back(
                dirichlet(q[axis] - double(i), n[axis], places[std::size_t(axis)]));
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                sum += weights[0][std::size_t(x)] * weights[1][std::size_t(y)] *
                       weights[2][std::size_t(z)] * double(*in.at<float>(x, y, z));
    return sum;
}

void expect_polynomial(const PhaseCase& of, const Transition& edge,
                       const std::array<std::int64_t, 3>& places) {
    const Data out = of.by(edge);
    const Mat4 back = of.want.views.at(0).inverse().matrix();
    const Extent n = of.want.screen, in = of.want.input;
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const Vec3 q =
                    (back * Eigen::Vector4d(double(x), double(y), double(z), 1)).head<3>();
                bool inside = true, near = false;
                for (int axis = 0; axis < 3; ++axis) {
                    inside = inside && q[axis] >= -0.5 && q[axis] <= double(in[axis]) - 0.5;
                    near = near || std::abs(q[axis] + 0.5) < 1e-6 ||
                           std::abs(q[axis] - double(in[axis]) + 0.5) < 1e-6;
                }
                if (near) continue;
                // Values are up to 100; transforms of f32 are off by some 2^-24 log2 n of that, an
                // axis.
                ASSERT_NEAR(*out.at<float>(x, y, z),
                            inside ? polynomial(of.in, q, places) : kOutside, 2e-4)
                    << edge.name << " at " << x << ' ' << y << ' ' << z;
            }
}

std::function<double(std::int64_t, std::int64_t, std::int64_t)> noise(unsigned seed) {
    return [random = std::mt19937(seed)](auto, auto, auto) mutable {
        return double(random() % 2001) / 10 - 100;
    };
}

Mat4 moved(const Vec3& by) {
    Mat4 map = Mat4::Identity();
    map.topRightCorner<3, 1>() = by;
    return map;
}

TEST(Phases, ShiftsAreThePolynomial) {
    for (const Extent& n : {Extent{16, 9, 1}, Extent{1, 1, 1}, Extent{1, 6, 1}, Extent{2, 3, 1},
                            Extent{31, 22, 1}, Extent{7, 8, 5}, Extent{4, 6, 2}})
        for (const Vec3& by : {Vec3(0.3, -0.45, 0), Vec3(2.75, 1, 0), Vec3(-1e-4, 0.5, 0)}) {
            const Vec3 shift = n.z > 1 ? Vec3(by[0], by[1], 0.4) : by;
            const PhaseCase of(n, {n.x + 3, n.y + 1, n.z}, moved(shift), noise(2));
            expect_polynomial(of, phase_shift(), {n.x, n.y, n.z});
        }
}

TEST(Phases, WholeShiftsAreCopies) {
    const PhaseCase of({12, 9, 1}, {12, 9, 1}, moved({3, -2, 0}), noise(4));
    const Data out = of.by(phase_shift());
    for (std::int64_t y = 0; y < 9; ++y)
        for (std::int64_t x = 0; x < 12; ++x) {
            const bool inside = x >= 3 && y + 2 < 9;
            EXPECT_NEAR(*out.at<float>(x, y, 0),
                        inside ? *of.in.at<float>(x - 3, y + 2, 0) : kOutside, 2e-4);
        }
}

TEST(Phases, ResamplingIsThePolynomialOfTheCommonBand) {
    struct To {
        Extent n;
        std::array<std::int64_t, 3> places;
    };
    for (const To& to :
         {To{{16, 9, 1}, {24, 9, 1}}, To{{16, 9, 1}, {40, 27, 1}}, To{{16, 10, 1}, {8, 5, 1}},
          To{{15, 16, 1}, {7, 31, 1}}, To{{1, 5, 1}, {3, 10, 1}}, To{{6, 7, 4}, {9, 5, 8}}})
        for (const double shift : {0.0, 0.37}) {
            Mat4 map = moved(Vec3::Constant(shift));
            for (int axis = 0; axis < 3; ++axis)
                map(axis, axis) = double(to.places[std::size_t(axis)]) / double(to.n[axis]);
            if (to.n.z == 1) map(2, 3) = 0;
            const PhaseCase of(to.n, {to.places[0], to.places[1], to.places[2]}, map, noise(5));
            expect_polynomial(of, spectrum_resample(), to.places);
        }
}

/// Blobs that no grid of spacing 1 can tell from their samples, far from the faces.
double blobs(double x, double y) {
    const auto blob = [&](double cx, double cy, double wide, double top) {
        return top * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (2 * wide * wide));
    };
    return blob(30, 33, 2.5, 80) - blob(36, 27, 2, 60) + blob(31, 26, 3, 30);
}

Mat4 turned(double degrees, const Extent& n) {
    const Vec3 centre(double(n.x - 1) / 2, double(n.y - 1) / 2, 0);
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(degrees * kPi / 180, Vec3::UnitZ()).toRotationMatrix();
    map.topRightCorner<3, 1>() = centre - map.topLeftCorner<3, 3>() * centre;
    return map;
}

TEST(Phases, ShearsTurnWhatTheBandHolds) {
    const Extent n{65, 60, 1};
    for (const double degrees : {0.0, 1.0, 25.0, -45.0, 60.0, 117.0, 180.0}) {
        const PhaseCase of(n, n, turned(degrees, n),
                           [](auto x, auto y, auto) { return blobs(double(x), double(y)); });
        const Data out = of.by(phase_shears());
        const Mat4 back = of.want.views.at(0).inverse().matrix();
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const Vec3 q = (back * Eigen::Vector4d(double(x), double(y), 0, 1)).head<3>();
                if (q[0] < -0.4 || q[1] < -0.4 || q[0] > double(n.x) - 0.6 ||
                    q[1] > double(n.y) - 0.6)
                    continue;
                ASSERT_NEAR(*out.at<float>(x, y, 0), blobs(q[0], q[1]), 2e-4)
                    << degrees << " at " << x << ' ' << y;
                // The same by the polynomial through the samples alone.
                if ((x * 7 + y * 3) % 97 != 0) continue;
                ASSERT_NEAR(*out.at<float>(x, y, 0), polynomial(of.in, q, {n.x, n.y, 1}), 2e-4);
            }
    }
}

TEST(Phases, ATurnAndTheTurnBackAreTheImage) {
    const Extent n{65, 60, 1};
    for (const double degrees : {7.0, 33.0, 45.0, 100.0}) {
        PhaseCase there(n, n, turned(degrees, n),
                        [](auto x, auto y, auto) { return blobs(double(x), double(y)); });
        there.want.outside = 0;
        const Data once = there.by(phase_shears());
        PhaseCase back(n, n, turned(-degrees, n),
                       [&](auto x, auto y, auto) { return double(*once.at<float>(x, y, 0)); });
        back.want.outside = 0;
        const Data twice = back.by(phase_shears());
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                ASSERT_NEAR(*twice.at<float>(x, y, 0), *there.in.at<float>(x, y, 0), 4e-4)
                    << degrees << " at " << x << ' ' << y;
    }
}

TEST(Phases, BytesDoNotDependOnThreads) {
    const Extent n{70, 61, 1};
    Mat4 wider = Mat4::Identity();
    wider(0, 0) = 2;
    const std::pair<Transition, Mat4> cases[] = {{phase_shift(), moved({0.3, 0.4, 0})},
                                                 {spectrum_resample(), wider},
                                                 {phase_shears(), turned(31, n)}};
    for (const auto& [edge, map] : cases) {
        std::vector<Data> outs;
        for (const std::size_t threads : {1u, 4u}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            outs.push_back(PhaseCase(n, {140, 61, 1}, map, noise(3)).by(edge));
        }
        EXPECT_EQ(std::memcmp(outs[0].as<char>(), outs[1].as<char>(), outs[0].samples.bytes()), 0)
            << edge.name;
    }
}

TEST(Phases, EdgesRefuseWhatTheyCannotDo) {
    const Extent n{10, 12, 1};
    Mat4 by_parts = Mat4::Identity(), twice = Mat4::Identity(), mirrored = Mat4::Identity();
    by_parts(0, 0) = 1.23, twice(0, 0) = 2, mirrored(0, 0) = -1;
    const auto refused = [&](const Transition& edge, const Mat4& map,
                             const std::function<void(PhaseCase&)>& change = {}) {
        PhaseCase of(n, n, map, noise(1));
        if (change) change(of);
        return of.refused(edge);
    };
    EXPECT_EQ(refused(phase_shift(), moved({0.5, 0, 0})), "");
    EXPECT_NE(refused(phase_shift(), twice), "");
    EXPECT_NE(refused(phase_shift(), turned(20, n)), "");
    EXPECT_EQ(refused(spectrum_resample(), twice), "");
    EXPECT_NE(refused(spectrum_resample(), by_parts).find("12.3"), std::string::npos);
    EXPECT_NE(refused(spectrum_resample(), moved({0.5, 0, 0})), "");
    EXPECT_NE(refused(spectrum_resample(), mirrored), "");
    EXPECT_EQ(refused(phase_shears(), turned(20, n)), "");
    EXPECT_NE(refused(phase_shears(), twice), "");
    for (const Transition& edge : {phase_shift(), spectrum_resample(), phase_shears()}) {
        const Mat4 map = edge.name == spectrum_resample().name ? twice : moved({0.5, 0, 0});
        EXPECT_TRUE(edge.on_demand);
        EXPECT_EQ(refused(edge, map), "") << edge.name;
        EXPECT_NE(refused(edge, map, [](PhaseCase& of) { of.scene.non_finite = 1; }), "");
        EXPECT_NE(refused(edge, map, [](PhaseCase& of) { of.want.field = Field::nearest; }), "");
        EXPECT_NE(refused(edge, map, [](PhaseCase& of) { of.in.what.channels = 3; }), "");
    }
    Mat4 steep = Mat4::Identity();
    steep(0, 2) = 9;
    EXPECT_EQ(
        PhaseCase({6, 6, 6}, {6, 6, 6}, turned(20, {6, 6, 6}), noise(1)).refused(phase_shears()),
        "");
    EXPECT_NE(PhaseCase({6, 6, 6}, {6, 6, 6}, steep, noise(1)).refused(phase_shears()), "");
}

}  // namespace
}  // namespace edgewise
