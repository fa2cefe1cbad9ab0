#include "transitions/spectrum/radial_power.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tbb/parallel_for.h>

#include "graph/with_type.hpp"
#include "transitions/kernels/fourier.hpp"
#include "transitions/spectrum/varying_bricks.hpp"

namespace edgewise {
namespace {

using kernels::Complex;
using kernels::Fourier;
using Lengths = VaryingBricks::Lengths;

constexpr double kRing = 1.0 / 32, kHighFrequency = 3.0 / 8;  // [cycles a sample]

std::int64_t product(const Lengths& n) { return n[0] * n[1] * n[2]; }

/// A Hann window whose zeros lie half a sample beyond the outermost samples.
std::vector<double> window_of(std::int64_t n) {
    std::vector<double> window(static_cast<std::size_t>(n), 1.0);
    for (std::int64_t i = 0; n > 1 && i < n; ++i) {
        const double s =
            std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
        window[static_cast<std::size_t>(i)] = s * s;
    }
    return window;
}

/// The numbers of one brick in one channel, as stored.
struct Part {
    Lengths from;
    int channel;
};

/// Everything that is the same for all bricks of one data set.
class Rings {
 public:
    Rings(const Data& data, const Lengths& brick) : data_(data), brick_(brick) {
        const Extent& n = data.what.extent;
        const std::int64_t side = n.z == 1 ? VaryingBricks::kSideOfImages : VaryingBricks::kSide;
        length_ = {n.x > 1 ? side : 1, n.y > 1 ? side : 1, n.z > 1 ? side : 1};
        int axes = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            window_[k] = window_of(brick_[k]);
            plan_.push_back(Fourier::along_lines(length_[k], product(length_) / length_[k], false));
            axes += length_[k] > 1;
            double square = 0;
            for (const double w : window_[k]) square += w * w;
            energy_ *= square;
        }
        for (std::int64_t square = 0; square <= axes * side * side / 4; ++square)
            ring_of_square_.push_back(static_cast<std::size_t>(std::lround(
                std::sqrt(static_cast<double>(square)) / static_cast<double>(side) / kRing)));
        share_.resize(ring_of_square_.back() + 1);
        each_frequency([&](std::size_t, std::size_t ring) { share_[ring] += 1; });
        for (double& share : share_) share /= static_cast<double>(product(length_));
    }

    /// The power of two parts together: one is real, one imaginary. Their cross terms at opposite
    /// frequencies cancel, and these lie in the same ring.
    std::vector<double> power_of(const Part& real, const Part* imaginary,
                                 std::pmr::memory_resource* memory) const {
        const auto bytes = static_cast<std::size_t>(product(length_)) * sizeof(Complex);
        Array tile(bytes, memory), turned(bytes, memory);
        auto* values = static_cast<Complex*>(tile.data());
        std::fill_n(values, product(length_), Complex());
        const Level one = level_of(real), other = imaginary ? level_of(*imaginary) : Level{};
        std::vector<double> power(share_.size());
        const double range = std::max(one.range, other.range);
        if (!(range > 0)) return power;
        fill(real, one.mean, 1 / range, reinterpret_cast<float*>(values));
        if (imaginary)
            fill(*imaginary, other.mean, 1 / range, reinterpret_cast<float*>(values) + 1);
        transform(values, static_cast<Complex*>(turned.data()));
        each_frequency([&](std::size_t at, std::size_t ring) {
            const double re = values[at].real(), im = values[at].imag();
            power[ring] += re * re + im * im;
        });
        for (double& each : power)
            each *= range * range / (energy_ * static_cast<double>(product(length_)));
        return power;
    }

    const std::vector<double>& share() const noexcept { return share_; }

 private:
    struct Level {
        double mean = 0, range = 0;  // range 0: nothing varies
    };

    template <class Body>
    void each_sample(const Part& part, const Body& body) const {
        const Representation& what = data_.what;
        with_type(what.type, [&]<class T>(T) {
            for (std::int64_t z = 0; z < brick_[2]; ++z)
                for (std::int64_t y = 0; y < brick_[1]; ++y) {
                    const std::int64_t row = (part.from[2] + z) * what.extent.y + part.from[1] + y;
                    const T* from = data_.as<T>() +
                                    (row * what.extent.x + part.from[0]) * what.channels +
                                    part.channel;
                    const std::int64_t to = (z * length_[1] + y) * length_[0];
                    const double w = window_[1][static_cast<std::size_t>(y)] *
                                     window_[2][static_cast<std::size_t>(z)];
                    for (std::int64_t x = 0; x < brick_[0]; ++x)
                        body(to + x, w * window_[0][static_cast<std::size_t>(x)],
                             static_cast<double>(from[x * what.channels]));
                }
        });
    }

    Level level_of(const Part& part) const {
        double sum = 0, weights = 0, low = HUGE_VAL, high = -HUGE_VAL;
        each_sample(part, [&](std::int64_t, double w, double v) {
            if (!std::isfinite(v)) return;
            sum += w * v;
            weights += w;
            low = std::min(low, v);
            high = std::max(high, v);
        });
        return low < high ? Level{sum / weights, high - low} : Level{};
    }

    void fill(const Part& part, double mean, double scale, float* to) const {
        each_sample(part, [&](std::int64_t at, double w, double v) {
            if (std::isfinite(v)) to[2 * at] = static_cast<float>(w * (v - mean) * scale);
        });
    }

    template <class Body>
    void each_frequency(const Body& body) const {
        // Sides are equal, or 1: squared distances are whole numbers.
        const auto square = [&](std::int64_t i, std::size_t k) {
            const std::int64_t f = std::min(i, length_[k] - i);
            return f * f;
        };
        std::size_t at = 0;
        for (std::int64_t z = 0; z < length_[2]; ++z)
            for (std::int64_t y = 0; y < length_[1]; ++y)
                for (std::int64_t x = 0; x < length_[0]; ++x)
                    body(at++, ring_of_square_[static_cast<std::size_t>(
                                   square(x, 0) + square(y, 1) + square(z, 2))]);
    }

    /// Lines along x, then the axes turn (y becomes x): after three rounds they are as before.
    void transform(Complex* tile, Complex* turned) const {
        Lengths n = length_;
        for (std::size_t k = 0; k < 3; ++k) {
            plan_[k].run(tile);
            for (std::int64_t z = 0; z < n[2]; ++z)
                for (std::int64_t y = 0; y < n[1]; ++y)
                    for (std::int64_t x = 0; x < n[0]; ++x)
                        turned[(x * n[2] + z) * n[1] + y] = tile[(z * n[1] + y) * n[0] + x];
            std::copy_n(turned, product(n), tile);
            n = {n[1], n[2], n[0]};
        }
    }

    const Data& data_;
    Lengths brick_, length_;  // samples of a brick; with the zeros behind them
    std::array<std::vector<double>, 3> window_;
    double energy_ = 1;  // sum of the squares of the window
    std::vector<Fourier> plan_;
    std::vector<std::size_t> ring_of_square_;  // by the squared distance, in steps of 1 / side
    std::vector<double> share_;
};

}  // namespace

double RadialPower::white() const {
    double high = 0, part = 0;
    for (std::size_t ring = 0; ring < power.size(); ++ring) {
        if (frequency[ring] <= kHighFrequency) continue;
        high += power[ring];
        part += share[ring];
    }
    return part > 0 ? std::sqrt(high / part) : 0;
}

RadialPower measure_radial_power(const Data& data, const Region& occupied,
                                 std::pmr::memory_resource* memory) {
    const VaryingBricks bricks = varying_bricks(data, occupied);
    const int channels = data.what.channels;
    std::vector<Part> parts;
    for (const Lengths& from : bricks.first)
        for (int channel = 0; channel < channels; ++channel) parts.push_back({from, channel});
    const Rings rings(data, bricks.brick);
    std::vector<std::vector<double>> powers((parts.size() + 1) / 2);
    tbb::parallel_for(std::size_t{0}, powers.size(), [&](std::size_t pair) {
        const std::size_t i = 2 * pair;
        powers[pair] =
            rings.power_of(parts[i], i + 1 < parts.size() ? &parts[i + 1] : nullptr, memory);
    });
    RadialPower found;
    found.bricks = static_cast<int>(bricks.first.size());
    found.empty = bricks.empty;
    found.samples = bricks.samples;
    found.share = rings.share();
    found.power.resize(found.share.size());
    const double slope = data.what.values.slope;
    const double each = slope * slope / channels / std::max(1, found.bricks);
    for (std::size_t ring = 0; ring < found.power.size(); ++ring) {
        found.frequency.push_back(static_cast<double>(ring) * kRing);
        for (const std::vector<double>& power : powers) found.power[ring] += each * power[ring];
    }
    return found;
}

}  // namespace edgewise
