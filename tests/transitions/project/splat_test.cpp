#include "transitions/project/splat.hpp"

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
#include "transitions/kernels/splat.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;
using Eigen::Matrix3d;

/// The part of a ray of pixel (px, py) inside a box that reaches half a voxel beyond the samples,
/// cut where it crosses planes of samples.
struct Ray {
    Vec3 origin, direction;
    std::vector<double> cuts;  // [t], ascending; none: a miss

    Ray(const Request& want, double px, double py) {
        const Mat4 back = want.views.at(0).matrix().inverse();
        origin = (back * Eigen::Vector4d(px, py, 0, 1)).head<3>();
        direction = back.topLeftCorner<3, 3>().col(2);
        double low = -1e300, high = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const double first = -0.5, last = double(want.input[axis]) - 0.5;
            if (std::abs(direction[axis]) < 1e-12) {
                if (origin[axis] < first || origin[axis] > last) return;
                continue;
            }
            const double a = (first - origin[axis]) / direction[axis];
            const double b = (last - origin[axis]) / direction[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
        if (low >= high) return;
        cuts = {low, high};
        for (int axis = 0; axis < 3; ++axis)
            for (std::int64_t i = 0; i < want.input[axis]; ++i) {
                const double t = (double(i) - origin[axis]) / direction[axis];
                if (low < t && t < high) cuts.push_back(t);
            }
        std::sort(cuts.begin(), cuts.end());
    }
    double length() const { return cuts.empty() ? 0 : cuts.back() - cuts.front(); }
};

/// The integral along a ray [value t]: between cuts the field is a cubic in t, for which two points
/// are exact (Gauss, Legendre).
double integral(const Data& data, const Ray& ray) {
    double sum = 0;
    for (std::size_t i = 1; i < ray.cuts.size(); ++i) {
        const double half = (ray.cuts[i] - ray.cuts[i - 1]) / 2;
        const double middle = ray.cuts[i - 1] + half;
        for (const double side : {-1, 1})
            sum += half * trilinear(data, ray.origin + (middle + side * half / std::sqrt(3.0)) *
                                                           ray.direction);
    }
    return sum;
}

struct View {
    Extent input, screen;
    Matrix3d by;
    Vec3 spacing = Vec3::Ones();
    double zoom = 1;
};

std::vector<View> views() {
    return {
        {{21, 17, 26}, {45, 41, 45}, Matrix3d::Identity()},
        {{21, 17, 26}, {45, 41, 45}, turn(37, {3, -2, 1})},
        {{21, 17, 27}, {45, 41, 45}, turn(90, {1, 0, 0})},
        {{21, 17, 26}, {45, 41, 45}, turn(75, {0, 1, 0})},                   // rays are along x
        {{21, 17, 26}, {45, 41, 45}, turn(45, {0, 1, 0})},                   // between two axes
        {{21, 17, 26}, {45, 41, 45}, turn(30, {0, 0, 1})},                   // kernels have edges
        {{21, 17, 12}, {60, 60, 60}, turn(130, {1, 2, 3}), {1, 1.3, 3.1}},   // anisotropic
        {{40, 40, 40}, {19, 17, 70}, turn(25, {1, 1, 0}), {1, 1, 1}, 0.21},  // smaller than pixels
        {{12, 9, 10}, {90, 70, 20}, turn(-50, {1, 0, 2}), {1, 1, 1}, 4.7},   // much larger
        {{20, 20, 20},
         {30, 30, 30},
         turn(20, {1, 2, 0}) * Vec3(-1, 1, 1).asDiagonal()},  // mirrored
    };
}

/// Voxels of the axis that a ray is steepest to, along the whole of it, and the length of one.
struct Slices {
    double count, length;

    explicit Slices(const Ray& ray) {
        const double steepest = ray.direction.lpNorm<Eigen::Infinity>();
        length = 1 / steepest;
        count = ray.length() * steepest;
    }
};

TEST(Splat, IntegralsAreThoseOfTheTrilinearField) {
    for (const View& view : views()) {
        const Data in = volume(view.input, wave);
        Request want = seen(Mode::xray, view.input, view.screen, view.by, view.spacing, view.zoom);
        want.unit = 0.8;
        want.zero = 0.25;
        const Scene scene{.commonest = 0.5};
        const Data got = made(splat(), in, {want, scene});
        double squares = 0, most = 0;
        for (std::int64_t y = 0; y < view.screen.y; ++y)
            for (std::int64_t x = 0; x < view.screen.x; ++x) {
                const Ray ray(want, double(x), double(y));
                const double expected = 0.8 * (integral(in, ray) - want.zero * ray.length());
                const double error = double(*got.at<float>(x, y, 0)) - expected;
                // Half a cell along two axes, where the field has those slopes; and at either end
                // of the ray values of at most 0.5 more or less than what is empty, as far as a
                // face is moved to: rays here are no flatter than 1 in 8 to faces that they cross.
                const Slices slices(ray);
                const double moved = 0.5 / kernels::Footprints::Shape{}.cells;
                ASSERT_NEAR(error, 0,
                            0.8 * slices.length *
                                (moved * 0.27 * slices.count + 2 * 0.5 * (8 * moved + 1.0 / 16)))
                    << x << " " << y;
                squares += error * error;
                most = std::max(most, std::abs(expected));
            }
        // Most is half of what a ray has; slopes are half as large on average, and no two slices
        // are moved alike.
        EXPECT_LT(std::sqrt(squares / double(want.output().samples())), 2e-3 * most);
    }
}

TEST(Splat, AConstantHasNoRipple) {
    const Extent slab{61, 57, 9};
    const Data in = volume(slab, [](auto...) { return 1; });
    const Scene scene;  // zeros are empty: all of this is added
    for (const Matrix3d& by :
         {Matrix3d(Matrix3d::Identity()), turn(30, {0, 0, 1}), turn(17.3, {0, 0, 1}),
          turn(25, {1, 0, 0}), turn(20, {1, 2, 0}), turn(180, {1, 0, 0}), turn(5, {1, 1, 4})})
        for (const double zoom : {0.3, 1.0, 1.37, 3.0}) {
            const Extent screen{31, 27, 90};
            const Request want = seen(Mode::xray, slab, screen, by, Vec3(1, 1, 1.7), zoom);
            const Data got = made(splat(), in, {want, scene});
            int rays = 0;
            for (std::int64_t y = 0; y < screen.y; ++y)
                for (std::int64_t x = 0; x < screen.x; ++x) {
                    const Ray ray(want, double(x), double(y));
                    // Those that go in and out through the slab's large faces, to which they are
                    // steepest, and are farther from the others than a cell.
                    bool through = !ray.cuts.empty();
                    for (const double t : {-1.0, 1.0}) {
                        if (!through) break;
                        const double end = t < 0 ? ray.cuts.front() : ray.cuts.back();
                        const Vec3 at = ray.origin + end * ray.direction;
                        through = std::abs(at.z() - 4) > 4.499 && std::abs(at.x() - 30) < 30.4 &&
                                  std::abs(at.y() - 28) < 28.4;
                    }
                    if (!through) continue;
                    ++rays;
                    // f32: some hundred sums, of tables that add up to 1 as their entries do.
                    ASSERT_NEAR(*got.at<float>(x, y, 0) / ray.length(), 1, 2e-5) << x << " " << y;
                }
            EXPECT_GT(rays, 20);
        }
}

TEST(Splat, MeansHaveTheIntegralOverTheLength) {
    for (const View& view : views()) {
        const Data in = volume(view.input, wave);
        Request want = seen(Mode::mean, view.input, view.screen, view.by, view.spacing, view.zoom);
        want.miss = -3;
        const Scene scene{.commonest = 0.25};
        const Data got = made(splat(), in, {want, scene});
        for (std::int64_t y = 0; y < view.screen.y; ++y)
            for (std::int64_t x = 0; x < view.screen.x; ++x) {
                const Ray ray(want, double(x), double(y));
                if (ray.cuts.empty()) {
                    ASSERT_EQ(*got.at<float>(x, y, 0), -3);
                    continue;
                }
                // As above; rays are cast where they are shorter than 8, which is off by the
                // curvature of 0.02 over a step of 1/4 and its ends.
                const Slices slices(ray);
                const double moved = 0.5 / kernels::Footprints::Shape{}.cells;
                const double ends = 2 * 0.75 * (8 * moved + 1.0 / 16) * slices.length / 8;
                ASSERT_NEAR(*got.at<float>(x, y, 0), integral(in, ray) / ray.length(),
                            moved * 0.27 + ends)
                    << x << " " << y;
            }
    }
}

TEST(Splat, IsNearTheRayCaster) {
    const Extent n{40, 33, 37};
    const Data in = volume(n, [](auto x, auto y, auto z) {
        return std::hypot(double(x) - 20, double(y) - 15, double(z) - 18) < 9 ? 1 : 0;
    });
    for (const View& view : views()) {
        Request want = seen(Mode::xray, n, view.screen, view.by, view.spacing, view.zoom);
        const Scene scene;
        const Data splats = made(splat(), in, {want, scene});
        const Data cast = made(ray_cast(), in, {want, scene}, {{"filter", "foh"}, {"step", 0.25}});
        double squares = 0, most = 0;
        for (std::int64_t i = 0; i < cast.what.samples(); ++i) {
            squares += std::pow(splats.as<float>()[i] - cast.as<float>()[i], 2);
            most = std::max<double>(most, cast.as<float>()[i]);
        }
        EXPECT_GT(most, 10);
        // A step from 0 to 1 within a voxel, moved by half a cell, at the ball's two ends; a ray
        // caster's quarter steps are off by as much.
        EXPECT_LT(std::sqrt(squares / double(cast.what.samples())), 3e-3 * most);
    }
}

TEST(Splat, AVoxelAddsWhatItsVolumeIs) {
    // Far from the faces, so that its footprint is that of a whole kernel.
    const Extent n{9, 9, 9};
    const Data in = volume(n, [](auto x, auto y, auto z) { return x == 4 && y == 4 && z == 4; });
    const Request want = seen(Mode::xray, n, {80, 80, 80}, turn(35, {1, 2, 1}), {1, 1, 1}, 7);
    const Scene scene;
    const Data got = made(splat(), in, {want, scene});
    double sum = 0;
    for (std::int64_t i = 0; i < got.what.samples(); ++i) {
        sum += double(got.as<float>()[i]);
        EXPECT_GE(got.as<float>()[i], 0);
    }
    // 49 pixels a voxel, of which each is off by up to half a cell along either axis, on slopes of
    // up to 1 on either side.
    EXPECT_NEAR(sum / 49, 1, 5e-3);
}

TEST(Splat, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41};
    std::mt19937 random(7);
    const Data in =
        volume(n, [&](auto...) { return random() % 5 ? 0.0 : double(random() % 1000); });
    const Extent screen{61, 133, 60};
    for (const Mode mode : {Mode::xray, Mode::mean}) {
        const Request want = seen(mode, n, screen, turn(37, {3, -2, 1}), {1, 1, 1}, 1.8);
        const Scene scene;
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(splat(), in, ask);
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                     static_cast<std::size_t>(one.what.bytes())));
        const Region box{{13, 21, 0}, {50, 90, 1}};
        const Data part = made(splat(), in, ask, box);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(13, y, 0), one.at<float>(13, y, 0),
                                     37 * sizeof(float)));
    }
}

template <class T>
void expect_same_of_type(Type type, const Data& floats, const Request& want, const Scene& scene,
                         const Data& expected) {
    Representation what = floats.what;
    what.type = type;
    Data in = Data::make(what, std::pmr::new_delete_resource());
    std::copy_n(floats.as<float>(), what.samples(), in.as<T>());
    const Data got = made(splat(), in, {want, scene});
    EXPECT_EQ(0, std::memcmp(got.samples.data(), expected.samples.data(),
                             static_cast<std::size_t>(got.what.bytes())))
        << name_of(type);
}

TEST(Splat, TypesAndValueMapsMeanTheSame) {
    const Extent n{37, 11, 13};
    std::mt19937 random(3);
    Data in = volume(n, [&](auto...) { return random() % 4 ? 3.0 : double(random() % 128); });
    in.what.values = {.slope = -0.5, .offset = 7};
    const Request want = seen(Mode::xray, n, {41, 33, 50}, turn(50, {1, -1, 2}));
    const Scene scene{.commonest = 5.5};
    const Data expected = made(splat(), in, {want, scene});
    expect_same_of_type<std::uint8_t>(Type::u8, in, want, scene, expected);
    expect_same_of_type<std::int8_t>(Type::i8, in, want, scene, expected);
    expect_same_of_type<std::uint16_t>(Type::u16, in, want, scene, expected);
    expect_same_of_type<std::int16_t>(Type::i16, in, want, scene, expected);
    expect_same_of_type<std::uint32_t>(Type::u32, in, want, scene, expected);
    expect_same_of_type<std::int32_t>(Type::i32, in, want, scene, expected);
    expect_same_of_type<double>(Type::f64, in, want, scene, expected);
    // The same values as they are.
    const Data plain =
        volume(n, [&](auto x, auto y, auto z) { return 7 - 0.5 * double(*in.at<float>(x, y, z)); });
    const Data same = made(splat(), plain, {want, scene});
    // Whatever is empty: sums of other numbers round by f32, at rays' ends by half a cell.
    const Scene other{.commonest = 0};
    const Data all = made(splat(), plain, {want, other});
    double squares = 0;
    for (std::int64_t i = 0; i < same.what.samples(); ++i) {
        ASSERT_NEAR(same.as<float>()[i], expected.as<float>()[i], 2e-4);
        squares += std::pow(all.as<float>()[i] - same.as<float>()[i], 2);
    }
    EXPECT_LT(std::sqrt(squares / double(same.what.samples())), 0.05 * 5.5);
}

TEST(Splat, ThinVolumesAreThoseOfTheField) {
    for (const Extent& n : {Extent{1, 1, 1},
                            {1, 20, 20},
                            {20, 1, 20},
                            {20, 20, 1},
                            {2, 2, 2},
                            {60, 1, 1},
                            {1, 1, 60},
                            {2, 30, 1}})
        for (const Matrix3d& by : {Matrix3d(Matrix3d::Identity()), turn(33, {1, 2, 3})}) {
            const Data in = volume(n, wave);
            const Extent screen{71, 73, 71};
            const Request want = seen(Mode::xray, n, screen, by);
            const Scene scene;
            const Data got = made(splat(), in, {want, scene});
            double squares = 0, most = 0;
            for (std::int64_t y = 0; y < screen.y; ++y)
                for (std::int64_t x = 0; x < screen.x; ++x) {
                    const double expected = integral(in, Ray(want, double(x), double(y)));
                    squares += std::pow(double(*got.at<float>(x, y, 0)) - expected, 2);
                    most = std::max(most, expected);
                }
            // Nearly all rays meet edges, where half a cell and a section show.
            EXPECT_LT(std::sqrt(squares / double(screen.x * screen.y)), 0.01 * most)
                << n.x << " " << n.y << " " << n.z;
        }
}

TEST(Splat, SamplesThatAreNotFiniteAddNothing) {
    const Extent n{12, 11, 10};
    const Scene scene;
    const Request want = seen(Mode::xray, n, {25, 25, 25}, turn(20, {1, 1, 1}));
    Data in = volume(n, wave), hole = volume(n, wave);
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (int i = 0; i < 3; ++i) {
        *in.at<float>(4 + i, 5, 3 + i) = bad[i];
        *hole.at<float>(4 + i, 5, 3 + i) = 0;
    }
    const Data got = made(splat(), in, {want, scene}),
               expected = made(splat(), hole, {want, scene});
    EXPECT_EQ(0, std::memcmp(got.samples.data(), expected.samples.data(),
                             static_cast<std::size_t>(got.what.bytes())));
}

TEST(Splat, CountsAPixelOfAFootprintForEachVoxelThatIsNotEmpty) {
    const Extent n{64, 64, 64};
    Representation what;
    what.extent = n;
    const Request want = seen(Mode::xray, n, {112, 112, 112}, turn(37, {3, -2, 1}));
    Scene scene;
    const auto work = [&] {
        const Ask ask{want, scene};
        return splat().work(splat().offer(what, ask, {}), ask, 0);
    };
    const Work all = work();
    // A cube of two voxels' side, turned, is less than four pixels wide: written four at a time.
    double height = 0;
    for (int k = 0; k < 3; ++k) height += 2 * std::abs(want.views.at(0).matrix()(1, k));
    // Rows go by two. Each pixel takes a footprint and a sum; bands share what lies at their edges.
    const double rows = 2 * std::ceil((std::floor(height + 0.1) + 1) / 2);
    EXPECT_GT(all.gathers, 64. * 64 * 64 * 2 * 4 * rows);
    EXPECT_LT(all.gathers, 64. * 64 * 64 * 2 * 4 * rows * 1.15);
    scene.occupied_fraction = 0.02;
    const Work few = work();
    EXPECT_NEAR(few.gathers, 0.02 * all.gathers, 1e-6 * all.gathers);
    EXPECT_LT(few.operations, 0.1 * all.operations);
    EXPECT_EQ(few.streamed, all.streamed);  // every voxel is looked at
}

TEST(Splat, RefusesWhatItCannotDo) {
    const Extent n{20, 21, 22};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto refused = [&](const Request& want) {
        return splat().offer(what, {want, scene}, {}).refused;
    };
    const auto expect = [&](const Request& want, const std::string& reason) {
        EXPECT_NE(refused(want).find(reason), std::string::npos) << refused(want);
    };
    const auto plain = [&](double zoom = 1) {
        return seen(Mode::xray, n, {40, 40, 40}, turn(20, {1, 2, 3}), {1, 1, 1}, zoom);
    };
    EXPECT_EQ(refused(plain()), "");
    for (const Mode mode : modes()) {
        Request want = plain();
        want.mode = mode;
        const bool sums = mode->combine == Combine::sum || mode->combine == Combine::mean;
        EXPECT_EQ(refused(want).empty(), sums) << mode->name;
        if (!sums && !mode->first_hit) expect(want, "no order");
    }
    Request want = plain();
    want.eye = Eye{};
    expect(want, "eye");
    want = plain();
    want.clips.resize(1);
    expect(want, "clip");
    want = plain();
    want.field = Field::nearest;
    expect(want, "labels");
    want = plain();
    want.job = Job::warp;
    expect(want, "a volume");
    expect(plain(100), "pixels wide; at most 64");
    expect(plain(0.001), "voxels; at most 2048");
    scene.non_finite = 17;
    expect(plain(), "17 samples are not finite");
}

}  // namespace
}  // namespace edgewise
