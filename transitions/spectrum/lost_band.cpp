#include "transitions/spectrum/lost_band.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory_resource>
#include <numbers>
#include <tbb/parallel_for.h>

#include "reference/stored.hpp"
#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/spectrum/varying_bricks.hpp"

namespace edgewise {
namespace {

using kernels::Complex;
using Lengths = VaryingBricks::Lengths;

constexpr std::int64_t kSide = VaryingBricks::kSide, kHalf = kSide / 2 + 1;
constexpr int kFine = 512;                       // responses a cycle
constexpr double kMost = 1.5, kStep = 1.0 / 20;  // of planes [cycles a sample]; responses end there

/// The window of Blackman and Harris, whose zeros lie half a sample beyond the outermost samples.
std::vector<double> window_of(std::int64_t n) {
    constexpr std::array<double, 4> kTerms = {0.35875, -0.48829, 0.14128, -0.01168};
    std::vector<double> window(static_cast<std::size_t>(n), 1.0);
    for (std::int64_t i = 0; n > 1 && i < n; ++i) {
        const double turn =
            2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
        double& w = window[static_cast<std::size_t>(i)] = 0;
        for (std::size_t k = 0; k < kTerms.size(); ++k)
            w += kTerms[k] * std::cos(static_cast<double>(k) * turn);
    }
    return window;
}

class Bricks {
 public:
    Bricks(const Data& samples, const Lengths& brick) : samples_(samples), brick_(brick) {
        for (std::size_t axis = 0; axis < 3; ++axis) window_[axis] = window_of(brick[axis]);
    }

    /// The power of one brick, half of it: kHalf frequencies a row.
    std::vector<double> power_of(const Lengths& from, const kernels::Fourier& fourier) const {
        auto* memory = std::pmr::new_delete_resource();
        kernels::Block<float> values(kSide * kSide * kSide, memory);
        kernels::Block<Complex> spectrum(kHalf * kSide * kSide, memory);
        std::fill_n(values.data(), kSide * kSide * kSide, 0.f);
        double sum = 0, weights = 0;
        each(from, [&](std::int64_t, double weight, double value) {
            sum += weight * value;
            weights += weight;
        });
        each(from, [&](std::int64_t at, double weight, double value) {
            values[static_cast<std::size_t>(at)] =
                static_cast<float>(weight * (value - sum / weights));
        });
        fourier.run(values.data(), spectrum.data());
        std::vector<double> power(kHalf * kSide * kSide);
        for (std::size_t i = 0; i < power.size(); ++i)
            power[i] = std::norm(std::complex<double>(spectrum[i]));
        return power;
    }

 private:
    template <class Body>
    void each(const Lengths& from, const Body& body) const {
        const Extent& n = samples_.what.extent;
        for (std::int64_t z = 0; z < brick_[2]; ++z)
            for (std::int64_t y = 0; y < brick_[1]; ++y)
                for (std::int64_t x = 0; x < brick_[0]; ++x)
                    body((z * kSide + y) * kSide + x,
                         window_[0][static_cast<std::size_t>(x)] *
                             window_[1][static_cast<std::size_t>(y)] *
                             window_[2][static_cast<std::size_t>(z)],
                         value_at(samples_,
                                  from[0] + x + n.x * (from[1] + y + n.y * (from[2] + z))));
    }

    const Data& samples_;
    Lengths brick_;
    std::array<std::vector<double>, 3> window_;
};

std::int64_t bin_of(double f) {
    const auto bin = static_cast<std::int64_t>(std::floor(f * kSide + 0.5)) % kSide;
    return bin < 0 ? bin + kSide : bin;
}

std::size_t fine(double f) { return static_cast<std::size_t>(std::abs(f) * kFine + 0.5); }

}  // namespace

LostBand::LostBand(const Data& samples, const Region& occupied, kernels::Between between) {
    for (int i = 0; i <= static_cast<int>(kMost * kFine) + 1; ++i) {
        const double f = static_cast<double>(i) / kFine;
        field_.push_back(kernels::response(between, f));
        spline_.push_back(kernels::response(kernels::Between::spline, f));
        linear_.push_back(kernels::response(kernels::Between::linear, f));
    }
    const VaryingBricks bricks = varying_bricks(samples, occupied);
    if (bricks.first.empty()) return;
    const Bricks of(samples, bricks.brick);
    const kernels::Fourier fourier = kernels::Fourier::real_box({kSide, kSide, kSide});
    std::vector<std::vector<double>> powers(bricks.first.size());
    tbb::parallel_for(std::size_t{0}, powers.size(),
                      [&](std::size_t i) { powers[i] = of.power_of(bricks.first[i], fourier); });
    power_.resize(kHalf * kSide * kSide);
    for (std::size_t at = 0; at < power_.size(); ++at) {
        double sum = 0;
        for (const std::vector<double>& each : powers) sum += each[at];
        power_[at] = static_cast<float>(sum);
    }
}

double LostBand::power(const Vec3& frequency) const {
    std::array<std::int64_t, 3> bin = {bin_of(frequency[0]), bin_of(frequency[1]),
                                       bin_of(frequency[2])};
    if (bin[0] >= kHalf)  // real samples: the same as at the opposite frequency
        for (std::int64_t& each : bin) each = (kSide - each) % kSide;
    return power_[static_cast<std::size_t>((bin[2] * kSide + bin[1]) * kHalf + bin[0])];
}

double LostBand::over_difference(const Vec3& direction) const {
    if (power_.empty()) return -1;
    const Vec3 along = direction.normalized(), u = along.unitOrthogonal(), v = along.cross(u);
    const auto steps = static_cast<int>(std::numbers::sqrt3 * kMost / kStep) + 1;
    double lost = 0, difference = 0;
    // Frequencies and their opposites are alike: half of the plane.
    for (int i = 0; i <= steps; ++i)
        for (int j = i == 0 ? 0 : -steps; j <= steps; ++j) {
            const Vec3 f = kStep * (i * u + j * v);
            const double farthest = f.cwiseAbs().maxCoeff();
            if (farthest > kMost) continue;
            const double here = power(f);
            double field = 1, spline = 1, linear = 1;
            for (int axis = 0; axis < 3; ++axis) {
                const std::size_t at = fine(f[axis]);
                field *= field_[at];
                spline *= spline_[at];
                linear *= linear_[at];
            }
            if (farthest > 0.75) lost += here * field * field;
            difference += here * (linear - spline) * (linear - spline);
        }
    return difference > 0 ? std::sqrt(lost / difference) : -1;
}

}  // namespace edgewise
