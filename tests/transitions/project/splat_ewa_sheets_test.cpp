#include "transitions/project/splat_ewa_sheets.hpp"

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

#include "tests/transitions/project/looking.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;

constexpr double kPi = 3.14159265358979323846;

Parameters as(double sigma, double lowpass) { return {{"sigma", sigma}, {"lowpass", lowpass}}; }

/// What integrals of a lattice's kernels differ by from 1, at most: Poisson's sum, along two axes.
double ripple_of(double sigma) {
    return std::pow(1 + 2 * std::exp(-2 * kPi * kPi * sigma * sigma), 2) - 1;
}

/// A volume on a screen of so many pixels a unit, whose pixels are as wide as that says.
Request shown(const Extent& input, const Extent& screen, const Matrix3d& by, double zoom,
              double opacity, const Vec3& spacing = Vec3::Ones()) {
    Request want = seen(Mode::composite, input, screen, by, spacing, zoom);
    want.pixel = {1 / zoom, 1 / zoom};
    want.transfer.points = {{0, 0, {0.1, 0.2, 0.3}}, {1, opacity, {1, 0.5, 0}}};
    return want;
}

/// The same from an eye so far before the middle.
Request with_eye(Request want, double distance) {
    Eye eye;
    eye.plane = double(want.screen.z - 1) / 2;
    eye.at =
        Vec3(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2, eye.plane - distance);
    eye.width = want.pixel[0];
    eye.height = want.pixel[1];
    want.eye = eye;
    return want;
}

/// The edge as it is defined, voxel by voxel in f64.
class Sheets {
 public:
    Sheets(const Data& data, const Request& want, double sigma, double lowpass)
        : data_(data), want_(want), sigma_(sigma), lowpass_(lowpass) {
        map_ = want.views.at(0).matrix();
        back_ = map_.inverse();
        const Vec3 middle = direction(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2);
        for (const int axis : {1, 0})
            if (std::abs(middle[axis]) > std::abs(middle[along_])) along_ = axis;
        // By the distance of slices from the eye, on whichever side.
        double from = middle[along_] > 0 ? -1e9 : 1e9;
        if (want.eye)
            from =
                (back_.topLeftCorner<3, 3>() * want.eye->at + back_.topRightCorner<3, 1>())[along_];
        for (std::int64_t k = 0; k < data.what.extent[along_]; ++k) order_.push_back(k);
        std::sort(order_.begin(), order_.end(), [&](auto a, auto b) {
            return std::abs(double(a) - from) < std::abs(double(b) - from);
        });
    }

    std::array<double, 4> at(double px, double py) const {
        const Extent& n = data_.what.extent;
        std::array<double, 4> pixel{0, 0, 0, 1};
        // What all kernels add up to stands for the length inside.
        double all = 0;
        for (std::int64_t i = 0; i < n.samples(); ++i)
            all +=
                kernel(Vec3(double(i % n.x), double(i / n.x % n.y), double(i / n.x / n.y)), px, py);
        const double scale = length(px, py) * slanted(px, py) / all;
        for (const std::int64_t k : order_) {
            std::array<double, 4> sheet{};
            for (std::int64_t i = 0; i < n.samples() / n[along_]; ++i) {
                std::array<std::int64_t, 3> place{};
                const int one = along_ == 0 ? 1 : 0, other = along_ == 2 ? 1 : 2;
                place[std::size_t(one)] = i % n[one];
                place[std::size_t(other)] = i / n[one];
                place[std::size_t(along_)] = k;
                const auto [x, y, z] = place;
                const auto optics = want_.transfer.at(double(*data_.at<float>(x, y, z)));
                if (!(optics[3] > 0)) continue;
                const double depth = -std::log1p(-optics[3]) * scale *
                                     footprint(Vec3(double(x), double(y), double(z)), px, py);
                sheet[3] += depth;
                for (std::size_t c = 0; c < 3; ++c) sheet[c] += depth * optics[c];
            }
            if (!(sheet[3] > 0)) continue;
            const double kept = std::exp(-sheet[3]);
            for (std::size_t c = 0; c < 3; ++c)
                pixel[c] += pixel[3] * (1 - kept) * sheet[c] / sheet[3];
            pixel[3] *= kept;
        }
        pixel[3] = 1 - pixel[3];
        return pixel;
    }

    /// How far from a face a ray enters or leaves at, along the other axes [voxel].
    double inset(double px, double py) const {
        const Vec3 d = direction(px, py);
        const Vec3 o = start(px, py);
        double low = -1e300, high = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-0.5 - o[axis]) / d[axis];
            const double b = (double(want_.input[axis]) - 0.5 - o[axis]) / d[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
        if (!(low < high)) return -1;
        double least = 1e300;
        for (const double t : {low, high}) {
            const Vec3 p = o + t * d;
            std::array<double, 3> to{};
            for (int axis = 0; axis < 3; ++axis)
                to[std::size_t(axis)] =
                    std::min(p[axis] + 0.5, double(want_.input[axis]) - 0.5 - p[axis]);
            std::sort(to.begin(), to.end());
            least = std::min(least, to[1]);
        }
        return least;
    }

    /// Inside, in units.
    double length(double px, double py) const {
        const Vec3 d = direction(px, py), o = start(px, py);
        double low = want_.eye ? 0 : -1e300, high = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-0.5 - o[axis]) / d[axis];
            const double b = (double(want_.input[axis]) - 0.5 - o[axis]) / d[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
        return std::max(0.0, high - low);
    }

    int along() const { return along_; }

 private:
    /// Of a ray's length over its depth.
    double slanted(double px, double py) const {
        if (!want_.eye) return 1;
        const Eye& eye = *want_.eye;
        Vec3 way = Vec3(px, py, eye.plane) - eye.at;
        way = way.cwiseProduct(Vec3(eye.width, eye.height, 1));
        return way.norm() / std::abs(way.z());
    }
    /// The integral of a voxel's kernel along a ray; with parallel rays footprints are that.
    double kernel(const Vec3& voxel, double px, double py) const {
        if (!want_.eye) return footprint(voxel, px, py);
        const Vec3 d = direction(px, py), to = voxel - start(px, py);
        const double away = (to - d * (to.dot(d) / d.squaredNorm())).squaredNorm();
        return std::exp(-away / (2 * sigma_ * sigma_)) / (2 * kPi * sigma_ * sigma_ * d.norm());
    }
    /// Of a ray, for one unit.
    Vec3 direction(double px, double py) const {
        Vec3 way(0, 0, 1);
        if (want_.eye) {
            const Eye& eye = *want_.eye;
            way = Vec3(px, py, eye.plane) - eye.at;
            way /= way.cwiseProduct(Vec3(eye.width, eye.height, 1)).norm();
        }
        return back_.topLeftCorner<3, 3>() * way;
    }
    Vec3 start(double px, double py) const {
        const Vec3 from = want_.eye ? want_.eye->at : Vec3(px, py, 0);
        return back_.topLeftCorner<3, 3>() * from + back_.topRightCorner<3, 1>();
    }
    /// The integral over depth of a voxel's Gaussian, whose ellipse is that of the ray to its
    /// centre; cut at four deviations.
    double footprint(const Vec3& voxel, double px, double py) const {
        const Eigen::Matrix3d linear = map_.topLeftCorner<3, 3>();
        const Vec3 at = linear * voxel + map_.topRightCorner<3, 1>();
        Eigen::Vector2d middle = at.head<2>(), slope(0, 0);
        double larger = 1;
        if (want_.eye) {
            const Eye& eye = *want_.eye;
            const double depth = at.z() - eye.at.z(), plane = eye.plane - eye.at.z();
            larger = plane / depth;
            slope = (at.head<2>() - eye.at.head<2>()) / depth;
            middle = eye.at.head<2>() + slope * plane;
            for (int i = 0; i < 2; ++i)  // the picture's nearest ray
                slope[i] = std::clamp(slope[i], (-0.5 - eye.at[i]) / plane,
                                      (double(want_.screen[i]) - 0.5 - eye.at[i]) / plane);
        }
        const Eigen::Matrix<double, 2, 3> swept =
            sigma_ * larger * (linear.topRows<2>() - slope * linear.row(2));
        const Eigen::Matrix2d ellipse =
            swept * swept.transpose() + lowpass_ * lowpass_ * Eigen::Matrix2d::Identity();
        const Eigen::Vector2d away = Eigen::Vector2d(px, py) - middle;
        const double square = away.dot(ellipse.inverse() * away);
        if (square > 16) return 0;
        return std::abs(linear.determinant()) * larger * larger * std::exp(-square / 2) /
               (2 * kPi * (1 - std::exp(-8.0)) * std::sqrt(ellipse.determinant()));
    }

    const Data& data_;
    const Request& want_;
    double sigma_, lowpass_;
    Mat4 map_, back_;
    int along_ = 2;
    std::vector<std::int64_t> order_;
};

TEST(SplatEwaSheets, AreWhatIsDefinedVoxelByVoxel) {
    struct Case {
        Request want;
        double sigma, lowpass;
    };
    const Extent n{17, 15, 16}, tall{13, 13, 61}, screen{60, 56, 9};
    const std::vector<Case> cases = {
        {shown(n, screen, turn(37, {3, -2, 1}), 3, 0.7), 0.8, 0},
        {shown(n, screen, turn(163, {3, -2, 1}), 3, 0.7), 0.8, 0.6},
        {with_eye(shown(n, screen, Matrix3d::Identity(), 4, 0.7), 20), 0.8, 0},
        {with_eye(shown(n, screen, turn(70, {1, 0.1, 0}), 3, 0.7), 24), 0.8, 0},
        {with_eye(shown(n, screen, turn(-70, {0.1, 1, 0}), 3, 0.7), 24), 0.8, 0},
        {with_eye(shown(n, screen, turn(-110, {1, 2, 1}), 3, 0.7, {1, 1.3, 2.1}), 45), 0.8, 0},
        // The eye lies between the slices of the steepest axis.
        {with_eye(shown(tall, {40, 90, 9}, turn(44, {1, 0, 0}), 1.7, 0.7), 35), 0.8, 0},
    };
    for (const Case& of : cases) {
        const Request& want = of.want;
        std::mt19937 random(5);
        const Data in = volume(
            want.input, [&](auto...) { return random() % 5 ? 0.0 : double(random() % 64) / 63; });
        const Scene scene;
        const Sheets expected(in, want, of.sigma, of.lowpass);
        const Data got = made(splat_ewa_sheets(), in, {want, scene}, as(of.sigma, of.lowpass));
        double most = 0, squares = 0;
        int pixels = 0;
        for (std::int64_t y = 0; y < want.screen.y; y += 2)
            for (std::int64_t x = 0; x < want.screen.x; x += 2) {
                const double inset = expected.inset(double(x), double(y));
                // Wider where a pixel's own filter is added.
                if (inset < 4 * std::hypot(of.sigma, of.lowpass)) continue;
                const auto pixel = expected.at(double(x), double(y));
                for (std::size_t c = 0; c < 4; ++c) {
                    // What is behind 2^-12 is left out. Ripples are 2e-5 of a depth; at the cut,
                    // where f32 may decide otherwise, an ellipse has 1e-4 of a depth of at
                    // most 1.2.
                    const double error = got.at<float>(x, y, 0)[c] - pixel[c];
                    ASSERT_NEAR(error, 0, 5e-4) << x << " " << y;
                    squares += error * error;
                    most = std::max(most, pixel[c]);
                }
                ++pixels;
            }
        EXPECT_GT(pixels, 20);
        EXPECT_GT(most, 0.5);
        EXPECT_LT(std::sqrt(squares / (4 * pixels)), 1.5e-4);
    }
}

TEST(SplatEwaSheets, AConstantRipplesAsSaid) {
    const Extent n{30, 26, 28}, screen{80, 76, 9};
    const Data in = volume(n, [](auto...) { return 0.5; });
    const Scene scene;
    for (const Request& want : {with_eye(shown(n, screen, Matrix3d::Identity(), 2.3, 0.1), 40),
                                with_eye(shown(n, screen, turn(37, {3, -2, 1}), 1.8, 0.1), 45),
                                shown(n, screen, turn(37, {3, -2, 1}), 1.8, 0.1)})
        for (const double sigma : {0.6, 0.8}) {
            const Sheets rays(in, want, sigma, 0);
            const Data got = made(splat_ewa_sheets(), in, {want, scene}, as(sigma, 0));
            int pixels = 0;
            for (std::int64_t y = 0; y < screen.y; ++y)
                for (std::int64_t x = 0; x < screen.x; ++x) {
                    const double inset = rays.inset(double(x), double(y));
                    const float* pixel = got.at<float>(x, y, 0);
                    if (inset < 0) {
                        ASSERT_EQ(pixel[3], 0);
                        continue;
                    }
                    const double depth = -std::log1p(-0.05) * rays.length(double(x), double(y));
                    const double opacity = 1 - std::exp(-depth);
                    // Beside edges short rays are off by up to a quarter, see splat_ewa_test.cpp.
                    if (inset < 4 * sigma) {
                        ASSERT_NEAR(pixel[3], opacity, 0.25 * opacity + 0.01) << x << " " << y;
                        continue;
                    }
                    ++pixels;
                    // The ripple and what the cut leaves. From an eye ellipses change over a
                    // kernel in second order: along both axes, and the length of what lies there.
                    const double nearest = want.eye ? 40 - 24.5 : 1e9;  // half of the diagonal
                    const double off =
                        depth * (ripple_of(sigma) + 2 * 3.4e-4 + 3 * std::pow(sigma / nearest, 2));
                    ASSERT_NEAR(pixel[3], opacity, off * (1 - opacity) + 1e-5) << x << " " << y;
                    for (std::size_t c = 0; c < 2; ++c)  // one colour
                        ASSERT_NEAR(pixel[c], pixel[3] * (c == 0 ? 0.55 : 0.35), 1e-5);
                }
            EXPECT_GT(pixels, 300);
        }
}

TEST(SplatEwaSheets, ABallFromAnEyeIsAsThickAsItsChords) {
    const Extent n{41, 41, 41}, screen{90, 90, 9};
    constexpr double kRadius = 13;
    const Data in = volume(n, [](auto x, auto y, auto z) {
        const double r = std::hypot(double(x) - 20, double(y) - 20, double(z) - 20);
        return std::clamp(kRadius + 0.5 - r, 0.0, 1.0);
    });
    const Request want = with_eye(shown(n, screen, turn(37, {3, -2, 1}), 1.7, 0.05), 60);
    const Scene scene;
    const Data got = made(splat_ewa_sheets(), in, {want, scene}, as(0.6, 0));
    int pixels = 0;
    for (std::int64_t y = 0; y < screen.y; ++y)
        for (std::int64_t x = 0; x < screen.x; ++x) {
            // The ray's distance from the middle.
            const Vec3 way(double(x) - 44.5, double(y) - 44.5, 60 * 1.7);
            const double away = 60 * std::sin(std::atan2(way.head<2>().norm(), way.z()));
            if (away > 0.7 * kRadius) continue;
            ++pixels;
            const double half = std::sqrt(kRadius * kRadius - away * away);
            const double depth = -std::log1p(-0.05) * 2 * half;
            // The ripple. Blur takes off half of the kernel's variance times the chords' curvature
            // across, 2 R^2 / h^3 + 2 / h. A voxel's surface is a step of 1, whose place in a
            // lattice is known to a part of a voxel, at either end.
            const double blur = 0.18 * (2 * kRadius * kRadius / std::pow(half, 3) + 2 / half);
            const double off = depth * ripple_of(0.6) + 0.0513 * (blur + 0.15);
            ASSERT_NEAR(got.at<float>(x, y, 0)[3], 1 - std::exp(-depth),
                        off * std::exp(-depth) + 1e-4)
                << x << " " << y;
        }
    EXPECT_GT(pixels, 500);
}

TEST(SplatEwaSheets, TheSphereInFrontHidesTheOther) {
    const Extent n{33, 33, 33};
    const Scene scene;
    for (int axis = 0; axis < 3; ++axis)
        for (const double degrees : {0, 180})
            for (const bool eye : {false, true}) {
                const Data in = volume(n, [&](auto x, auto y, auto z) {
                    const Vec3 at = Vec3(double(x), double(y), double(z)) - Vec3::Constant(16);
                    if ((at + 8 * Vec3::Unit(axis)).norm() < 5) return 1.0;
                    return (at - 8 * Vec3::Unit(axis)).norm() < 5 ? 0.5 : 0.0;
                });
                const Vec3 about = axis == 0 ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
                Request want =
                    shown(n, {33, 33, 33}, turn(degrees + (axis == 2 ? 0 : 90), about), 1, 1);
                want.transfer.points = {
                    {0, 0, {}},          {0.4, 0, {1, 0, 0}}, {0.5, 0.9, {1, 0, 0}},
                    {0.6, 0, {1, 0, 0}}, {0.9, 0, {0, 1, 0}}, {1, 0.9, {0, 1, 0}}};
                const Vec3 way = want.views.at(0).matrix().inverse().topLeftCorner<3, 3>().col(2);
                if (eye) want = with_eye(want, 40);
                const bool green = way[axis] > 0;
                const Data got = made(splat_ewa_sheets(), in, {want, scene}, as(0.6, 0.6));
                const float* pixel = got.at<float>(16, 16, 0);
                // Ten voxels of transparency 0.1.
                EXPECT_GT(pixel[green ? 1 : 0], 0.999) << axis << degrees << eye;
                EXPECT_LT(pixel[green ? 0 : 1], 1e-3) << axis << degrees << eye;
            }
}

TEST(SplatEwaSheets, AreNearTheRayCasterWhereDataAreSmooth) {
    const Extent n{48, 44, 46}, screen{64, 64, 64};
    const Data in = volume(n, [](auto x, auto y, auto z) {
        double sum = 0;
        for (const auto& [cx, cy, cz, s] :
             {std::array<double, 4>{16, 18, 20, 5}, {30, 24, 22, 6}, {22, 28, 30, 4.5}})
            sum += std::exp(-(std::pow(double(x) - cx, 2) + std::pow(double(y) - cy, 2) +
                              std::pow(double(z) - cz, 2)) /
                            (2 * s * s));
        return std::min(1.0, sum);
    });
    for (const Request& want : {with_eye(shown(n, screen, turn(37, {3, -2, 1}), 1, 0.3), 70),
                                with_eye(shown(n, screen, turn(120, {0, 2, 1}), 1, 0.3), 120),
                                shown(n, screen, turn(37, {3, -2, 1}), 1, 0.3)}) {
        const Scene scene;
        const Data splats = made(splat_ewa_sheets(), in, {want, scene}, as(0.6, 0.6));
        const Data cast = made(ray_cast(), in, {want, scene}, {{"filter", "foh"}, {"step", 0.25}});
        double squares = 0, most = 0;
        const std::int64_t numbers = 4 * cast.what.samples();
        for (std::int64_t i = 0; i < numbers; ++i) {
            squares += std::pow(splats.as<float>()[i] - cast.as<float>()[i], 2);
            most = std::max<double>(most, cast.as<float>()[i]);
        }
        EXPECT_GT(most, 0.8);
        // A Gaussian of variance 0.36 + 0.36 against the cast's 1/6 blurs depths of curvature
        // 2 x 0.36 / 4.5^2 at most by 0.28 x 0.036 = 1 %; of a depth of 3 within the picture's
        // slopes that is 0.01.
        EXPECT_LT(std::sqrt(squares / double(numbers)), 0.01);
        RecordProperty("nrmse", std::to_string(std::sqrt(squares / double(numbers)) / most));
    }
}

TEST(SplatEwaSheets, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41}, screen{101, 133, 60};
    std::mt19937 random(7);
    const Data in = volume(n, [&](auto...) { return random() % 9 ? 0.0 : double(random() % 2); });
    const Request flat = shown(n, screen, turn(37, {3, -2, 1}), 1.8, 0.9);
    for (const Request& want : {flat, with_eye(flat, 60)}) {
        const Scene scene;
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(splat_ewa_sheets(), in, ask, as(0.6, 0.6));
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                     static_cast<std::size_t>(one.what.bytes())));
        for (const Region& box :
             {Region{{13, 21, 0}, {90, 110, 1}}, Region{{50, 66, 0}, {53, 67, 1}}}) {
            const Data part = made(splat_ewa_sheets(), in, ask, box, as(0.6, 0.6));
            for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                         one.at<float>(box.begin[0], y, 0),
                                         std::size_t(box.extent().x) * 4 * sizeof(float)));
        }
    }
}

TEST(SplatEwaSheets, ThinVolumesAndHolesStayFinite) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Extent& n :
         {Extent{1, 1, 1}, {1, 12, 12}, {12, 1, 12}, {12, 12, 1}, {2, 2, 2}, {30, 1, 1}})
        for (const bool eye : {false, true}) {
            const Data in = volume(
                n, [&](auto x, auto y, auto z) { return x + y + z == 3 ? double(nan) : 1.0; });
            Request want = shown(n, {37, 38, 37}, turn(33, {1, 2, 3}), 1, 1);
            if (eye) want = with_eye(want, 40);
            const Scene scene;
            const Data got = made(splat_ewa_sheets(), in, {want, scene}, as(0.6, 0.6));
            float most = 0;
            for (std::int64_t i = 0; i < 4 * got.what.samples(); ++i) {
                const float number = got.as<float>()[i];
                ASSERT_TRUE(number >= 0 && number <= 1.00001f) << number;
                most = std::max(most, number);
            }
            EXPECT_GT(most, 0.9) << n.x << n.y << n.z;
        }
}

TEST(SplatEwaSheets, RefusesWhatItCannotDo) {
    const Extent n{20, 21, 22};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto refused = [&](const Request& want) {
        return splat_ewa_sheets().offer(what, {want, scene}, as(0.6, 0.6)).refused;
    };
    const auto expect = [&](const Request& want, const std::string& reason) {
        const std::string said = refused(want);
        EXPECT_NE(said.find(reason), std::string::npos) << said;
    };
    const Request plain = shown(n, {40, 40, 40}, turn(20, {1, 2, 3}), 1, 0.1);
    EXPECT_EQ(refused(plain), "");
    EXPECT_EQ(refused(with_eye(plain, 60)), "");
    for (const Mode mode : modes()) {
        Request want = plain;
        want.mode = mode;
        EXPECT_EQ(refused(want).empty(), mode->takes_transfer) << mode->name;
    }
    expect(with_eye(plain, 20), "spacings before the nearest samples");
    expect(with_eye(plain, 1), "beside the eye or behind it");
    Request want = plain;
    want.clips.resize(1);
    expect(want, "clip");
    want = plain;
    want.shading.by = Shade::phong;
    expect(want, "light");
    want = plain;
    want.cue = DepthCue{};
    expect(want, "light falls off");
    want = plain;
    want.field = Field::nearest;
    expect(want, "labels");
    scene.non_finite = 17;
    expect(plain, "17 samples are not finite");
}

}  // namespace
}  // namespace edgewise
