#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/shear.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise::kernels {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

std::vector<float> scratch_of(const ShearPass& pass) {
    return std::vector<float>(shear_scratch(pass) + 16);
}

float* aligned(std::vector<float>& scratch) {
    const auto address = reinterpret_cast<std::uintptr_t>(scratch.data());
    return scratch.data() + (64 - address % 64) % 64 / 4;
}

/// Value of the interpolating cubic B-spline of a mirrored line, from a dense solve in f64.
class Spline {
 public:
    explicit Spline(const Eigen::VectorXd& samples) : n_(samples.size()) {
        Eigen::MatrixXd taps = Eigen::MatrixXd::Zero(n_, n_);
        for (int i = 0; i < n_; ++i) {
            taps(i, mirror(i - 1)) += 1.0 / 6;
            taps(i, i) += 4.0 / 6;
            taps(i, mirror(i + 1)) += 1.0 / 6;
        }
        coefficients_ = taps.partialPivLu().solve(samples);
    }
    double operator()(double at) const {
        double sum = 0;
        for (int i = int(std::floor(at)) - 1; i <= int(std::floor(at)) + 2; ++i) {
            const double d = std::abs(at - i);
            const double weight = d < 1   ? 2.0 / 3 - d * d * (2 - d) / 2
                                  : d < 2 ? (2 - d) * (2 - d) * (2 - d) / 6
                                          : 0;
            sum += weight * coefficients_[mirror(i)];
        }
        return sum;
    }

 private:
    int mirror(int i) const {
        if (n_ == 1) return 0;
        const int period = 2 * n_ - 2;
        i = (i % period + period) % period;
        return i < n_ ? i : period - i;
    }
    int n_;
    Eigen::VectorXd coefficients_;
};

double line_value(const Eigen::VectorXd& line, double at, const Filter& filter) {
    at = std::clamp(at, 0.0, double(line.size() - 1));
    if (filter.coefficients) return Spline(line)(at);
    if (filter.taps > 2) {
        std::array<double, 8> weights{};
        filter.weights(at - std::floor(at), weights.data());
        double sum = 0;
        for (int tap = 0; tap < filter.taps; ++tap)
            sum += weights[tap] *
                   line[std::clamp(int(at) + tap + 1 - filter.taps / 2, 0, int(line.size()) - 1)];
        return sum;
    }
    const int cell = std::min(int(at), std::max(int(line.size()) - 2, 0));
    const int next = std::min(cell + 1, int(line.size()) - 1);
    return line[cell] + (at - cell) * (line[next] - line[cell]);
}

TEST(ShearPass, EveryLineIsResampledAtItsOwnShift) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> value(-1, 1);
    for (const Filter& filter : filters())
        for (int axis = 0; axis < 3 && filter.taps > 1; ++axis)
            for (int n : {1, 2, 3, 17, 40}) {
                const Hold hold = hold_of(filter);
                ShearPass pass;
                pass.filter = &filter;
                pass.from = {{-3, 2, -5}, {-3 + 19, 2 + 21, -5 + 9}};
                pass.from.end[axis] = pass.from.begin[axis] + n;
                pass.shear = {.axis = axis, .by = {0.37, -0.81, 0.55}, .offset = 1.3};
                pass.shear.by[axis] = 0;
                pass.to = pass.from;
                pass.to.begin[axis] -= 20;
                pass.to.end[axis] += 23;
                const Extent in = pass.from.extent(), out = pass.to.extent();
                std::vector<float> samples(in.samples() + 16);
                for (float& sample : samples) sample = value(random);
                std::vector<float> moved(out.samples(), kNone), scratch = scratch_of(pass);
                const Grid grid{samples.data(), Type::f32, in, 1, {2, 0.5}};
                run_shear_pass(pass, grid, moved.data(), pass.to, hold, pass.to, aligned(scratch));

                for (std::int64_t z = 0; z < out.z; ++z)
                    for (std::int64_t y = 0; y < out.y; ++y)
                        for (std::int64_t x = 0; x < out.x; ++x) {
                            if ((x + y + z) % 7) continue;  // the dense solves take their time
                            std::array<std::int64_t, 3> at = {x, y, z};
                            std::array<double, 3> place;
                            for (int i = 0; i < 3; ++i) place[i] = double(at[i] + pass.to.begin[i]);
                            place[axis] = 0;
                            const double shift = pass.shear.step(place);
                            const double p = double(at[axis] + pass.to.begin[axis]) - shift -
                                             double(pass.from.begin[axis]);
                            Eigen::VectorXd line(n);
                            for (at[axis] = 0; at[axis] < n; ++at[axis])
                                line[at[axis]] =
                                    2 * samples[(at[2] * in.y + at[1]) * in.x + at[0]] + 0.5;
                            const float got = moved[(z * out.y + y) * out.x + x];
                            // Samples to 2.5 in f32, weights to a few units of 2^-24.
                            ASSERT_NEAR(got, line_value(line, p, filter), 4e-6) << axis << ' ' << n;
                        }
            }
}

TEST(ShearPass, StoredTypesAreReadAsValues) {
    for (int axis = 0; axis < 3; ++axis)
        for (const Hold hold : {Hold::foh, Hold::bspline3}) {
            const Extent extent{21, 18, 5};
            std::vector<std::uint8_t> bytes(extent.samples() + kSlack);
            std::vector<float> floats(bytes.size());
            for (std::size_t i = 0; i < bytes.size(); ++i) floats[i] = bytes[i] = (i * 37) & 255;
            ShearPass pass{.shear = {.axis = axis, .by = {}, .offset = 0.25},
                           .from = Region::all(extent),
                           .to = Region::all(extent)};
            pass.shear.by[(axis + 1) % 3] = 0.4;
            std::vector<float> scratch = scratch_of(pass), a(extent.samples()), b(a.size());
            run_shear_pass(pass, {bytes.data(), Type::u8, extent, 1, {}}, a.data(), pass.to, hold,
                           pass.to, aligned(scratch));
            run_shear_pass(pass, {floats.data(), Type::f32, extent, 1, {}}, b.data(), pass.to, hold,
                           pass.to, aligned(scratch));
            EXPECT_EQ(a, b);
        }
}

// ---- whole warps ----------------------------------------------------------------------------

Affine turned(const Matrix3d& a, const Extent& from, const Extent& to) {
    const Vector3d r((from.x - 1) / 2.0, (from.y - 1) / 2.0, (from.z - 1) / 2.0);
    const Vector3d c((to.x - 1) / 2.0, (to.y - 1) / 2.0, (to.z - 1) / 2.0);
    const Vector3d translation = c - a * r;
    Affine t;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) t[4 * row + column] = a(row, column);
        t[4 * row + 3] = translation[row];
    }
    return t;
}

Affine inverse(const Affine& t) {
    Matrix3d a;
    a << t[0], t[1], t[2], t[4], t[5], t[6], t[8], t[9], t[10];
    const Matrix3d b = a.inverse();
    const Vector3d shift = -b * Vector3d(t[3], t[7], t[11]);
    return {b(0, 0), b(0, 1),  b(0, 2), shift[0], b(1, 0), b(1, 1),
            b(1, 2), shift[1], b(2, 0), b(2, 1),  b(2, 2), shift[2]};
}

Matrix3d random_turn(std::mt19937& random, bool image) {
    std::uniform_real_distribution<double> angle(-M_PI, M_PI);
    if (image) return Eigen::AngleAxisd(angle(random), Vector3d::UnitZ()).matrix();
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized()
        .matrix();
}

/// Permutation, passes and mask; samples that no pass writes stay NaN before the mask.
std::vector<float> multipass(const std::vector<float>& samples, const Extent& extent,
                             const Affine& t, const Extent& screen, Hold hold, float outside) {
    const auto chain = shear_chain(t);
    EXPECT_TRUE(chain);
    const AxisPermutation permutation =
        into_place({.from = chain->from, .sign = chain->sign, .shift = {}}, extent);
    Extent box = permuted_extent(permutation, extent);
    std::vector<float> now(box.samples() + 16), out(screen.samples(), kNone);
    copy_permuted(samples.data(), extent, 4, permutation, &outside, now.data(), box,
                  Region::all(box));
    const auto passes = shear_passes(*chain, extent, screen, hold);
    for (std::size_t k = 0; k < passes.size(); ++k) {
        if (passes[k].to.empty()) break;
        const bool last = k + 1 == passes.size();
        const Region held = last ? Region::all(screen) : passes[k].to;
        std::vector<float> next(held.extent().samples() + 16, kNone);
        std::vector<float> scratch = scratch_of(passes[k]);
        // In two parts, as threads would.
        const int cut = passes[k].shear.axis == 2 ? 1 : 2;
        Region one = passes[k].to, two = passes[k].to;
        one.end[cut] = two.begin[cut] = (one.begin[cut] + one.end[cut]) / 2;
        const Grid grid{now.data(), Type::f32, passes[k].from.extent(), 1, {}};
        run_shear_pass(passes[k], grid, next.data(), held, hold, one, aligned(scratch));
        run_shear_pass(passes[k], grid, next.data(), held, hold, two, aligned(scratch));
        now = next;
    }
    std::copy_n(now.begin(), std::min<std::int64_t>(out.size(), now.size()), out.begin());
    mask_outside(inverse(t), extent, outside, out.data(), Region::all(screen), Region::all(screen));
    return out;
}

TEST(MultipassShear, ConstantsStayConstantAndTheBorderIsThatOfTheBackwardWarp) {
    std::mt19937 random(2);
    for (int i = 0; i < 60; ++i) {
        const bool image = i % 2;
        const Extent extent = image ? Extent{50, 37, 1} : Extent{23, 20, 17};
        const Extent screen = image ? Extent{41, 60, 1} : Extent{21, 24, 26};
        const Affine t = turned(random_turn(random, image), extent, screen);
        const std::vector<float> ones(extent.samples() + 16, 1.0f);
        std::vector<float> backward(screen.samples());
        BackwardWarp({ones.data(), Type::f32, extent, 1, {}}, inverse(t), Hold::foh, -5)(
            {backward.data(), Region::all(screen)}, Region::all(screen));
        for (const Hold hold : {Hold::foh, Hold::bspline3}) {
            const auto out = multipass(ones, extent, t, screen, hold, -5);
            for (std::size_t k = 0; k < out.size(); ++k)
                ASSERT_NEAR(out[k], backward[k], 1e-5) << i;  // four passes of a few 1e-7
        }
    }
}

TEST(MultipassShear, FieldsThatTheFilterReproducesAreExactInside) {
    std::mt19937 random(3);
    for (int i = 0; i < 40; ++i) {
        const bool image = i % 2;
        const Extent extent = image ? Extent{90, 77, 1} : Extent{48, 53, 50};
        const Extent screen = image ? Extent{71, 80, 1} : Extent{40, 44, 46};
        const Affine t = turned(random_turn(random, image), extent, screen), back = inverse(t);
        const auto field = [](double x, double y, double z) {
            return 0.02 * x - 0.03 * y + 0.015 * z + 0.1;
        };
        std::vector<float> samples(extent.samples() + 16);
        for (std::int64_t k = 0; k < extent.samples(); ++k)
            samples[k] = float(field(double(k % extent.x), double(k / extent.x % extent.y),
                                     double(k / extent.x / extent.y)));
        for (const Hold hold : {Hold::foh, Hold::bspline3}) {
            // Lines are mirrored for the spline: the kink there fades by 0.268 a sample.
            const double margin = hold == Hold::foh ? 2 : 14;
            const auto out = multipass(samples, extent, t, screen, hold, 0);
            int compared = 0;
            for (std::int64_t k = 0; k < screen.samples(); ++k) {
                const auto p = apply(back, double(k % screen.x), double(k / screen.x % screen.y),
                                     double(k / screen.x / screen.y));
                bool inside = true;
                for (int a = 0; a < (image ? 2 : 3); ++a)
                    inside = inside && p[a] >= margin && p[a] <= double(extent[a]) - 1 - margin;
                if (!inside) continue;
                ++compared;
                ASSERT_NEAR(out[k], field(p[0], p[1], p[2]), 2e-5) << i << ' ' << int(hold);
            }
            EXPECT_GT(compared, 500);
        }
    }
}

TEST(MultipassShear, SmoothFieldsComeCloserWithTheCubicFilter) {
    std::mt19937 random(4);
    for (int i = 0; i < 10; ++i) {
        const bool image = i % 2;
        const Extent extent = image ? Extent{120, 120, 1} : Extent{56, 56, 56};
        const Affine t = turned(random_turn(random, image), extent, extent), back = inverse(t);
        const auto field = [](double x, double y, double z) {
            return std::sin(0.6 * x + 0.3 * y) * std::cos(0.5 * y - 0.4 * z);
        };
        std::vector<float> samples(extent.samples() + 16);
        for (std::int64_t k = 0; k < extent.samples(); ++k)
            samples[k] = float(field(double(k % extent.x), double(k / extent.x % extent.y),
                                     double(k / extent.x / extent.y)));
        double rms[2] = {0, 0};
        for (const Hold hold : {Hold::foh, Hold::bspline3}) {
            const auto out = multipass(samples, extent, t, extent, hold, 0);
            int compared = 0;
            for (std::int64_t k = 0; k < extent.samples(); ++k) {
                const auto p = apply(back, double(k % extent.x), double(k / extent.x % extent.y),
                                     double(k / extent.x / extent.y));
                bool inside = true;
                for (int a = 0; a < (image ? 2 : 3); ++a)
                    inside = inside && p[a] >= 8 && p[a] <= double(extent[a]) - 9;
                if (!inside) continue;
                ++compared;
                rms[hold == Hold::bspline3] += std::pow(out[k] - field(p[0], p[1], p[2]), 2);
            }
            rms[hold == Hold::bspline3] = std::sqrt(rms[hold == Hold::bspline3] / compared);
        }
        EXPECT_LT(rms[0], 0.12)
            << i;  // at most four passes that lose up to 5 % of such a wave each
        EXPECT_LT(rms[1], 0.1 * rms[0]) << i;
    }
}

TEST(MultipassShear, APieceOfTheScreenIsThePieceOfTheWhole) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> value(-1, 1);
    for (int i = 0; i < 30; ++i) {
        const bool image = i % 2;
        const Extent extent = image ? Extent{140, 130, 1} : Extent{54, 50, 58};
        const Extent screen = image ? Extent{150, 150, 1} : Extent{60, 60, 60};
        std::vector<float> samples(extent.samples() + 16);
        for (float& sample : samples) sample = value(random);
        Affine t = turned(random_turn(random, image), extent, screen);
        for (const Hold hold : {Hold::foh, Hold::bspline3}) {
            const auto whole = multipass(samples, extent, t, screen, hold, 9);
            const Extent piece{11, 13, image ? 1 : 7};
            const std::array<std::int64_t, 3> corner = {20, 31, image ? 0 : 23};
            Affine shifted = t;
            for (int a = 0; a < 3; ++a) shifted[4 * a + 3] -= double(corner[a]);
            const auto part = multipass(samples, extent, shifted, piece, hold, 9);
            for (std::int64_t k = 0; k < piece.samples(); ++k) {
                const std::int64_t x = k % piece.x + corner[0],
                                   y = k / piece.x % piece.y + corner[1];
                const std::int64_t z = k / piece.x / piece.y + corner[2];
                ASSERT_NEAR(part[k], whole[(z * screen.y + y) * screen.x + x], 1e-5) << i;
            }
        }
    }
}

TEST(MultipassShear, QuarterTurnsAndWholeShiftsAreCopies) {
    const Extent extent{13, 11, 9};
    std::vector<float> samples(extent.samples() + 16);
    for (std::size_t k = 0; k < samples.size(); ++k) samples[k] = float(k);
    const Matrix3d quarter = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()).matrix();
    const Extent screen{9, 11, 13};
    for (const Hold hold : {Hold::foh, Hold::bspline3}) {
        const auto once =
            multipass(samples, extent, turned(quarter, extent, screen), screen, hold, -1);
        std::vector<float> again(once.begin(), once.end());
        again.resize(again.size() + 16);
        const auto back =
            multipass(again, screen, turned(quarter.transpose(), screen, extent), extent, hold, -1);
        for (std::int64_t k = 0; k < extent.samples(); ++k) ASSERT_EQ(back[k], samples[k]);
    }
}

TEST(MultipassShear, NothingInSight) {
    const Extent extent{13, 11, 9};
    const std::vector<float> samples(extent.samples() + 16, 1.0f);
    std::mt19937 random(6);
    for (int i = 0; i < 20; ++i) {
        Affine t = turned(random_turn(random, false), extent, extent);
        t[4 * (i % 3) + 3] += 1000;
        for (const float value : multipass(samples, extent, t, extent, Hold::foh, 4))
            ASSERT_EQ(value, 4);
    }
}

}  // namespace
}  // namespace edgewise::kernels
