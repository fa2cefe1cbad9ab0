#include "transitions/project/splat_ewa.hpp"

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

namespace edgewise {
namespace {

using namespace looking;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSigma = 0.6;
/// What is cut off at four deviations is given to the rest.
constexpr double kCut = 3.4e-4;  // exp(-8)

Parameters as(double sigma, double lowpass) { return {{"sigma", sigma}, {"lowpass", lowpass}}; }

/// What kernels of a lattice add up to along one axis, at most more or less than 1: the first two
/// terms of Poisson's sum, of which others are below 1e-12.
double ripple(double sigma) { return 2 * std::exp(-2 * kPi * kPi * sigma * sigma); }
double ripple_of_integrals(double sigma) { return std::pow(1 + ripple(sigma), 2) - 1; }

/// A volume on a screen of so many pixels a unit, whose pixels are as wide as that says.
Request shown(const Extent& input, const Extent& screen, const Matrix3d& by, double zoom = 1,
              const Vec3& spacing = Vec3::Ones()) {
    Request want = seen(Mode::xray, input, screen, by, spacing, zoom);
    want.pixel = {1 / zoom, 1 / zoom};
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

/// A ray of pixel (px, py) in steps of t, and the part of it inside the box of the data.
struct Ray {
    Vec3 origin, direction;  // index
    double low = -1e300, high = 1e300;

    Ray(const Request& want, double px, double py) {
        const Mat4 back = want.views.at(0).matrix().inverse();
        Vec3 at(px, py, 0), along(0, 0, 1);
        if (want.eye) {
            const Eye& eye = *want.eye;
            at = eye.at;
            along = Vec3(px, py, eye.plane) - eye.at;
            along /= along.cwiseProduct(Vec3(eye.width, eye.height, 1)).norm();
            low = 0;
        }
        origin = back.topLeftCorner<3, 3>() * at + back.topRightCorner<3, 1>();
        direction = back.topLeftCorner<3, 3>() * along;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-0.5 - origin[axis]) / direction[axis];
            const double b = (double(want.input[axis]) - 0.5 - origin[axis]) / direction[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
    }
    double length() const { return std::max(0.0, high - low); }
    double distance(const Vec3& from) const {
        const Vec3 to = from - origin;
        return (to - direction * (to.dot(direction) / direction.squaredNorm())).norm();
    }
    /// The integral of a Gaussian of volume 1.
    double through(const Vec3& centre, double sigma) const {
        return std::exp(-0.5 * std::pow(distance(centre) / sigma, 2)) /
               (2 * kPi * sigma * sigma * direction.norm());
    }
    /// How far from a face it enters or leaves at, along the other axes [voxel].
    double inset(const Request& want) const {
        double least = 1e300;
        for (const double t : {low, high}) {
            const Vec3 p = origin + t * direction;
            std::array<double, 3> to;
            for (int axis = 0; axis < 3; ++axis)
                to[std::size_t(axis)] =
                    std::min(p[axis] + 0.5, double(want.input[axis]) - 0.5 - p[axis]);
            std::sort(to.begin(), to.end());
            least = std::min(least, to[1]);
        }
        return length() > 0 ? least : -1;
    }
};

/// A kernel's footprint from one eye, by ellipses of parallel rays: what is said of its error.
struct Bound {
    double depth, deviation;  // of the voxel; of its kernel along screen z
    double distance;          // of the ray from the voxel, in deviations of the ellipse

    Bound(const Request& want, const Vec3& voxel, double px, double py, double sigma) {
        const Mat4 map = want.views.at(0).matrix();
        const Eye& eye = *want.eye;
        const Eigen::Matrix3d linear = map.topLeftCorner<3, 3>();
        const Vec3 at = linear * voxel + map.topRightCorner<3, 1>() - eye.at;
        const double plane = eye.plane - eye.at.z();
        depth = at.z();
        deviation = sigma * linear.row(2).norm();
        const Eigen::Vector2d slope = at.head<2>() / depth;
        Eigen::Matrix<double, 2, 3> swept = linear.topRows<2>() - slope * linear.row(2);
        swept *= sigma * plane / depth;
        const Eigen::Vector2d away = Eigen::Vector2d(px, py) - eye.at.head<2>() - slope * plane;
        distance = std::sqrt(away.dot((swept * swept.transpose()).inverse() * away));
    }
    /// The ray's own ellipse lies between this one times 1 - e and 1 + e, e = r s / Z.
    double share() const {
        const double e = distance * deviation / depth, square = distance * distance / 2;
        const double more = std::exp(square * (1 - 1 / std::pow(1 + e, 2))) / std::pow(1 - e, 2);
        const double less = std::exp(square * (1 - 1 / std::pow(1 - e, 2))) / std::pow(1 + e, 2);
        return std::max(more - 1, 1 - less);
    }
};

TEST(SplatEwa, FootprintsFromAnEyeAreIntegralsOfGaussiansWithinTheBound) {
    // Voxels lie so far from the faces that these cannot be felt.
    const Extent n{17, 15, 16}, screen{140, 130, 9};
    const auto is_inside = [&](auto x, auto y, auto z) {
        return std::min({x, y, z}) >= 5 && x < n.x - 5 && y < n.y - 5 && z < n.z - 5;
    };
    const std::vector<Request> wants = {
        with_eye(shown(n, screen, Matrix3d::Identity(), 9), 20),
        with_eye(shown(n, screen, turn(37, {3, -2, 1}), 8), 24),
        with_eye(shown(n, screen, turn(-110, {1, 2, 1}), 6, {1, 1.3, 2.1}), 45),
    };
    for (Request want : wants) {
        std::mt19937 random(5);
        const Data in = volume(n, [&](auto x, auto y, auto z) {
            const double value = 1 - 2 * double(random() % 100) / 100;
            return random() % 5 || !is_inside(x, y, z) ? 0.0 : value;
        });
        want.unit = 0.7;
        const Scene scene;
        const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, 0));
        double most = 0, squares = 0;
        int pixels = 0;
        for (std::int64_t y = 0; y < screen.y; y += 3)
            for (std::int64_t x = 0; x < screen.x; x += 3) {
                const Ray ray(want, double(x), double(y));
                if (ray.inset(want) < 2.6) continue;
                double expected = 0, bound = 0;
                for (std::int64_t i = 0; i < n.samples(); ++i) {
                    const double value = double(in.as<float>()[i]);
                    if (value == 0) continue;
                    const Vec3 voxel(double(i % n.x), double(i / n.x % n.y), double(i / n.x / n.y));
                    const double own = value * ray.through(voxel, kSigma);
                    const Bound of(want, voxel, double(x), double(y), kSigma);
                    expected += own;
                    // Beyond four deviations there is nothing of it. Sums of kernels at the two
                    // faces that a ray crosses are off by a ripple's integral, 5e-4 voxels of 15.
                    bound += std::abs(own) *
                             (of.distance > 4 ? 1 : of.share() * (1 + kCut) + kCut + 1e-4);
                }
                const double error = double(*got.at<float>(x, y, 0)) / want.unit - expected;
                // f32 adds up some thirty voxels of at most 1; a pixel at the cut may have 3e-4.
                ASSERT_LE(std::abs(error), bound + 3e-6) << x << " " << y;
                most = std::max(most, std::abs(expected));
                squares += error * error;
                ++pixels;
            }
        EXPECT_GT(most, 0.3);
        EXPECT_LT(std::sqrt(squares / pixels), 0.01 * most);
    }
}

TEST(SplatEwa, OneFootprintErrsByAtMostWhatIsSaidOfItsPeak) {
    const Extent n{15, 15, 15}, screen{200, 200, 1};
    const Data in = volume(n, [](auto x, auto y, auto z) { return x == 7 && y == 7 && z == 7; });
    for (const double aside : {0.0, 0.3, 0.5})
        for (const double depth : {21.0, 30.0, 60.0}) {
            Request want = with_eye(shown(n, screen, turn(20, {1, 1, 2}), 20), depth);
            // The eye looks past the voxel, which stays on the screen.
            want.eye->at.x() -= 20 * aside * depth;
            const Scene scene;
            const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, 0));
            double worst = 0, peak = 0;
            for (std::int64_t y = 0; y < screen.y; ++y)
                for (std::int64_t x = 0; x < screen.x; ++x) {
                    const Ray ray(want, double(x), double(y));
                    if (ray.inset(want) < 2.6) continue;  // faces could be felt
                    const double exact = ray.through(Vec3::Constant(7), kSigma);
                    worst = std::max(worst, std::abs(double(*got.at<float>(x, y, 0)) - exact));
                    peak = std::max(peak, exact);
                }
            EXPECT_NEAR(peak, 1 / (2 * kPi * kSigma * kSigma), 0.01);
            // Bound::share() of all distances is no more than this for shares up to 0.06.
            const double first = kSigma / depth;
            EXPECT_LE(worst, peak * (2.1 * first + 6 * first * first + kCut + 1e-4)) << depth;
            if (aside > 0.4) {
                EXPECT_GT(worst, 0.2 * peak * first);  // it is of this size
            }
        }
}

TEST(SplatEwa, ABlobIsItsOwnIntegral) {
    const Extent n{41, 41, 41};
    const double width = 4;
    const Vec3 centre(20.3, 19.6, 20.1);
    const Data in = volume(n, [&](auto x, auto y, auto z) {
        return std::exp(-0.5 * (Vec3(double(x), double(y), double(z)) - centre).squaredNorm() /
                        (width * width));
    });
    const double sum = std::pow(2 * kPi, 1.5) * std::pow(width, 3);
    for (const double distance : {0.0, 90.0, 180.0})
        for (const double lowpass : {0.0, 0.6}) {
            Request want = shown(n, {80, 80, 80}, turn(33, {1, 2, -1}), 1.5);
            if (distance > 0) want = with_eye(want, distance);
            const Scene scene;
            const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, lowpass));
            // Gaussians of Gaussians are Gaussians. A pixel's own adds 0.4 voxels where the blob
            // is, and up to a third less or more before and behind it.
            const double total =
                std::sqrt(width * width + kSigma * kSigma + std::pow(lowpass / 1.5, 2));
            const double blurred = std::sqrt(width * width + kSigma * kSigma);
            const double peak = sum / (2 * kPi * blurred * blurred);
            for (std::int64_t y = 0; y < 80; ++y)
                for (std::int64_t x = 0; x < 80; ++x) {
                    const Ray ray(want, double(x), double(y));
                    const double exact = sum * ray.through(centre, total);
                    // Ripples; ellipses, whose errors nearly cancel, by a tenth of their bound;
                    // what is said of the pixel, a third of the square of 0.4 / 4; the blob's cut
                    // ends.
                    const double depth = want.eye ? want.eye->plane - want.eye->at.z() - 12 : 1e9;
                    const double share = ripple_of_integrals(kSigma) + kCut +
                                         0.21 * kSigma / depth +
                                         (want.eye && lowpass > 0 ? 4e-3 : 0);
                    ASSERT_NEAR(*got.at<float>(x, y, 0), exact, share * peak)
                        << x << " " << y << " " << distance << " " << lowpass;
                }
        }
}

TEST(SplatEwa, AConstantRipplesAsSaid) {
    const Extent slab{61, 57, 9};
    const Data in = volume(slab, [](auto...) { return 1; });
    const Scene scene;  // zeros are empty: all of this is added
    double worst = 0, edge = 0;
    for (const Matrix3d& by : {Matrix3d(Matrix3d::Identity()), turn(30, {0, 0, 1}),
                               turn(25, {1, 0, 0}), turn(20, {1, 2, 0}), turn(180, {1, 0, 0})})
        for (const double zoom : {0.3, 1.0, 3.7})
            for (const double distance : {0.0, 50.0})
                for (const double lowpass : {0.0, 0.6}) {
                    if (zoom < 1 && lowpass == 0) continue;  // pixels meet few of the voxels
                    Request want = shown(slab, {41, 37, 90}, by, zoom, Vec3(1, 1, 1.7));
                    if (distance > 0) want = with_eye(want, distance);
                    const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, lowpass));
                    int rays = 0;
                    for (std::int64_t y = 0; y < 37; ++y)
                        for (std::int64_t x = 0; x < 41; ++x) {
                            const Ray ray(want, double(x), double(y));
                            if (ray.length() < 1e-9) {
                                ASSERT_EQ(*got.at<float>(x, y, 0), 0) << x << " " << y;
                                continue;
                            }
                            ++rays;
                            const double share = double(*got.at<float>(x, y, 0)) / ray.length() - 1;
                            // Of an eye ellipses change over a kernel, by its share of the depth in
                            // second order: both axes, and the length of what lies there.
                            const double depth = want.eye ? distance - 30 : 1e9;
                            const double bound = ripple_of_integrals(kSigma) + 2 * kCut +
                                                 3 * std::pow(kSigma * 1.7 / depth, 2);
                            // Farther from edges than kernels and pixels reach; nearer ones are
                            // told by their variance along each axis alone.
                            if (ray.inset(want) < 4 * std::hypot(kSigma, lowpass / zoom) + 0.5) {
                                edge = std::max(edge, std::abs(share));
                                continue;
                            }
                            ASSERT_LE(std::abs(share), bound)
                                << x << " " << y << " " << zoom << " " << distance;
                            if (!want.eye) worst = std::max(worst, std::abs(share));
                        }
                    EXPECT_GT(rays, 20) << zoom << " " << distance;
                }
    EXPECT_LT(edge, 0.25);                                // of short rays
    EXPECT_GT(worst, 0.8 * ripple_of_integrals(kSigma));  // the number is no larger than need be
    EXPECT_NEAR(ripple_of_integrals(kSigma), 0.0033, 5e-5);
}

TEST(SplatEwa, WhatIsSmallerThanPixelsBecomesItsMean) {
    // Nothing is left of a checkerboard of which pixels have three periods and more; its squares go
    // through the slab, so that rays do not even it out.
    const Extent n{160, 150, 12};
    const Data in = volume(n, [](auto x, auto y, auto) { return (x + y) % 2; });
    const Scene scene{.commonest = 0};
    for (const double zoom : {0.29, 0.13})
        for (const double distance : {0.0, 600.0}) {
            Request want = shown(n, {31, 29, 40}, turn(13, {1, 1, 3}), zoom);
            if (distance > 0) want = with_eye(want, distance);
            const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, 0.6));
            int rays = 0;
            for (std::int64_t y = 0; y < 29; ++y)
                for (std::int64_t x = 0; x < 31; ++x) {
                    const Ray ray(want, double(x), double(y));
                    if (ray.inset(want) < 4 * std::hypot(kSigma, 0.6 / zoom)) continue;
                    ++rays;
                    ASSERT_NEAR(*got.at<float>(x, y, 0), 0.5 * ray.length(),
                                (ripple_of_integrals(kSigma) + 2 * kCut) * ray.length())
                        << x << " " << y << " " << zoom;
                }
            EXPECT_GT(rays, 20) << zoom << " " << distance;
        }
}

TEST(SplatEwa, MeansAndOffsetsKnowWhatIsEmpty) {
    const Extent n{40, 38, 36};
    const Data in = volume(n, [](auto x, auto y, auto z) {
        return 2 + (std::hypot(double(x) - 20, double(y) - 18, double(z) - 17) < 7 ? 3 : 0);
    });
    const Scene scene{.commonest = 2};
    Request want = with_eye(shown(n, {50, 50, 70}, turn(30, {1, 2, 0})), 80);
    want.mode = Mode::mean;
    want.miss = -7;
    const Data mean = made(splat_ewa(), in, {want, scene}, as(kSigma, 0.6));
    Request integral = want;
    integral.mode = Mode::xray;
    integral.zero = 1;
    const Data sum = made(splat_ewa(), in, {integral, scene}, as(kSigma, 0.6));
    int inside = 0, missed = 0;
    for (std::int64_t y = 0; y < 50; ++y)
        for (std::int64_t x = 0; x < 50; ++x) {
            const Ray ray(want, double(x), double(y));
            const double got = *mean.at<float>(x, y, 0);
            missed += got == -7;
            ASSERT_EQ(got == -7, ray.length() == 0) << x << " " << y;
            if (ray.length() == 0) continue;
            ++inside;
            EXPECT_GE(got, 2 - 1e-5);
            EXPECT_LE(got, 2 + 3 * 14.5 / ray.length());  // through the ball and its blurred faces
            EXPECT_NEAR(*sum.at<float>(x, y, 0), (got - 1) * ray.length(), 1e-4 * ray.length());
        }
    EXPECT_GT(inside, 500);
    EXPECT_GT(missed, 20);
    // Through the middle of the ball.
    const Ray middle(want, 25, 24);
    EXPECT_NEAR(*mean.at<float>(25, 24, 0), 2 + 3 * 14 / middle.length(), 0.1);
}

TEST(SplatEwa, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41}, screen{101, 133, 60};
    std::mt19937 random(7);
    const Data in = volume(n, [&](auto...) { return random() % 9 ? 0.0 : double(random() % 2); });
    for (const double distance : {0.0, 60.0})
        for (const double zoom : {0.4, 1.8, 11.0}) {
            Request want = shown(n, screen, turn(37, {3, -2, 1}), zoom);
            // Some voxels lie far beside the screen.
            if (distance > 0) want = with_eye(want, distance);
            const Scene scene;
            const Ask ask{want, scene};
            const auto with = [&](std::size_t threads) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                return made(splat_ewa(), in, ask, as(kSigma, 0.6));
            };
            const Data one = with(1);
            for (const std::size_t threads : {2u, 7u})
                EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                         static_cast<std::size_t>(one.what.bytes())));
            for (const Region& box :
                 {Region{{13, 21, 0}, {90, 110, 1}}, Region{{64, 40, 0}, {65, 41, 1}}}) {
                const Data part = made(splat_ewa(), in, ask, box, as(kSigma, 0.6));
                for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                    ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                             one.at<float>(box.begin[0], y, 0),
                                             std::size_t(box.extent().x) * sizeof(float)));
            }
        }
}

TEST(SplatEwa, TakesOddShapesTypesAndMirrors) {
    const Scene scene;
    for (const Extent& n : {Extent{1, 1, 1}, Extent{1, 1, 30}, Extent{25, 1, 1}, Extent{20, 17, 1}})
        for (const double degrees : {0.0, 90.0, 41.0}) {
            const Data in = volume(n, [](auto...) { return 1; });
            const Matrix3d by = turn(degrees, {1, 2, 0}) * Vec3(-1, 1, 1).asDiagonal();
            const Request want = shown(n, {60, 60, 60}, by, 1.4);
            const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, 0.6));
            // Few voxels fill their box too. All of them are near edges.
            for (std::int64_t y = 0; y < 60; ++y)
                for (std::int64_t x = 0; x < 60; ++x)
                    ASSERT_NEAR(*got.at<float>(x, y, 0), Ray(want, double(x), double(y)).length(),
                                0.25 * Ray(want, double(x), double(y)).length())
                        << x << " " << y << " " << degrees << " " << n.x << " " << n.y;
        }
    // A narrow type, whose numbers stand for others.
    const Extent n{12, 11, 10};
    Representation what;
    what.extent = n;
    what.type = Type::i16;
    what.values = {.slope = -0.5, .offset = 3};
    Data narrow = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < n.samples(); ++i)
        narrow.as<std::int16_t>()[i] = static_cast<std::int16_t>(i % 7 ? 6 : i % 200 - 100);
    const Data wide = volume(n, [&](auto x, auto y, auto z) {
        return -0.5 * narrow.as<std::int16_t>()[x + n.x * (y + n.y * z)] + 3;
    });
    const Request want = with_eye(shown(n, {40, 40, 30}, turn(20, {1, 1, 0})), 50);
    const Data one = made(splat_ewa(), narrow, {want, scene}, as(kSigma, 0.6));
    const Data other = made(splat_ewa(), wide, {want, scene}, as(kSigma, 0.6));
    for (std::int64_t i = 0; i < 1600; ++i)
        ASSERT_NEAR(one.as<float>()[i], other.as<float>()[i], 1e-4);
}

TEST(SplatEwa, WhatLiesBesideTheScreenStaysThere) {
    // The eye looks along a wall whose nearest voxels lie at seven times the slope of the outermost
    // ray: where they are, ellipses would be three times as long as wide.
    const Extent n{300, 15, 120};
    const Data in = volume(n, [](auto x, auto, auto) { return x > 180 ? 1 : 0; });
    const Request want = with_eye(shown(n, {64, 64, 120}, Matrix3d::Identity()), 69.5);
    const Scene scene;
    const Data got = made(splat_ewa(), in, {want, scene}, as(kSigma, 0.6));
    int beside = 0, through = 0;
    for (std::int64_t x = 0; x < 64; ++x) {
        const Ray ray(want, double(x), 31.5);
        const Vec3 leaves = ray.origin + ray.high * ray.direction;
        const double sum = double(*got.at<float>(x, 31, 0) + *got.at<float>(x, 32, 0)) / 2;
        // The pixel's own width, at the far end, and the kernel's.
        const double width = std::hypot(kSigma, 0.6 * 129.5 / 69.5);
        if (leaves.x() < 180.5 - 4 * width) {
            ++beside;
            ASSERT_NEAR(sum, 0, 1e-4) << x;
        } else if (leaves.x() > 180.5 + 12) {
            ++through;
            // Behind the wall's face and before the last slice, of which the pixel has more and
            // less.
            const double inside = (leaves.x() - 180.5) / ray.direction.x();
            ASSERT_NEAR(sum, inside, 0.02 * inside + 0.5) << x;
        }
    }
    EXPECT_GT(beside, 40);
    EXPECT_GT(through, 1);
}

TEST(SplatEwa, BlursByNoMoreThanIsPredicted) {
    // Of a curve of second order a kernel adds half of its variance times the second derivative.
    const Extent n{40, 40, 40};
    const Data in = volume(n, [](auto x, auto y, auto) {
        return 100 - 0.05 * std::pow(double(x) - 19.5, 2) - 0.05 * std::pow(double(y) - 19.5, 2);
    });
    for (const double zoom : {0.5, 1.0, 4.0}) {
        const Request want = shown(n, {21, 21, 40}, Matrix3d::Identity(), zoom);
        // What the trilinear kernel errs by, along both axes and through 40 voxels.
        const double linear = 40 * 2 * 0.05 * (1.0 / 6);
        Scene scene;
        scene.facts["picture/foh/0.25"] = linear;
        scene.mean = 90;
        const Ask ask{want, scene};
        const Offer offer = splat_ewa().offer(in.what, ask, as(kSigma, 0.6));
        const Error error = splat_ewa().error(offer, ask);
        const double variance = kSigma * kSigma + 0.36 / (zoom * zoom);
        const Data got = made(splat_ewa(), in, ask, as(kSigma, 0.6));
        const double added = 40 * 100 - double(*got.at<float>(10, 10, 0));
        EXPECT_NEAR(error.bias, linear * variance * 6, 1e-9) << zoom;
        EXPECT_NEAR(added, error.bias, 40 * 100 * ripple_of_integrals(kSigma)) << zoom;
        EXPECT_LT(error.noise, 40 * 100 * ripple(kSigma)) << zoom;
    }
}

TEST(SplatEwa, RefusesWhatItCannotDo) {
    const Extent n{20, 20, 20};
    const Scene scene;
    Representation what;
    what.extent = n;
    const auto refused = [&](const Request& want, const Scene& of = Scene{}) {
        return splat_ewa().offer(what, {want, of}, as(kSigma, 0.6)).refused;
    };
    const Request plain = shown(n, {40, 40, 40}, turn(20, {1, 2, 0}));
    EXPECT_EQ(refused(plain), "");
    EXPECT_EQ(refused(with_eye(plain, 60)), "");
    Request near = with_eye(plain, 60);
    near.eye->at = Vec3(19.5, 19.5, 4);
    EXPECT_NE(refused(near).find("spacings before the nearest samples"), std::string::npos);
    near.eye->at.z() = 20;
    EXPECT_NE(refused(near).find("beside the eye or behind it"), std::string::npos);
    for (const Mode mode : {Mode::composite, Mode::mip}) {
        Request other = plain;
        other.mode = mode;
        other.transfer.points = {{0, 0, {}}, {1, 1, {1, 1, 1}}};
        EXPECT_NE(refused(other).find("only integrals and means"), std::string::npos);
    }
    Request labels = plain;
    labels.field = Field::nearest;
    EXPECT_NE(refused(labels).find("labels"), std::string::npos);
    EXPECT_NE(refused(plain, Scene{.non_finite = 3}).find("3 samples are not finite"),
              std::string::npos);
    Request cue = plain;
    cue.cue = DepthCue{};
    EXPECT_NE(refused(cue).find("light falls off"), std::string::npos);
    Request warp = plain;
    warp.job = Job::warp;
    EXPECT_NE(refused(warp), "");
    const Offer offer = splat_ewa().offer(what, {with_eye(plain, 60), scene}, as(kSigma, 0.6));
    EXPECT_GT(splat_ewa().work(offer, {with_eye(plain, 60), scene}, 0).operations, 8000 * 90);
}

}  // namespace
}  // namespace edgewise
