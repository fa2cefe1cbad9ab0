// Orders of convergence of the quadratures of composites (Etiene and others, "Verifying volume
// rendering using discretization error analysis", 2014): in the step, in the grid, in the pixel.
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <oneapi/tbb/global_control.h>
#include <string>
#include <vector>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/preintegrated_quadratic_cast.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/trapezoid_cast.hpp"

namespace edgewise {
namespace {

using looking::made;
using looking::seen;
using looking::turn;
using looking::volume;

struct Rule {
    Transition edge;
    double order;  // in the step, where all is smooth
};

std::vector<Rule> rules() {
    return {{ray_cast(), 2},
            {trapezoid_cast(), 2},
            {preintegrated_cast(), 2},
            {preintegrated_quadratic_cast(), 4}};
}

Parameters by(double step, const std::string& filter = "foh") {
    return {{"filter", filter}, {"step", step}};
}

/// Red, green, blue and opacity.
using Pixel = std::array<double, 4>;
/// Optical depth per t, and colour, at a place in input indices.
using Medium = std::function<Pixel(const Vec3& index)>;

Medium medium(const Transfer& transfer, std::function<double(const Vec3&)> value) {
    return [transfer, value](const Vec3& index) {
        const std::array<double, 4> at = transfer.at(value(index));  // opacity in [3]
        return Pixel{-std::log1p(-at[3]) / transfer.unit, at[0], at[1], at[2]};
    };
}

/// Parallel rays of a request's first view, in f64.
class Rays {
 public:
    explicit Rays(const Request& want) : back_(want.views.at(0).matrix().inverse()) {
        for (int axis = 0; axis < 3; ++axis) high_[axis] = double(want.input[axis]) - 0.5;
        if (const Clip* clip = want.clip(0)) {
            low_ = clip->low;
            high_ = clip->high;
        }
    }

    Vec3 at(double x, double y, double t) const {
        return (back_ * Eigen::Vector4d(x, y, t, 1)).head<3>();
    }
    /// Where a ray is in the data.
    std::array<double, 2> inside(double x, double y) const {
        const Vec3 origin = at(x, y, 0), along = at(x, y, 1) - origin;
        double low = -1e30, high = 1e30;
        for (int axis = 0; axis < 3; ++axis) {
            const double near = (low_[axis] - origin[axis]) / along[axis],
                         far = (high_[axis] - origin[axis]) / along[axis];
            low = std::max(low, std::min(near, far));
            high = std::min(high, std::max(near, far));
        }
        return {low, std::max(low, high)};
    }
    /// The light of a ray, by Riemann sums extrapolated once.
    Pixel light(double x, double y, const Medium& medium, double cells_per_t = 40) const {
        const auto [low, high] = inside(x, y);
        const int cells = 1 + int(cells_per_t * (high - low));
        const Pixel coarse = sum(x, y, low, high, cells, medium),
                    fine = sum(x, y, low, high, 2 * cells, medium);
        Pixel light;
        for (std::size_t c = 0; c < 4; ++c) light[c] = (4 * fine[c] - coarse[c]) / 3;
        return light;
    }

 private:
    Pixel sum(double x, double y, double low, double high, int cells, const Medium& medium) const {
        Pixel light{};
        double left = 1;
        const double width = (high - low) / cells;
        for (int i = 0; i < cells; ++i) {
            const Pixel here = medium(at(x, y, low + (i + 0.5) * width));
            const double caught = -left * std::expm1(-here[0] * width);
            for (std::size_t c = 0; c < 3; ++c) light[c] += caught * here[c + 1];
            left -= caught;
        }
        light[3] = 1 - left;
        return light;
    }

    Vec3 low_ = Vec3::Constant(-0.5), high_;
    Mat4 back_;
};

Pixel pixel_of(const Data& picture, std::int64_t x, std::int64_t y) {
    const float* p = picture.at<float>(x, y, 0);
    return {double(p[0]), double(p[1]), double(p[2]), double(p[3])};
}

std::vector<Pixel> truth_of(const Request& want, const Medium& medium) {
    const Rays rays(want);
    std::vector<Pixel> truth;
    for (std::int64_t y = 0; y < want.screen.y; ++y)
        for (std::int64_t x = 0; x < want.screen.x; ++x)
            truth.push_back(rays.light(double(x), double(y), medium));
    return truth;
}

double rms_error(const Data& picture, const std::vector<Pixel>& truth) {
    double squares = 0;
    std::size_t i = 0;
    for (std::int64_t y = 0; y < picture.what.extent.y; ++y)
        for (std::int64_t x = 0; x < picture.what.extent.x; ++x, ++i) {
            const Pixel got = pixel_of(picture, x, y);
            for (std::size_t c = 0; c < 4; ++c) squares += std::pow(got[c] - truth[i][c], 2);
        }
    return std::sqrt(squares / (4 * double(truth.size())));
}

/// Of errors at one refinement after the other.
void expect_order(const std::vector<double>& errors, double order, const std::string& name,
                  double refinement = 2) {
    std::string all;
    for (const double error : errors) all += fmt::format("{:.3g} ", error);
    testing::Test::RecordProperty(name, all);
    for (std::size_t i = 1; i < errors.size(); ++i)
        EXPECT_NEAR(std::log(errors[i - 1] / errors[i]) / std::log(refinement), order, 0.2)
            << name << ": " << all;
}

/// Keeps what lies between two faces along each axis.
Clip between_faces(const Extent& n, const Vec3& low, const Vec3& high) {
    std::vector<HalfSpace> planes;
    for (int axis = 0; axis < 3; ++axis) {
        planes.push_back({Vec3::Unit(axis), -low[axis]});
        planes.push_back({-Vec3::Unit(axis), high[axis]});
    }
    return clip_of(n, planes);
}

Transfer faint_to_strong(double opacity, double unit = 1) {
    Transfer transfer;
    transfer.points = {{0, 0, {1, 0.1, 0.6}}, {1, opacity, {0, 0.9, 0.6}}};
    transfer.unit = unit;
    return transfer;
}

/// Coefficients of a cubic B-spline: a field without kinks, 0 beside the faces, and its medium.
struct Smooth {
    static constexpr Extent kInput{24, 24, 24};
    Data data;
    Medium of;

    explicit Smooth(const Transfer& transfer)
        : data(volume(kInput, [](std::int64_t x, std::int64_t y, std::int64_t z) {
              const auto window = [](std::int64_t i) {
                  return i < 3 || i > 20 ? 0 : std::pow(std::sin((double(i) - 2) / 19 * M_PI), 2);
              };
              return window(x) * window(y) * window(z) *
                     (0.55 + 0.45 * std::sin(0.35 * double(x) + 0.2 * double(y) - 0.4 * double(z)));
          })) {
        data.what.content = "coefficients";
        of = medium(transfer, [grid = kernels::grid_of(data)](const Vec3& p) {
            return kernels::sampled(grid, kernels::Hold::bspline3, {p[0], p[1], p[2]});
        });
    }
    Smooth(const Smooth&) = delete;
    Smooth& operator=(const Smooth&) = delete;
};

Request aslant(const Extent& input, const Extent& screen, double zoom) {
    return seen(Mode::composite, input, screen, turn(33, Vec3(3, -2, 1)), Vec3::Ones(), zoom);
}

/// A value that goes evenly with z, so that no sampler has an error, and a function whose optical
/// depth does not. Only where both go on: no kink is met. Rays enter at places of all phases.
TEST(Quadratures, HaveTheirOrderInTheStep) {
    const Extent n{12, 12, 12};
    const Data in = volume(n, [](auto, auto, std::int64_t z) { return (double(z) - 1) / 10; });
    std::vector<Request> views;
    for (const int depth : {20, 21, 22, 23}) {
        Request want =
            seen(Mode::composite, n, {9, 9, depth}, turn(15, Vec3(3, -2, 1)), Vec3::Ones(), 3);
        want.transfer = faint_to_strong(0.9);
        want.clips = {between_faces(n, Vec3(-0.5, -0.5, 2), Vec3(11.5, 11.5, 10))};
        views.push_back(want);
    }
    const Scene scene;
    for (const Rule& rule : rules()) {
        // Of fourth order f32 leaves less room: it is off by some 1e-7.
        const bool fourth = rule.order > 2;
        const double refinement = fourth ? std::sqrt(2.0) : 2;
        std::vector<double> errors;
        for (int level = 0; level < 3; ++level) {
            const double step = (fourth ? 2 : 0.5) * std::pow(refinement, -level);
            double squares = 0;
            for (const Request& want : views) {
                const Medium truly =
                    medium(want.transfer, [](const Vec3& p) { return (p[2] - 1) / 10; });
                squares += std::pow(
                    rms_error(made(rule.edge, in, {want, scene}, by(step)), truth_of(want, truly)),
                    2);
            }
            errors.push_back(std::sqrt(squares / 4));
        }
        expect_order(errors, rule.order, rule.edge.name + " step", refinement);
    }
}

/// What all rules make of samples of waves, at a step of a sample, in the middle of the data: their
/// errors. Coefficients of a wave's spline are known without a prefilter, and nothing has a border.
struct Grids {
    std::vector<double> linear, spline;

    explicit Grids(int n) {
        const double turns = 2 * M_PI / n;
        const auto wave = [turns](const Vec3& index) {
            const Vec3 at = turns * (index + Vec3::Constant(0.5));
            return std::sin(at[0]) * std::cos(at[1]) * std::sin(at[2] + 0.7);
        };
        const auto samples = [&](double times) {
            return volume({n, n, n}, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                return 0.5 + 0.45 * times * wave(Vec3(double(x), double(y), double(z)));
            });
        };
        Request want = aslant({n, n, n}, {8, 8, 2 * n}, 16.0 / n);
        want.transfer = faint_to_strong(0.8, n / 8.0);
        want.clips = {between_faces({n, n, n}, Vec3::Constant(n / 4.0 - 0.5),
                                    Vec3::Constant(3 * n / 4.0 - 0.5))};
        const Medium truly =
            medium(want.transfer, [&](const Vec3& p) { return 0.5 + 0.45 * wave(p); });
        const Rays rays(want);
        std::vector<Pixel> truth;
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) truth.push_back(rays.light(x, y, truly, 1600.0 / n));
        const Data linear_field = samples(1);
        // At samples a spline has (1, 4, 1) / 6 of its coefficients, along each axis.
        Data spline_field = samples(std::pow(3 / (2 + std::cos(turns)), 3));
        spline_field.what.content = "coefficients";
        const Scene scene;
        const Ask ask{want, scene};
        for (const Rule& rule : rules()) {
            linear.push_back(rms_error(made(rule.edge, linear_field, ask, by(1)), truth));
            spline.push_back(
                rms_error(made(rule.edge, spline_field, ask, by(1, "bspline3")), truth));
        }
    }
};

/// Trilinear interpolation is of second order, whatever the quadrature; cubic splines are of
/// fourth, which 64 samples bring to the roundings of f32.
TEST(Quadratures, HaveTheirOrderInTheGrid) {
    std::vector<Grids> at;
    for (const int n : {8, 16, 32, 64, 128}) at.emplace_back(n);
    for (std::size_t r = 0; r < rules().size(); ++r) {
        const Rule rule = rules()[r];
        expect_order({at[1].linear[r], at[2].linear[r], at[3].linear[r], at[4].linear[r]}, 2,
                     rule.edge.name + " grid, linear");
        std::vector<double> spline;
        for (std::size_t i = rule.order > 2 ? 0 : 2; i < (rule.order > 2 ? 3 : 5); ++i)
            spline.push_back(at[i].spline[r]);
        expect_order(spline, rule.order, rule.edge.name + " grid, spline");
    }
}

/// The integral of the picture over a window in it: rays are its samples, in the middles of pixels.
TEST(Quadratures, HaveTheirOrderInThePixel) {
    constexpr double kWindow = 9;  // [sample]
    const Transfer transfer = faint_to_strong(0.9, 2);
    const Smooth smooth(transfer);
    const auto window = [&](int pixels) {
        Request want = aslant(Smooth::kInput, {pixels, pixels, 40}, pixels / kWindow);
        want.transfer = transfer;
        return want;
    };
    // Its mean, by Gauss's three points along both axes of squares.
    constexpr int kSquares = 8;
    const Request squares = window(kSquares);
    const Rays rays(squares);
    const double apart = std::sqrt(0.6) / 2;
    Pixel truth{};
    for (int j = 0; j < 3 * kSquares; ++j)
        for (int i = 0; i < 3 * kSquares; ++i) {
            const double weight = (i % 3 == 1 ? 8 : 5) * (j % 3 == 1 ? 8 : 5) / 324.0;
            const Pixel light =
                rays.light(i / 3 + (i % 3 - 1) * apart, j / 3 + (j % 3 - 1) * apart, smooth.of, 10);
            for (std::size_t c = 0; c < 4; ++c) truth[c] += weight * light[c] / 64;
        }
    const Scene scene;
    for (const Rule& rule : rules()) {
        std::vector<double> errors;
        for (const int pixels : {6, 12, 24}) {
            const Request want = window(pixels);
            const Data picture =
                made(rule.edge, smooth.data, {want, scene}, by(1.0 / 32, "bspline3"));
            Pixel mean{};
            for (std::int64_t y = 0; y < pixels; ++y)
                for (std::int64_t x = 0; x < pixels; ++x)
                    for (std::size_t c = 0; c < 4; ++c)
                        mean[c] += pixel_of(picture, x, y)[c] / (pixels * pixels);
            double square = 0;
            for (std::size_t c = 0; c < 4; ++c) square += std::pow(mean[c] - truth[c], 2);
            errors.push_back(std::sqrt(square / 4));
        }
        expect_order(errors, 2, rule.edge.name + " pixel");
    }
}

/// One medium: 1 - exp(-depth) of the length in it, and its colour, however a ray is cut.
TEST(Quadratures, OfOneMediumAreExactAtAnyStep) {
    const Scene scene;
    const auto expect_exact = [&](const Extent& n, const Vec3& spacing, double opacity,
                                  const std::string& filter, bool varied) {
        Request want = seen(Mode::composite, n, {13, 11, 20}, turn(38, Vec3(1, 2, -1)), spacing);
        want.transfer.points = {{0, opacity, {0.25, 0.5, 1}}, {4, opacity, {0.25, 0.5, 1}}};
        want.transfer.unit = 1.5;
        const Rays rays(want);
        Data in = volume(n, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
            return varied ? double((x + 2 * y + 3 * z) % 5) : 1.25;
        });
        if (filter == "bspline3") in.what.content = "coefficients";
        for (const Rule& rule : rules())
            for (const double step : {3.7, 2.0, 1.0, 0.6, 0.13}) {
                const Data got = made(rule.edge, in, {want, scene}, by(step, filter));
                for (std::int64_t y = 0; y < want.screen.y; ++y)
                    for (std::int64_t x = 0; x < want.screen.x; ++x) {
                        const auto [low, high] = rays.inside(double(x), double(y));
                        const double depth = -std::log1p(-opacity) / 1.5 * (high - low);
                        const double most = -std::expm1(-depth);
                        const Pixel pixel = pixel_of(got, x, y);
                        // What is left is rounded to 2^-25 at each of many pieces; a ray ends below
                        // 1/4096. A table of f32 sums, 4096 cells long, is off by 2^-13 of a piece
                        // that is as short as two cells.
                        double within = std::max(1e-6, 2 * (high - low) / step * 0x1p-25) +
                                        (most > 0.999 ? 1.0 / 4096 : 0);
                        if (varied && rule.edge.name == preintegrated_cast().name)
                            within += 0x1p-13 * depth * std::exp(-depth);
                        const std::string where =
                            fmt::format("{} step {} {} {} at {} {}", rule.edge.name, step, filter,
                                        opacity, x, y);
                        ASSERT_NEAR(pixel[3], most, within) << where;
                        ASSERT_NEAR(pixel[0], 0.25 * most, within) << where;
                        ASSERT_NEAR(pixel[2], most, within) << where;
                    }
            }
    };
    for (const double opacity : {1e-5, 0.03, 0.4, 0.97})
        for (const bool varied : {false, true}) {
            expect_exact({9, 7, 11}, Vec3::Ones(), opacity, "foh", varied);
            expect_exact({9, 7, 11}, Vec3(1, 1.7, 1.2), opacity, "bspline3", varied);
            expect_exact({9, 7, 1}, Vec3::Ones(), opacity, "zoh", varied);
            expect_exact({1, 1, 1}, Vec3(1, 1, 4), opacity, "foh", varied);
        }
    // What is opaque hides all, in the shortest piece.
    for (const Rule& rule : rules()) {
        const Extent n{5, 5, 5};
        Request want = seen(Mode::composite, n, {3, 3, 9}, turn(10, Vec3(1, 2, -1)));
        want.transfer.points = {{0, 1, {1, 1, 1}}, {4, 1, {1, 1, 1}}};
        want.transfer.unit = 300;
        const Data in = volume(n, [](auto, auto, auto) { return 2.0; });
        const Data got = made(rule.edge, in, {want, scene}, by(0.25));
        EXPECT_EQ(pixel_of(got, 1, 1), (Pixel{1, 1, 1, 1})) << rule.edge.name;
    }
}

/// A colour that goes evenly with depth, in a medium of one opacity: what attenuation within a
/// piece does has a closed form. Steps whose samples meet the outermost centres, where it stops.
TEST(Quadratures, AttenuateWithinPieces) {
    const Extent n{3, 3, 16};
    const Data in = volume(n, [](auto, auto, std::int64_t z) { return double(z); });
    Request want = seen(Mode::composite, n, {3, 3, 16}, Eigen::Matrix3d::Identity());
    const double opacity = 0.3, kappa = -std::log1p(-opacity);
    want.transfer.points = {{0, opacity, {0, 0, 1}}, {15, opacity, {1, 0, 1}}};
    const auto until = [&](double z) { return -std::exp(-kappa * (z + 0.5)); };
    // Of the integral of z kappa exp(-kappa (z + 1/2)), and of light from behind the last centre.
    const double inner = (15 + 1 / kappa) * until(15) - 1 / kappa * until(0);
    const double red = inner / 15 + until(15.5) - until(15);
    const Scene scene;
    for (const double step : {1.0, 1.0 / 3}) {
        const auto got = [&](const Transition& edge) {
            return pixel_of(made(edge, in, {want, scene}, by(step)), 1, 1)[0];
        };
        // One quadratic is exact, up to f32. Others give a piece of depth d the colour of its
        // middle; what is seen lies coth(d / 2) - 2 / d of half a piece nearer, which is d / 6 up
        // to 0.2 %.
        EXPECT_NEAR(got(preintegrated_quadratic_cast()), red, 2e-6) << step;
        const double alike =
            kappa * step * step / 12 / 15 * std::exp(-kappa / 2) * -std::expm1(-15 * kappa);
        EXPECT_NEAR(got(preintegrated_cast()) - red, alike, 0.01 * alike + 2e-6) << step;
        EXPECT_NEAR(got(trapezoid_cast()) - red, alike, 0.01 * alike + 2e-6) << step;
    }
}

/// A narrow function between samples: integrated it is seen, at its ends it is not.
TEST(Quadratures, SeeBandsBetweenSamplesOrNot) {
    const Extent n{4, 4, 24};
    const Data in = volume(n, [](auto, auto, std::int64_t z) { return double(z); });
    Request want = seen(Mode::composite, n, {4, 4, 24}, Eigen::Matrix3d::Identity());
    want.transfer.points = {{12.3, 0, {1, 1, 1}},
                            {12.31, 0.9, {1, 1, 1}},
                            {12.49, 0.9, {1, 1, 1}},
                            {12.5, 0, {1, 1, 1}}};
    const Rays rays(want);
    const Pixel truth = rays.light(
        1, 1, medium(want.transfer, [](const Vec3& p) { return std::clamp(p[2], 0.0, 23.0); }),
        4000);
    const Scene scene;
    for (const double step : {0.5, 1.0, 2.0, 3.7}) {
        const Data seen_at = made(preintegrated_quadratic_cast(), in, {want, scene}, by(step));
        // Cells of the table are 1/20480 wide, and what is taken in a cell's middle is off by less
        // than a cell of opacity 0.9 at either end; the value is even between all samples.
        EXPECT_NEAR(pixel_of(seen_at, 1, 1)[3], truth[3], 5e-4) << step;
        const Data missed = made(trapezoid_cast(), in, {want, scene}, by(step));
        if (step == 1) {
            EXPECT_EQ(pixel_of(missed, 1, 1)[3], 0);
        }
    }
}

bool same_bytes(const Data& a, const Data& b, std::int64_t x, std::int64_t y) {
    return std::memcmp(a.at<float>(x, y, 0), b.at<float>(x, y, 0), 4 * sizeof(float)) == 0;
}

TEST(Quadratures, LeaveOutWhatIsNoNumber) {
    const Extent n{20, 20, 20};
    const auto wave = [](std::int64_t x, std::int64_t y, std::int64_t z) {
        return looking::wave(double(x), double(y), double(z));
    };
    const Data clean = volume(n, wave);
    Data holed = volume(n, wave);
    for (const float hole :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        *holed.at<float>(10, 9, 4) = hole;
        Request want = aslant(n, {40, 40, 30}, 1.5);
        want.transfer = faint_to_strong(0.2);
        Scene scene;
        scene.non_finite = 1;
        const Rays rays(want);
        for (const Rule& rule : rules()) {
            const Data got = made(rule.edge, holed, {want, scene}, by(1)),
                       all = made(rule.edge, clean, {want, scene}, by(1));
            int differ = 0;
            for (std::int64_t y = 0; y < 40; ++y)
                for (std::int64_t x = 0; x < 40; ++x) {
                    const Pixel pixel = pixel_of(got, x, y);
                    for (const double c : pixel) ASSERT_TRUE(c >= 0 && c <= 1) << rule.edge.name;
                    const Vec3 from = rays.at(double(x), double(y), 0),
                               along = rays.at(double(x), double(y), 1) - from;
                    const Vec3 off = Vec3(10, 9, 4) - from;
                    const double away =
                        (off - off.dot(along) * along).norm();  // along has length 1
                    if (away > std::sqrt(3.0)) {
                        ASSERT_TRUE(same_bytes(got, all, x, y)) << rule.edge.name;
                    }
                    differ += !same_bytes(got, all, x, y);
                }
            EXPECT_GT(differ, 0) << rule.edge.name;
        }
    }
}

TEST(Quadratures, TakeOddShapesAndEyes) {
    const Scene scene;
    const Vec3 far(5, 4, -60);
    for (const Extent& n : {Extent{1, 1, 1}, Extent{17, 1, 3}, Extent{2, 3, 40}, Extent{30, 30, 1}})
        for (const bool from_eye : {false, true})
            for (const Rule& rule : rules()) {
                Request want = aslant(n, {11, 9, 30}, 1.1);
                want.transfer = faint_to_strong(0.3);
                if (from_eye) want.eye = Eye{.at = far, .plane = 0};
                const Data in = volume(n, [](std::int64_t x, std::int64_t y, std::int64_t z) {
                    return looking::wave(double(x), double(y), double(z));
                });
                // All go to the same picture.
                const Data got = made(rule.edge, in, {want, scene}, by(0.02)),
                           fine = made(ray_cast(), in, {want, scene}, by(0.01));
                for (std::int64_t y = 0; y < 9; ++y)
                    for (std::int64_t x = 0; x < 11; ++x)
                        for (std::size_t c = 0; c < 4; ++c)
                            ASSERT_NEAR(pixel_of(got, x, y)[c], pixel_of(fine, x, y)[c], 2e-5)
                                << rule.edge.name << ' ' << n.x << ' ' << from_eye;
            }
}

TEST(Quadratures, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{37, 29, 41};
    const Data in = volume(n, [](std::int64_t x, std::int64_t y, std::int64_t z) {
        return looking::wave(double(x), double(y), double(z));
    });
    Request want = aslant(n, {131, 97, 80}, 2);
    want.transfer = faint_to_strong(0.3);
    const Scene scene;
    for (const Rule& rule : rules()) {
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(rule.edge, in, {want, scene}, by(1));
        };
        const Data one = with(1), seven = with(7);
        const Region box{{50, 13, 0}, {111, 66, 1}};
        const Data part = made(rule.edge, in, {want, scene}, box, by(1));
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                ASSERT_TRUE(same_bytes(seven, one, x, y)) << rule.edge.name << ' ' << x << ' ' << y;
                const bool inside = x >= 50 && x < 111 && y >= 13 && y < 66;
                ASSERT_TRUE(!inside || same_bytes(part, one, x, y)) << rule.edge.name << ' ' << x;
            }
    }
}

TEST(Quadratures, SayWhatTheyCannot) {
    const Extent n{8, 8, 8};
    const Data in = volume(n, [](auto, auto, auto) { return 1.0; });
    const Scene scene;
    const auto refusal = [&](const Transition& edge, const Request& want) {
        return edge.offer(in.what, {want, scene}, by(1)).refused;
    };
    for (const Transition& edge : {trapezoid_cast(), preintegrated_quadratic_cast()}) {
        EXPECT_TRUE(edge.on_demand);
        Request want = aslant(n, {9, 9, 9}, 1);
        want.transfer = faint_to_strong(0.3);
        EXPECT_EQ(refusal(edge, want), "");
        Request other = want;
        other.mode = Mode::mip;
        EXPECT_NE(refusal(edge, other).find("transfer function"), std::string::npos);
        other = want;
        other.shading.by = Shade::phong;
        EXPECT_NE(refusal(edge, other).find("light differs"), std::string::npos);
        other = want;
        other.cue = DepthCue{0.1};
        EXPECT_NE(refusal(edge, other).find("falls off"), std::string::npos);
        other = want;
        other.transfer.edges = {{0, 0}, {1, 1}};
        EXPECT_NE(refusal(edge, other).find("gradients"), std::string::npos);
    }
}

}  // namespace
}  // namespace edgewise
