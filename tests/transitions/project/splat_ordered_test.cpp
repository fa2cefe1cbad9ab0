#include "transitions/project/splat_ordered.hpp"

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
#include "transitions/project/splat.hpp"
#include "transitions/project/splat_sheets.hpp"

namespace edgewise {
namespace {

using namespace looking;

const std::vector<std::string> kOrders = {"sheet", "sample"};

Parameters in_order(const std::string& order) { return {{"order", order}}; }

/// Opacity and all colours change with the value.
Request colored(const Extent& input, const Extent& screen, const Matrix3d& by,
                const Vec3& spacing = Vec3::Ones(), double zoom = 1, double opacity = 0.1) {
    Request want = seen(Mode::composite, input, screen, by, spacing, zoom);
    want.transfer.points = {{0, 0, {0.1, 0.2, 0.3}}, {1, opacity, {1, 0.5, 0}}};
    return want;
}

/// Of one axis: the kernel of voxel i of n at a distance, a triangle that goes on to the faces.
double kernel(std::int64_t i, std::int64_t n, double x) {
    constexpr double kRounding = 1e-9;
    if (i == 0 && x <= 0) return x >= -0.5 - kRounding;
    if (i == n - 1 && x >= 0) return x <= 0.5 + kRounding;
    return std::max(0.0, 1 - std::abs(x));
}

/// Both orders as they are defined, voxel by voxel in f64.
class InOrder {
 public:
    /// @param cells  of a voxel, that places of footprints are rounded to; 0: none
    InOrder(const Data& data, const Request& want, double cells)
        : data_(data), want_(want), cells_(cells) {
        back_ = want.views.at(0).matrix().inverse();
        direction_ = back_.topLeftCorner<3, 3>().col(2);
        for (const int axis : {1, 0})
            if (std::abs(direction_[axis]) > std::abs(direction_[along_])) along_ = axis;
        across_ = {along_ == 0 ? 1 : 0, along_ == 2 ? 1 : 2};
    }

    std::array<double, 4> at(double px, double py, bool sheets) const {
        const Vec3 origin = (back_ * Eigen::Vector4d(px, py, 0, 1)).head<3>();
        const Extent& n = data_.what.extent;
        std::array<double, 4> pixel{0, 0, 0, 1};
        Eigen::Matrix<std::int64_t, 3, 1> at;
        for (std::int64_t i = 0; i < n[along_]; ++i) {
            at[along_] = direction_[along_] < 0 ? n[along_] - 1 - i : i;
            std::array<double, 4> sheet{};
            for (std::int64_t j = 0; j < n[across_[1]]; ++j) {
                at[across_[1]] = direction_[across_[1]] < 0 ? n[across_[1]] - 1 - j : j;
                for (std::int64_t k = 0; k < n[across_[0]]; ++k) {
                    at[across_[0]] = direction_[across_[0]] < 0 ? n[across_[0]] - 1 - k : k;
                    const double w = weight(origin, at);
                    if (w == 0) continue;
                    const auto optics =
                        want_.transfer.at(double(*data_.at<float>(at[0], at[1], at[2])));
                    const double depth = -w * std::log1p(-optics[3]);
                    sheet[3] += depth;
                    for (std::size_t c = 0; c < 3; ++c) sheet[c] += depth * optics[c];
                    if (!sheets) add(sheet, pixel);
                }
            }
            if (sheets) add(sheet, pixel);
        }
        pixel[3] = 1 - pixel[3];
        return pixel;
    }

 private:
    static void add(std::array<double, 4>& sums, std::array<double, 4>& pixel) {
        if (sums[3] > 0) {
            const double kept = std::exp(-sums[3]);
            for (std::size_t c = 0; c < 3; ++c)
                pixel[c] += pixel[3] * (1 - kept) * sums[c] / sums[3];
            pixel[3] *= kept;
        }
        sums = {};
    }

    /// The integral of a voxel's kernel along a ray [t], over the slices that it touches.
    double weight(const Vec3& origin, const Eigen::Matrix<std::int64_t, 3, 1>& at) const {
        const Extent& n = data_.what.extent;
        std::array<double, 2> place, slope;
        for (std::size_t i = 0; i < 2; ++i) {
            const int axis = across_[i];
            slope[i] = direction_[axis] / direction_[along_];
            place[i] =
                origin[axis] + slope[i] * (double(at[along_]) - origin[along_]) - double(at[axis]);
            if (std::abs(place[i]) > 2.1) return 0;
            // The middle of a table lies at 0, and half a cell goes to the cell above.
            if (cells_ > 0) place[i] = std::floor(place[i] * cells_ + 0.5) / cells_;
        }
        const auto product = [&](double t) {
            return kernel(at[along_], n[along_], t) *
                   kernel(at[across_[0]], n[across_[0]], place[0] + slope[0] * t) *
                   kernel(at[across_[1]], n[across_[1]], place[1] + slope[1] * t);
        };
        double sum = 0;
        if (cells_ > 0) {  // sections of a sixteenth, as the tables have
            for (int s = 0; s < 32; ++s) sum += product((s + 0.5) / 16 - 1) / 16;
        } else {
            // Between kinks a cubic, of which Gauss's rule of two points is the integral.
            std::vector<double> kinks = {-1, -0.5, 0, 0.5, 1};
            for (std::size_t i = 0; i < 2; ++i)
                for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0})
                    if (std::abs(slope[i]) > 1e-9)
                        kinks.push_back(std::clamp((x - place[i]) / slope[i], -1.0, 1.0));
            std::sort(kinks.begin(), kinks.end());
            for (std::size_t i = 1; i < kinks.size(); ++i) {
                const double half = (kinks[i] - kinks[i - 1]) / 2, middle = kinks[i] - half;
                const double off = half / std::sqrt(3.0);
                sum += half * (product(middle - off) + product(middle + off));
            }
        }
        return sum / std::abs(direction_[along_]);
    }

    const Data& data_;
    const Request& want_;
    double cells_;
    Mat4 back_;
    Vec3 direction_;
    int along_ = 2;
    std::array<int, 2> across_{};
};

struct Scenery {
    Extent input, screen;
    Matrix3d by;
    Vec3 spacing = Vec3::Ones();
    double zoom = 1;
};

/// Each axis is the steepest one, in both directions.
std::vector<Scenery> sceneries() {
    const Extent n{11, 9, 13}, screen{24, 22, 24};
    return {
        {n, screen, Matrix3d::Identity()},
        {n, screen, turn(37, {3, -2, 1})},
        {n, screen, turn(75, {0.1, 1, 0})},
        {n, screen, turn(-71, {0.1, 1, 0.2})},
        {n, screen, turn(80, {1, 0.2, 0})},
        {n, screen, turn(-103, {1, 0.2, 0})},
        {n, screen, turn(165, {0, 3, 1})},
        {{11, 9, 6}, {30, 30, 30}, turn(130, {1, 2, 3}), {1, 1.3, 3.1}},
        {{7, 6, 5}, {36, 30, 20}, turn(-50, {1, 0, 2}), {1, 1, 1}, 4.7},
        {{24, 20, 22}, {12, 11, 30}, turn(25, {1, 1, 0}), {1, 1, 1}, 0.31},
    };
}

TEST(SplatOrdered, IsWhatIsDefinedVoxelByVoxel) {
    std::mt19937 random(11);
    for (const Scenery& of : sceneries()) {
        const Data in = volume(
            of.input, [&](auto...) { return random() % 3 ? 0.0 : double(random() % 64) / 63; });
        const Request want = colored(of.input, of.screen, of.by, of.spacing, of.zoom, 0.7);
        const Scene scene;
        const InOrder expected(in, want, 32);
        for (const std::string& order : kOrders) {
            const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
            int numbers = 0, exact = 0;
            double most = 0;
            for (std::int64_t y = 0; y < of.screen.y; ++y)
                for (std::int64_t x = 0; x < of.screen.x; ++x) {
                    const auto pixel = expected.at(double(x), double(y), order == "sheet");
                    for (std::size_t c = 0; c < 4; ++c) {
                        const double error = std::abs(got.at<float>(x, y, 0)[c] - pixel[c]);
                        // Where a place lies at the border of two cells, fixed point may take the
                        // other: weights of a slice are off by at most a cell of 1/32, a depth
                        // then by 1/32 of 1.2 times the length of ray in a slice, of at most 3.1.
                        ASSERT_LT(error, 1.2 * 3.1 / 32) << order << " " << x << " " << y;
                        ++numbers;
                        // f32, of some hundred sums and products; what is behind 2^-12 is left out.
                        exact += error < 1.0 / 4096 + 3e-5;
                        most = std::max(most, pixel[c]);
                    }
                }
            EXPECT_GT(exact, 0.98 * numbers) << order;
            EXPECT_GT(most, 0.5);
        }
    }
}

TEST(SplatOrdered, FootprintsAreIntegralsOfTheTrilinearKernel) {
    for (const Scenery& of : sceneries()) {
        const Data in = volume(of.input, wave);
        const Request want = colored(of.input, of.screen, of.by, of.spacing, of.zoom);
        const Scene scene;
        const InOrder expected(in, want, 0);
        for (const std::string& order : kOrders) {
            const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
            double squares = 0;
            for (std::int64_t y = 0; y < of.screen.y; ++y)
                for (std::int64_t x = 0; x < of.screen.x; ++x) {
                    const auto pixel = expected.at(double(x), double(y), order == "sheet");
                    for (std::size_t c = 0; c < 4; ++c) {
                        const double error = got.at<float>(x, y, 0)[c] - pixel[c];
                        // Half a cell of 1/32, a slice at a time: a face that rays graze is off by
                        // that share of its length, of depths of at most 0.105 a unit. Up to three
                        // units are in a slice, and four slices are passed along a face.
                        ASSERT_NEAR(error, 0, 0.05) << order << " " << x << " " << y;
                        squares += error * error;
                    }
                }
            // Inside, depths of neighbours differ by at most 0.111 x 0.17: off by up to half a cell
            // along two axes, of 13 slices that is 13 x 0.019 / 32 = 0.0077 at worst, and a third
            // of it where errors of slices differ.
            EXPECT_LT(std::sqrt(squares / double(4 * of.screen.x * of.screen.y)), 0.0026) << order;
        }
    }
}

TEST(SplatOrdered, AConstantHasNoRipple) {
    const Extent slab{61, 57, 9}, screen{31, 27, 90};
    const Data in = volume(slab, [](auto...) { return 0.7; });
    const Scene scene;
    for (const Matrix3d& by : {Matrix3d(Matrix3d::Identity()), turn(17.3, {0, 0, 1}),
                               turn(25, {1, 0, 0}), turn(160, {1, 2, 0})})
        for (const double zoom : {0.5, 1.0, 2.3}) {
            const Request want = colored(slab, screen, by, Vec3(1, 1, 1.7), zoom);
            for (const std::string& order : kOrders) {
                const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
                const Mat4 back = want.views.at(0).matrix().inverse();
                const Vec3 d = back.topLeftCorner<3, 3>().col(2);
                int rays = 0;
                for (std::int64_t y = 0; y < screen.y; ++y)
                    for (std::int64_t x = 0; x < screen.x; ++x) {
                        const Vec3 o =
                            (back * Eigen::Vector4d(double(x), double(y), 0, 1)).head<3>();
                        bool through = true;
                        for (const double z : {-0.5, 8.5}) {
                            const Vec3 at = o + (z - o.z()) / d.z() * d;
                            through = through && std::abs(at.x() - 30) < 30.4 - 1.1 &&
                                      std::abs(at.y() - 28) < 28.4 - 1.1;
                        }
                        if (!through) continue;
                        ++rays;
                        // EQ 63. f32 rounds 6e-8 some 9 x 16 times.
                        const double opacity = 1 - std::pow(1 - 0.07, 9 / std::abs(d.z()));
                        ASSERT_NEAR(got.at<float>(x, y, 0)[3], opacity, 2e-5)
                            << order << " " << x << " " << y;
                        // One colour: nothing that is blended changes it.
                        ASSERT_NEAR(got.at<float>(x, y, 0)[0], opacity * (0.1 + 0.9 * 0.7), 3e-5);
                    }
                EXPECT_GT(rays, 20);
            }
        }
}

TEST(SplatOrdered, WhatIsInFrontHides) {
    // Two voxels, one behind the other along each axis.
    const Extent n{9, 9, 9};
    const Scene scene;
    for (int axis = 0; axis < 3; ++axis) {
        const Data in = volume(n, [&](auto x, auto y, auto z) {
            const std::int64_t at[3] = {x, y, z};
            for (int other = 0; other < 3; ++other)
                if (other != axis && at[other] != 4) return 0.0;
            return at[axis] == 3 ? 1.0 : at[axis] == 6 ? 0.5 : 0.0;
        });
        for (const double degrees : {0, 180}) {
            const Vec3 about = axis == 0 ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
            const Matrix3d by = turn(degrees + (axis == 2 ? 0 : 90), about);
            Request want = colored(n, {17, 17, 17}, by);
            want.transfer.points = {{0, 0, {}},          {0.1, 0, {1, 0, 0}}, {0.5, 0.6, {1, 0, 0}},
                                    {0.6, 0, {1, 0, 0}}, {0.7, 0, {0, 1, 0}}, {1, 0.8, {0, 1, 0}}};
            // The first is green, the other red; which is in front says the way of rays.
            const Vec3 way = want.views.at(0).matrix().inverse().topLeftCorner<3, 3>().col(2);
            const bool green = way[axis] > 0;
            for (const std::string& order : kOrders) {
                const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
                const float* pixel = got.at<float>(8, 8, 0);
                EXPECT_NEAR(pixel[1], green ? 0.8 : 0.4 * 0.8, 1e-5) << axis << order;
                EXPECT_NEAR(pixel[0], green ? 0.2 * 0.6 : 0.6, 1e-5) << axis << order;
                EXPECT_NEAR(pixel[3], 1 - 0.2 * 0.4, 1e-5);
            }
        }
    }
}

TEST(SplatOrdered, WhatIsOpaqueShowsItsColourAlone) {
    const Extent n{9, 8, 7};
    const Data in = volume(n, [](auto, auto, auto z) { return z == 2 ? 1.0 : 0.5; });
    const Scene scene{.commonest = 0.5};
    Request want = colored(n, {9, 8, 20}, turn(0, {0, 0, 1}));
    want.transfer.points = {{0, 0.1, {1, 0, 0}}, {0.9, 0.1, {1, 0, 0}}, {1, 1, {0, 1, 0}}};
    for (const std::string& order : kOrders) {
        const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
        for (std::int64_t i = 0; i < 72; ++i) {
            const float* pixel = got.as<float>() + 4 * i;
            EXPECT_NEAR(pixel[3], 1, 1e-6) << order;
            EXPECT_NEAR(pixel[0], 1 - 0.81, 1e-5);  // two slices before it
            EXPECT_NEAR(pixel[1], 0.81, 1e-5);
        }
    }
}

double apart(const Data& one, const Data& other) {
    double squares = 0;
    const std::int64_t numbers = 4 * one.what.samples();
    for (std::int64_t i = 0; i < numbers; ++i)
        squares += std::pow(double(one.as<float>()[i]) - double(other.as<float>()[i]), 2);
    return std::sqrt(squares / double(numbers));
}

TEST(SplatOrdered, PopsWhereTheSteepestAxisChanges) {
    // Sheets then lie along other faces, and other voxels hide others. Sheets on the screen change
    // by no more than the cells of their tables.
    const Extent n{24, 24, 24};
    const Data in =
        volume(n, [](auto x, auto y, auto z) { return (x / 3 + y / 3 + z / 3) % 2 ? 0.5 : 1.0; });
    const Scene scene;
    const auto at = [&](const Transition& edge, const Parameters& with, double degrees) {
        Request want = seen(Mode::composite, n, {40, 40, 48}, turn(degrees, {0, 1, 0}));
        want.transfer.points = {{0, 0, {0, 0, 1}}, {0.5, 0.9, {0, 0, 1}}, {1, 0.9, {1, 0, 0}}};
        return made(edge, in, {want, scene}, with);
    };
    const auto popped = [&](const Transition& edge, const Parameters& with, double degrees) {
        return apart(at(edge, with, degrees - 0.0005), at(edge, with, degrees + 0.0005));
    };
    const double on_screen = popped(splat_sheets(), {{"slab", 1.0}}, 45);
    const double sheets = popped(splat_ordered(), in_order("sheet"), 45);
    const double samples = popped(splat_ordered(), in_order("sample"), 45);
    EXPECT_GT(sheets, 10 * on_screen);
    EXPECT_GT(sheets, 5 * samples);
    EXPECT_GT(samples, on_screen);
    // Elsewhere a thousandth of a degree is hardly seen.
    for (const std::string& order : kOrders)
        EXPECT_LT(popped(splat_ordered(), in_order(order), 44), samples / 50) << order;
}

TEST(SplatOrdered, ThinMediaAreSeenAsTheirIntegral) {
    constexpr double kThin = 1e-3;
    for (const Scenery& of : sceneries()) {
        const Data in = volume(of.input, wave);
        const Request want = colored(of.input, of.screen, of.by, of.spacing, of.zoom, kThin);
        Request sums = want;
        sums.mode = Mode::xray;
        const Scene scene;
        const Data xray = made(splat(), in, {sums, scene});
        for (const std::string& order : kOrders) {
            const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
            for (std::int64_t i = 0; i < xray.what.samples(); ++i) {
                const double all = double(xray.as<float>()[i]);
                const double depth = -std::log1p(-double(got.as<float>()[4 * i + 3]));
                // -log(1 - a) is a (1 + a / 2 + ...), and f32 has steps of 6e-8 below 1, of which
                // some 60 products may each lose a half.
                ASSERT_NEAR(depth / kThin, all, 0.51 * kThin * all + 2e-3) << order << i;
            }
        }
    }
}

TEST(SplatOrdered, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41}, screen{101, 133, 60};
    std::mt19937 random(7);
    const Data in = volume(n, [&](auto...) { return random() % 9 ? 0.0 : double(random() % 2); });
    for (const std::string& order : kOrders)
        for (const double zoom : {0.9, 1.8}) {
            const Request want = colored(n, screen, turn(37, {3, -2, 1}), {1, 1, 1}, zoom, 0.9);
            const Scene scene;
            const Ask ask{want, scene};
            const auto with = [&](std::size_t threads) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                return made(splat_ordered(), in, ask, in_order(order));
            };
            const Data one = with(1);
            for (const std::size_t threads : {2u, 7u})
                EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                         static_cast<std::size_t>(one.what.bytes())));
            for (const Region& box :
                 {Region{{13, 21, 0}, {90, 110, 1}}, Region{{50, 66, 0}, {53, 67, 1}}}) {
                const Data part = made(splat_ordered(), in, ask, box, in_order(order));
                for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                    ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                             one.at<float>(box.begin[0], y, 0),
                                             std::size_t(box.extent().x) * 4 * sizeof(float)));
            }
        }
}

TEST(SplatOrdered, ThinVolumesAreThoseOfTheField) {
    for (const Extent& n :
         {Extent{1, 1, 1}, {1, 12, 12}, {12, 1, 12}, {12, 12, 1}, {2, 2, 2}, {30, 1, 1}}) {
        const Data in = volume(n, [](auto...) { return 1; });
        const Request want = colored(n, {37, 38, 37}, turn(33, {1, 2, 3}), Vec3::Ones(), 1, 0.5);
        const Scene scene;
        const InOrder expected(in, want, 0);
        for (const std::string& order : kOrders) {
            const Data got = made(splat_ordered(), in, {want, scene}, in_order(order));
            double squares = 0, most = 0;
            for (std::int64_t y = 0; y < 38; ++y)
                for (std::int64_t x = 0; x < 37; ++x) {
                    const double opacity = expected.at(double(x), double(y), order == "sheet")[3];
                    squares += std::pow(got.at<float>(x, y, 0)[3] - opacity, 2);
                    most = std::max(most, opacity);
                }
            // A box is seen a cell too wide or too narrow, of footprints two voxels wide.
            EXPECT_LT(std::sqrt(squares / (37 * 38)), 0.03 * most) << n.x << " " << n.y << n.z;
            EXPECT_GT(most, 0.2);
        }
    }
}

TEST(SplatOrdered, SamplesThatAreNotFiniteAreNotSeen) {
    const Extent n{9, 9, 9};
    const float holes[3] = {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()};
    const auto with = [&](bool empty) {
        return volume(n, [&](auto x, auto y, auto z) {
            if ((x + y + z) % 5 == 0) return empty ? 0.0 : double(holes[(x + y) % 3]);
            return 0.25 + 0.5 * double(x % 2);
        });
    };
    const Request want = colored(n, {19, 19, 19}, turn(37, {3, -2, 1}));
    const Scene scene;
    for (const std::string& order : kOrders) {
        const Data holed = made(splat_ordered(), with(false), {want, scene}, in_order(order));
        const Data clear = made(splat_ordered(), with(true), {want, scene}, in_order(order));
        EXPECT_EQ(0, std::memcmp(holed.samples.data(), clear.samples.data(),
                                 static_cast<std::size_t>(clear.what.bytes())));
    }
}

TEST(SplatOrdered, CountsThePixelsOfFootprints) {
    const Extent n{64, 64, 64};
    Representation what;
    what.extent = n;
    Request want = colored(n, {112, 112, 112}, turn(37, {3, -2, 1}));
    Scene scene;
    scene.occupied_fraction = 0.02;
    const auto work = [&](const char* order) {
        const Ask ask{want, scene};
        return splat_ordered().work(splat_ordered().offer(what, ask, in_order(order)), ask, 0);
    };
    // A footprint has some nine to thirty pixels, of five numbers each.
    const double voxels = 0.02 * 64 * 64 * 64;
    EXPECT_GT(work("sample").gathers, voxels * 9 * 5);
    EXPECT_LT(work("sample").gathers, voxels * 40 * 5 * 1.3);
    EXPECT_EQ(work("sample").gathers, work("sheet").gathers);
    // Where what is commonest can be seen, all of it is splatted.
    want.transfer.points[0].opacity = 0.01;
    EXPECT_GT(work("sample").gathers, 0.9 * 50 * voxels * 9 * 5);
}

TEST(SplatOrdered, RefusesWhatItCannotDo) {
    const Extent n{20, 21, 22};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto expect = [&](const Request& want, const std::string& reason) {
        for (const std::string& order : kOrders) {
            const std::string said =
                splat_ordered().offer(what, {want, scene}, in_order(order)).refused;
            EXPECT_NE(said.find(reason), std::string::npos) << said;
        }
    };
    const Request plain = colored(n, {40, 40, 40}, turn(20, {1, 2, 3}));
    EXPECT_EQ(splat_ordered().offer(what, {plain, scene}, in_order("sheet")).refused, "");
    for (const Mode mode : modes()) {
        Request want = plain;
        want.mode = mode;
        const std::string said =
            splat_ordered().offer(what, {want, scene}, in_order("sample")).refused;
        EXPECT_EQ(said.empty(), mode->takes_transfer) << mode->name;
    }
    Request want = plain;
    want.mode = Mode::mip;
    expect(want, "transfer function");
    want = plain;
    want.eye = Eye{};
    expect(want, "eye");
    want = plain;
    want.clips.resize(1);
    expect(want, "clip");
    want = plain;
    want.shading.by = Shade::phong;
    expect(want, "light");
    want = plain;
    want.cue = DepthCue{};
    expect(want, "light falls off");
    want = plain;
    want.transfer.edges = {{0, 0}, {1, 1}};
    expect(want, "gradients");
    want = plain;
    want.field = Field::nearest;
    expect(want, "labels");
    expect(colored(n, {900, 900, 900}, turn(20, {1, 2, 3}), Vec3::Ones(), 40), "pixels wide");
    scene.non_finite = 17;
    expect(plain, "17 samples are not finite");
}

}  // namespace
}  // namespace edgewise
