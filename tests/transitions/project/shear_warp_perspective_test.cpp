#include "transitions/project/shear_warp_perspective.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp.hpp"

namespace edgewise {
namespace {

using namespace looking;

/// What an eye sees of a volume.
struct Sight {
    Extent input, screen;
    Matrix3d by = Matrix3d::Identity();
    Vec3 spacing = Vec3::Ones();
    double zoom = 1;       // pixels a unit where the volume's middle is
    double distance = 90;  // of the eye from the middle [unit]
    Vec3 aside{0, 0, 0};   // of the eye from the middle of the screen [pixel]
    double density = 1;
};

Request seen_from(const Sight& of, Mode mode) {
    Request want = seen(mode, of.input, of.screen, of.by, of.spacing, of.zoom);
    want.transfer.points = {{0, 0, {0.1, 0.2, 0.3}}, {1, 0.1, {1, 0.5, 0}}};
    want.unit = 1.25;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.miss = -1;
    Eye eye;
    const double middle = double(of.screen.z - 1) / 2;
    eye.at = Vec3(double(of.screen.x - 1) / 2, double(of.screen.y - 1) / 2, middle - of.distance);
    eye.at += of.aside;
    eye.plane = middle;
    eye.width = eye.height = 1 / of.zoom;
    want.eye = eye;
    return want;
}

Parameters by(const std::string& filter, double density = 1) {
    return {{"filter", filter}, {"density", density}};
}

/// The picture of a request in f64: rays as lines in the samples' index space, which take a sample
/// in each slice of the axis along which the ray of the pixel advances fastest.
class Expected {
 public:
    Expected(const Data& data, const Request& want, const std::string& filter, double density)
        : data_(data), want_(want), nearest_(filter == "zoh"), density_(density) {
        map_ = want.views.at(0).matrix();
        back_ = map_.inverse();
        eye_ = point(want.eye->at);
    }

    /// Nothing where f32 may decide otherwise: rays that graze the volume, or end in a slice.
    std::optional<std::array<double, 4>> at(double x, double y) {
        const Vec3 toward = point({x, y, want_.eye->plane}) - eye_;
        axis_ = 2;
        for (int a : {1, 0})
            if (std::abs(toward[a]) > std::abs(toward[axis_])) axis_ = a;
        for (int a = 0; a < 3; ++a)
            if (a != axis_ && std::abs(toward[a]) > 0.9999 * std::abs(toward[axis_])) return {};
        sure_ = true;
        const Ray own(*this, toward);
        if (!own.hits()) {
            if (!sure_) return {};
            std::array<double, 4> missed{};
            Stretch::empty(want_.mode).result(want_, missed.data());
            if (want_.mode->miss != ModeTraits::Miss::zero) missed[0] = want_.miss;
            return missed;
        }
        const Extent& n = data_.what.extent;
        const int u = axis_ == 0 ? 1 : 0, v = axis_ == 2 ? 1 : 2;
        // Pixels are voxels of the first slice that rays of this axis, or a pixel beside them,
        // meet.
        double met = 0;
        for (int a = 0; a < 3; ++a)
            if (a != axis_ || toward[a] > 0) met = std::max(met, -0.5 - eye_[a]);
        for (int a = 0; a < 3; ++a)
            if (a != axis_ || toward[a] < 0) met = std::max(met, eye_[a] - (double(n[a]) - 0.5));
        const double near = std::max(met - 1 / density_, met / 2), last = double(n[axis_] - 1);
        slice_ = toward[axis_] > 0 ? std::clamp(std::ceil(eye_[axis_] + near), 0.0, last)
                                   : std::clamp(std::floor(eye_[axis_] - near), 0.0, last);
        const Vec3 place = eye_ + (slice_ - eye_[axis_]) / toward[axis_] * toward;
        const double i = density_ * place[u], j = density_ * place[v];
        const auto of_pixel = [&](double column, double row) {
            Vec3 to = place;
            to[u] = column / density_;
            to[v] = row / density_;
            return Ray(*this, to - eye_);
        };
        std::array<double, 4> sum{};
        if (nearest_) {
            for (const double at : {i, j})
                sure_ = sure_ && std::abs(at - std::floor(at) - 0.5) > 1e-6;
            const Ray ray = of_pixel(std::floor(i + 0.5), std::floor(j + 0.5));
            sum = ray.hits() ? ray.value() : own.value();
            return sure_ ? std::optional(sum) : std::nullopt;
        }
        for (int corner = 0; corner < 4; ++corner) {
            const double column = std::floor(i) + (corner & 1), row = std::floor(j) + (corner >> 1);
            const double weight = (1 - std::abs(i - column)) * (1 - std::abs(j - row));
            if (weight < 1e-9) {
                sure_ = sure_ && weight == 0;
                continue;
            }
            const Ray ray = of_pixel(column, row);
            bool alike = ray.hits();
            if (alike && want_.mode->lengthen)
                for (const double ratio :
                     {ray.length() / own.length(), own.length() / ray.length()}) {
                    sure_ = sure_ && std::abs(ratio - 1.25) > 1e-5;
                    alike = alike && ratio < 1.25;
                }
            if (!alike) {
                sum = own.value();
                return sure_ ? std::optional(sum) : std::nullopt;
            }
            auto value = ray.value();
            if (want_.mode->lengthen) want_.mode->lengthen(own.length() / ray.length(), value);
            for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * value[c];
        }
        return sure_ ? std::optional(sum) : std::nullopt;
    }

 private:
    Vec3 point(const Vec3& screen) const {
        return (back_ * Eigen::Vector4d(screen[0], screen[1], screen[2], 1)).head<3>();
    }

    struct Ray {
        Expected& of;
        Vec3 direction;
        double low = 0, high = std::numeric_limits<double>::infinity();  // times the direction

        Ray(Expected& all, const Vec3& toward) : of(all), direction(toward) {
            const Extent& n = of.data_.what.extent;
            for (int axis = 0; axis < 3; ++axis) {
                const double a = (-0.5 - of.eye_[axis]) / direction[axis];
                const double b = (double(n[axis]) - 0.5 - of.eye_[axis]) / direction[axis];
                low = std::max(low, std::min(a, b));
                high = std::min(high, std::max(a, b));
            }
            // Chords of less than 1e-6 of the slices are none.
            if (std::abs(slices(high) - slices(low)) < 1e-5 * double(n[of.axis_] + 1))
                of.sure_ = false;
        }
        bool hits() const { return low < high; }
        double slices(double t) const { return (of.eye_ + t * direction)[of.axis_]; }
        /// Along the ray [unit].
        double length() const {
            const Eye& eye = *of.want_.eye;
            const Vec3 moved = of.map_.topLeftCorner<3, 3>() * ((high - low) * direction);
            return moved.cwiseProduct(Vec3(eye.width, eye.height, 1)).norm();
        }
        std::array<double, 4> value() const {
            const double one = slices(low), other = slices(high);
            double first = std::min(one, other), last = std::max(one, other);
            for (const double end : {first, last})
                if (std::abs(end - std::round(end)) < 1e-5) of.sure_ = false;
            const double each = length() / (last - first);
            const bool up = direction[of.axis_] > 0;
            Stretch stretch = Stretch::empty(of.want_.mode);
            const auto add = [&](double slice, double share) {
                const double t = (slice - of.eye_[of.axis_]) / direction[of.axis_];
                stretch.add(of.sample(of.eye_ + t * direction), share * each, of.want_);
            };
            if (std::ceil(first) > last) {
                const double before = std::floor(first), after = before + 1;
                const double down = first - before, ahead = after - last;
                if (std::abs(down - ahead) < 1e-6) of.sure_ = false;
                const double end = double(of.data_.what.extent[of.axis_] - 1);
                const auto there = [&](double k) {
                    return k >= (up ? of.slice_ : 0) && k <= (up ? end : of.slice_);
                };
                const bool takes = there(before) && (!there(after) || down < ahead);
                add(takes ? before : after, last - first);
            }
            for (double k = std::ceil(up ? first : -last); k <= (up ? last : -first); ++k) {
                // Shares as seen from the eye: up to the middle between two slices.
                const double begin = up ? first : -last, end = up ? last : -first;
                const double from = k - 1 < begin ? begin : k - 0.5;
                const double to = k + 1 > end ? end : k + 0.5;
                add(up ? k : -k, to - from);
            }
            std::array<double, 4> result{};
            stretch.result(of.want_, result.data());
            return result;
        }
    };

    double sample(const Vec3& at) {
        const Extent& n = data_.what.extent;
        if (!nearest_) return trilinear(data_, at);
        std::int64_t i[3];
        for (int axis = 0; axis < 3; ++axis) {
            const double p = std::clamp(at[axis], 0.0, double(n[axis] - 1));
            if (axis != axis_ && std::abs(p - std::floor(p) - 0.5) < 1e-9) sure_ = false;
            i[axis] = std::int64_t(std::floor(p + 0.5));
        }
        return double(*data_.at<float>(i[0], i[1], i[2]));
    }

    const Data& data_;
    const Request& want_;
    bool nearest_;
    double density_;
    Mat4 map_, back_;
    Vec3 eye_;
    int axis_ = 2;
    double slice_ = 0;  // the first that rays may meet
    bool sure_ = true;
};

std::vector<Sight> sights() {
    const Extent n{21, 17, 26}, screen{44, 41, 45};
    return {
        {n, screen, Matrix3d::Identity(), {1, 1, 1}, 1, 90, {0.3, -0.2, 0}},
        {n, screen, turn(17, {3, -2, 1})},
        {n, screen, turn(165, {0, 3, 1}), {1, 1, 1}, 1.3, 60},
        {n, screen, turn(95, {0, 1, 0.1}), {1, 1, 1}, 1, 45, {30, -20, 0}},
        {{21, 17, 12}, {60, 60, 60}, turn(80, {1, 0.1, 0.2}), {1, 1.3, 3.1}, 1, 80},
        // Several axes.
        {n, screen, turn(44, {0.3, 1, 0}), {1, 1, 1}, 1.5, 30},
        {n, {50, 50, 45}, turn(54.7, {1, -1, 0.1}), {1, 1, 1}, 1.1, 40},
        // An eye beside the slices of one axis, and of two.
        {n, {90, 90, 45}, turn(3, {1, 2, 0}), {1, 1, 1}, 1, 20},
        {n, {90, 90, 45}, turn(88, {1, -1, 0.1}), {1, 1, 1}, 1, 18, {9, 3, 0}},
        // Resolution.
        {n, screen, turn(17, {3, -2, 1}), {1, 1, 1}, 1, 60, {0, 0, 0}, 3},
        {n, screen, turn(20, {1, 1, 0}), {1, 1, 1}, 2, 40, {0, 0, 0}, 0.5},
        // Rows of other lengths along other axes.
        {{90, 9, 20}, {70, 70, 60}, turn(40, {0.2, 1, 0}), {1, 1, 1}, 1, 50},
        // Larger than a tile.
        {{140, 20, 30}, {150, 50, 60}, turn(10, {1, 1, 0}), {1, 1, 1}, 1, 150},
    };
}

std::vector<Mode> sliced_modes() {
    std::vector<Mode> all;
    for (const Mode mode : modes())
        if (!mode->first_hit && mode->sampled_every == 0) all.push_back(mode);
    return all;
}

TEST(ShearWarpPerspective, IsThePictureOfRaysThroughSlices) {
    std::mt19937 random(5);
    for (const Sight& of : sights()) {
        const Data in = volume(of.input, [&](auto...) { return double(random() % 1024) / 1024; });
        const Scene scene;
        for (const Mode mode : sliced_modes())
            for (const char* filter : {"foh", "zoh"}) {
                if (of.input.x > 100 && mode != Mode::composite && mode != Mode::mip) continue;
                const Request want = seen_from(of, mode);
                const Ask ask{want, scene};
                const Data got = made(shear_warp_perspective(), in, ask, by(filter, of.density));
                Expected expected(in, want, filter, of.density);
                std::int64_t sure = 0, hits = 0;
                for (std::int64_t y = 0; y < of.screen.y; ++y)
                    for (std::int64_t x = 0; x < of.screen.x; ++x) {
                        const auto values = expected.at(double(x), double(y));
                        if (!values) continue;
                        ++sure;
                        hits += *got.at<float>(x, y, 0) != want.miss;
                        for (int c = 0; c < mode->channels; ++c) {
                            const double value = (*values)[std::size_t(c)];
                            // f32: a sample of at most 1 errs by three roundings of weights and
                            // products, an integral of some 50 units by as many sums; opacities
                            // of samples by 2^-21. Nearest samples are themselves.
                            const double most = mode->extreme != 0 && filter[0] == 'z' ? 0
                                                : mode == Mode::xray                   ? 5e-5
                                                                                       : 5e-6;
                            // The level is passed or not.
                            const double error = double(got.at<float>(x, y, 0)[c]) - value;
                            if (mode->takes_level && std::abs(error) > 1e-6) {
                                --sure;
                                break;
                            }
                            ASSERT_NEAR(error, 0, most)
                                << mode->name << ' ' << filter << ' ' << x << ' ' << y;
                        }
                    }
                EXPECT_GT(sure, of.screen.x * of.screen.y * 95 / 100)
                    << mode->name << ' ' << filter << ' ' << of.distance << ' ' << of.by(0, 1);
                EXPECT_GT(hits, 200);
            }
    }
}

TEST(ShearWarpPerspective, AConstantIsExactForEveryRay) {
    // Lengths, and opacities of them, hang on nothing but the ray: also beside faces, and where
    // one axis takes over from another.
    for (Sight of : sights()) {
        of.screen.x += 3;
        const Data in = volume(of.input, [](auto...) { return 0.7; });
        const Scene scene;
        const Request one = seen_from(of, Mode::composite);
        const Mat4 map = one.views.at(0).matrix(), back = map.inverse();
        const auto point = [&](const Vec3& p) -> Vec3 {
            return (back * Eigen::Vector4d(p[0], p[1], p[2], 1)).head<3>();
        };
        const Vec3 eye = point(one.eye->at);
        const auto length_of = [&](double x, double y) {
            const Vec3 d = point({x, y, one.eye->plane}) - eye;
            double low = 0, high = 1e300;
            for (int axis = 0; axis < 3; ++axis) {
                const double a = (-0.5 - eye[axis]) / d[axis];
                const double b = (double(of.input[axis]) - 0.5 - eye[axis]) / d[axis];
                low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
            }
            const Vec3 in_units = (map.topLeftCorner<3, 3>() * d)
                                      .cwiseProduct(Vec3(one.eye->width, one.eye->height, 1));
            return std::max(0.0, high - low) * in_units.norm();
        };
        for (const Mode mode : {Mode::xray, Mode::mean, Mode::mip, Mode::composite}) {
            const Request want = seen_from(of, mode);
            const Data got =
                made(shear_warp_perspective(), in, {want, scene}, by("foh", of.density));
            const double value = double(0.7f);
            for (std::int64_t y = 0; y < of.screen.y; ++y)
                for (std::int64_t x = 0; x < of.screen.x; ++x) {
                    const double length = length_of(double(x), double(y));
                    if (length > 0 && length < 1e-3) continue;  // may be none
                    // EQ 63, with opacities a file unit of which a step in depth has 1.25.
                    const double left = std::pow(1 - 0.1 * value, length * want.unit);
                    const double expected = mode == Mode::xray        ? value * length * want.unit
                                            : mode == Mode::composite ? (1 - left) * 0.73
                                            : length > 0              ? value
                                                                      : want.miss;
                    // Sums of 60 in f32; transparencies err by 2^-21 a sample, and rays end where
                    // 2^-12 is left.
                    ASSERT_NEAR(*got.at<float>(x, y, 0), expected, mode == Mode::xray ? 1e-4 : 2e-5)
                        << mode->name << ' ' << x << ' ' << y;
                }
        }
    }
}

TEST(ShearWarpPerspective, IsNearTheRayCaster) {
    for (const Sight& of : sights()) {
        const Data in = volume(of.input, wave), ones = volume(of.input, [](auto...) { return 1; });
        const Scene scene;
        const Request want = seen_from(of, Mode::mean);
        Request integral = seen_from(of, Mode::xray);
        integral.unit = 1;
        const Parameters fine{{"filter", "foh"}, {"step", 0.125}};
        const Data got = made(shear_warp_perspective(), in, {want, scene}, by("foh", of.density));
        const Data cast = made(ray_cast(), in, {want, scene}, fine);
        const Data lengths = made(ray_cast(), ones, {integral, scene}, fine);
        // Rays are so many times as far apart where they leave as where they enter.
        const Mat4 back = want.views.at(0).matrix().inverse();
        const Vec3 eye = (back * want.eye->at.homogeneous()).head<3>();
        double near = 0, far = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double end = double(of.input[axis]) - 0.5;
            near = std::max({near, -0.5 - eye[axis], eye[axis] - end});
            far = std::max({far, end - eye[axis], eye[axis] + 0.5});
        }
        const double apart = far / near / of.density;
        std::int64_t rays = 0, beyond = 0;
        for (std::int64_t y = 0; y < of.screen.y; ++y)
            for (std::int64_t x = 0; x < of.screen.x; ++x) {
                const double value = *cast.at<float>(x, y, 0);
                ASSERT_EQ(value == want.miss, *got.at<float>(x, y, 0) == want.miss)
                    << x << ' ' << y;
                if (value == want.miss) continue;
                ++rays;
                // Curvatures are at most 0.02 and 0.014 across, of which the bilinear picture of
                // rays so far apart has 1/8 of both times the square; along a ray the sum of
                // samples errs by 1/12 of at most 0.25. At either end a sample may stand for 1.5
                // slices around a place 0.75 away, and values go by 0.36 a slice; slices are at
                // most so far apart along a ray.
                const double apart_along = std::sqrt(3) * of.spacing.maxCoeff();
                const double slices = *lengths.at<float>(x, y, 0) / apart_along;
                const double most = 0.034 / 8 * apart * apart + 0.25 / 12 +
                                    std::min(0.36, 2 * 1.5 * 0.75 * 0.36 / slices);
                const double error = std::abs(*got.at<float>(x, y, 0) - value);
                beyond += error > most;
                ASSERT_LT(error, 0.36) << x << ' ' << y;
            }
        EXPECT_GT(rays, 200);
        // Where rays begin to leave by another face, means have a kink: most where it is thin.
        EXPECT_LE(beyond, rays / 50) << of.distance;
    }
}

TEST(ShearWarpPerspective, FromAfarIsShearWarp) {
    const Extent n{31, 27, 35}, screen{61, 61, 61};
    const Data in = volume(n, wave);
    const Scene scene;
    for (const double degrees : {0.0, 20.0, 170.0})
        for (const Mode mode : {Mode::xray, Mode::mean, Mode::composite}) {
            // Slanted: others are read from neighbours of other lengths.
            if (degrees != 0 && mode != Mode::mean) continue;
            const Request want =
                seen_from({n, screen, turn(degrees, {3, -2, 1}), {1, 1, 1}, 1, 3e6}, mode);
            Request parallel = want;
            parallel.eye.reset();
            const Data got = made(shear_warp_perspective(), in, {want, scene}, by("foh"));
            const Data expected = made(shear_warp(), in, {parallel, scene}, {{"filter", "foh"}});
            const std::int64_t numbers = got.what.samples() * mode->channels;
            std::int64_t far = 0;
            for (std::int64_t i = 0; i < numbers; ++i)
                // Rays differ by 30 / 3e6 pixels, sums of 60 by rounding.
                far += !(std::abs(got.as<float>()[i] - expected.as<float>()[i]) < 1e-4);
            // Beside the shadow's rim one reads neighbours and the other does not.
            EXPECT_LE(double(far), degrees == 0 ? 0 : 0.05 * double(numbers)) << mode->name;
        }
}

TEST(ShearWarpPerspective, DensityBringsBackWhatFarSlicesLose) {
    // Stripes of two voxels in the farthest slices, three times as far away as the nearest.
    const Extent n{81, 81, 61};
    const Data in =
        volume(n, [](auto x, auto, auto z) { return z > 57 ? double(x / 2 % 2) : 0.0; });
    const Sight of{n, {91, 91, 80}, Matrix3d::Identity(), {1, 1, 1}, 1.5, 60};
    const Request want = seen_from(of, Mode::xray);
    const Scene scene;
    const Data cast = made(ray_cast(), in, {want, scene}, {{"filter", "foh"}, {"step", 0.25}});
    std::vector<double> errors;
    for (const double density : {1.0, 2.0, 4.0}) {
        const Data got = made(shear_warp_perspective(), in, {want, scene}, by("foh", density));
        double squares = 0;
        for (std::int64_t i = 0; i < got.what.samples(); ++i)
            squares += std::pow(got.as<float>()[i] - cast.as<float>()[i], 2);
        errors.push_back(std::sqrt(squares / double(got.what.samples())));
    }
    EXPECT_LT(errors[1], 0.7 * errors[0]);
    EXPECT_LT(errors[2], 0.6 * errors[1]);
}

TEST(ShearWarpPerspective, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41}, screen{101, 133, 60};
    std::mt19937 random(7);
    const Data in = volume(n, [&](auto...) { return double(random() % 256); });
    const Scene scene;
    for (const Mode mode : sliced_modes())
        for (const double degrees : {20.0, 47.0})
            for (const char* filter : {"foh", "zoh"}) {
                const Sight of{n, screen, turn(degrees, {3, -2, 1}), {1, 1, 1}, 1.8, 60};
                const Request want = seen_from(of, mode);
                const Ask ask{want, scene};
                const auto with = [&](std::size_t threads) {
                    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                    threads);
                    return made(shear_warp_perspective(), in, ask, by(filter));
                };
                const Data one = with(1);
                for (const std::size_t threads : {2u, 7u})
                    EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                             static_cast<std::size_t>(one.what.bytes())));
                for (const Region& box :
                     {Region{{13, 21, 0}, {90, 110, 1}}, Region{{50, 60, 0}, {51, 61, 1}},
                      Region{{0, 0, 0}, {3, 133, 1}}}) {
                    const Data part = made(shear_warp_perspective(), in, ask, box, by(filter));
                    const auto bytes = static_cast<std::size_t>(box.extent().x) * sizeof(float) *
                                       static_cast<std::size_t>(one.what.channels);
                    for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                        ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                                 one.at<float>(box.begin[0], y, 0), bytes))
                            << mode->name << ' ' << degrees << ' ' << y;
                }
            }
}

template <class T>
Data stored_as(Type type, const Data& floats) {
    Representation what = floats.what;
    what.type = type;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < what.samples(); ++i)
        data.as<T>()[i] = static_cast<T>(floats.as<float>()[i]);
    return data;
}

TEST(ShearWarpPerspective, AllTypesMakeThePictureOfTheirValues) {
    const Extent n{19, 23, 14};
    std::mt19937 random(7);
    const Data floats = volume(n, [&](auto...) { return double(random() % 100); });
    const Scene scene;
    std::vector<Data> all;
    all.push_back(stored_as<std::uint8_t>(Type::u8, floats));
    all.push_back(stored_as<std::int8_t>(Type::i8, floats));
    all.push_back(stored_as<std::uint16_t>(Type::u16, floats));
    all.push_back(stored_as<std::int16_t>(Type::i16, floats));
    all.push_back(stored_as<std::uint32_t>(Type::u32, floats));
    all.push_back(stored_as<std::int32_t>(Type::i32, floats));
    all.push_back(stored_as<double>(Type::f64, floats));
    for (const Matrix3d& way : {turn(10, {1, 2, 3}), turn(90, {1, 0, 0.1}), turn(90, {0, 1, 0.1})})
        for (const Mode mode : {Mode::mip, Mode::xray, Mode::composite}) {
            Request want = seen_from({n, {40, 40, 40}, way}, mode);
            want.transfer.points[1].value = 100;
            const Data expected = made(shear_warp_perspective(), floats, {want, scene}, by("foh"));
            for (const Data& in : all)
                EXPECT_EQ(
                    0,
                    std::memcmp(
                        expected.samples.data(),
                        made(shear_warp_perspective(), in, {want, scene}, by("foh")).samples.data(),
                        static_cast<std::size_t>(expected.what.bytes())))
                    << name_of(in.what.type);
            // value = 50 - stored / 2: exact in f32.
            Data turned = stored_as<std::int16_t>(Type::i16, floats);
            turned.what.values = {.slope = -0.5, .offset = 50};
            for (std::int64_t i = 0; i < n.samples(); ++i)
                turned.as<std::int16_t>()[i] =
                    static_cast<std::int16_t>(100 - 2 * floats.as<float>()[i]);
            const Data got = made(shear_warp_perspective(), turned, {want, scene}, by("foh"));
            for (std::int64_t i = 0; i < got.what.samples() * mode->channels; ++i)
                ASSERT_NEAR(got.as<float>()[i], expected.as<float>()[i],
                            mode == Mode::xray ? 0.02 : 1e-4);
        }
}

TEST(ShearWarpPerspective, ThinAndSmallVolumesAndGaps) {
    const Scene scene;
    for (const Extent& n : {Extent{1, 1, 1},
                            {1, 20, 20},
                            {20, 1, 20},
                            {20, 20, 1},
                            {2, 2, 2},
                            {50, 1, 1},
                            {1, 1, 50}}) {
        const Data in = volume(n, [](auto x, auto y, auto z) { return double(x + 2 * y + 3 * z); });
        for (const double degrees : {0.0, 33.0, 90.0})
            for (const Mode mode : sliced_modes()) {
                const Sight of{n, {61, 63, 61}, turn(degrees, {1, 2, 3}), {1, 1, 1}, 1.3, 70};
                const Request want = seen_from(of, mode);
                const Data got = made(shear_warp_perspective(), in, {want, scene}, by("foh"));
                const Data cast =
                    made(ray_cast(), in, {want, scene}, {{"filter", "foh"}, {"step", 0.25}});
                std::int64_t differ = 0;
                for (std::int64_t y = 0; y < 63; ++y)
                    for (std::int64_t x = 0; x < 61; ++x) {
                        ASSERT_TRUE(std::isfinite(*got.at<float>(x, y, 0)));
                        const int last = mode->channels - 1;  // opacity
                        const auto empty = [&](const Data& of_all) {
                            const float value = of_all.at<float>(x, y, 0)[last];
                            return mode->divides || mode->extreme != 0 ? value == -1 : false;
                        };
                        differ += empty(got) != empty(cast);
                    }
                EXPECT_LE(differ, 1) << mode->name << ' ' << n.x << ' ' << n.y << ' ' << n.z;
            }
    }
    // What is not finite stays with itself.
    const Extent n{20, 21, 22};
    std::mt19937 random(3);
    Data gaps = volume(n, wave);
    for (int i = 0; i < 600; ++i)
        gaps.as<float>()[random() % static_cast<std::uint32_t>(n.samples())] =
            i % 2 ? std::numeric_limits<float>::quiet_NaN()
                  : std::numeric_limits<float>::infinity();
    for (const Mode mode : sliced_modes()) {
        const Request want = seen_from({n, {40, 40, 40}, turn(25, {1, 2, 3})}, mode);
        const Data got = made(shear_warp_perspective(), gaps, {want, scene}, by("zoh"));
        for (std::int64_t i = 0; i < got.what.samples() * mode->channels; ++i)
            ASSERT_TRUE(std::isfinite(got.as<float>()[i])) << mode->name;
    }
}

TEST(ShearWarpPerspective, CountsSlicesAsTheyShrink) {
    Representation what;
    what.extent = {64, 64, 64};
    const Scene scene;
    const auto work = [&](double distance, double density) {
        const Sight of{what.extent, {112, 112, 112}, turn(5, {1, 0, 0}), {1, 1, 1}, 1, distance};
        const Request want = seen_from(of, Mode::mip);
        const Ask ask{want, scene};
        const Offer offer = shear_warp_perspective().offer(what, ask, by("foh", density));
        EXPECT_EQ(offer.refused, "");
        EXPECT_FALSE(shear_warp_perspective().error_of(offer, ask).known);
        return shear_warp_perspective().work(offer, ask, 0);
    };
    const double voxels = 64 * 64 * 64;
    const Work far = work(1e6, 1), near = work(100, 1), fine = work(100, 2);
    EXPECT_GT(far.gathers, voxels);
    EXPECT_LT(far.gathers, 1.3 * voxels);
    EXPECT_LT(near.gathers, 0.8 * far.gathers);
    EXPECT_GT(fine.gathers, 3 * near.gathers);
    EXPECT_GT(fine.workspace, 3 * near.workspace);
}

TEST(ShearWarpPerspective, RefusesWhatItCannotDo) {
    const Extent n{20, 21, 22};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto refused = [&](const Request& want, const std::string& filter = "foh") {
        return shear_warp_perspective().offer(what, {want, scene}, by(filter)).refused;
    };
    const auto expect = [&](const Request& want, const std::string& reason,
                            const std::string& filter = "foh") {
        const std::string said = refused(want, filter);
        EXPECT_NE(said.find(reason), std::string::npos) << said;
    };
    const auto plain = [&](Mode mode) {
        return seen_from({n, {40, 40, 40}, turn(20, {1, 2, 3})}, mode);
    };
    for (const Mode mode : modes())
        EXPECT_EQ(refused(plain(mode)).empty(), !mode->first_hit && mode->sampled_every == 0)
            << mode->name;
    Request want = plain(Mode::mip);
    want.eye.reset();
    expect(want, "parallel");
    expect(seen_from({n, {40, 40, 40}, turn(20, {1, 2, 3}), {1, 1, 1}, 1, 5}, Mode::mip),
           "inside the volume");
    expect(seen_from({n, {80, 80, 40}, turn(0, {1, 2, 3}), {1, 1, 1}, 1, 11.3}, Mode::mip),
           "0.3 voxels away from the volume; at least 1");
    EXPECT_EQ(
        refused(seen_from({n, {80, 80, 40}, turn(0, {1, 2, 3}), {1, 1, 1}, 1, 13}, Mode::mip)), "");
    want = plain(Mode::composite);
    want.shading.by = Shade::phong;
    expect(want, "light");
    want = plain(Mode::composite);
    want.clips.resize(1);
    expect(want, "clip");
    want = plain(Mode::mip);
    want.field = Field::nearest;
    expect(want, "labels");
    EXPECT_EQ(refused(want, "zoh"), "");
    scene.non_finite = 3;
    expect(plain(Mode::mip), "3 samples are not finite");
    EXPECT_EQ(refused(plain(Mode::mip), "zoh"), "");
    scene.non_finite = 0;
    want = plain(Mode::mip);
    want.job = Job::warp;
    expect(want, "volume");
}

}  // namespace
}  // namespace edgewise
