#include "transitions/spectrum/radial_power.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "graph/with_type.hpp"
#include "transitions/kernels/fourier.hpp"

namespace edgewise {
namespace {

using kernels::Complex;
using kernels::Fourier;
using Lengths = std::array<std::int64_t, 3>;

constexpr std::int64_t kSide = 32, kSideOfImages = 128;
constexpr int kLooked = 32, kUsed = 8;
constexpr double kRing = 1.0 / 32, kHigh = 3.0 / 8;  // [cycles a sample]

std::int64_t product(const Lengths& n) { return n[0] * n[1] * n[2]; }

/// Bricks that tile the data; where they do not fit, they overlap.
struct Tiling {
    Lengths extent, brick, count;

    explicit Tiling(const Extent& n) : extent{n.x, n.y, n.z} {
        const std::int64_t side = n.z == 1 ? kSideOfImages : kSide;
        for (std::size_t k = 0; k < 3; ++k) {
            brick[k] = std::min(extent[k], side);
            count[k] = (extent[k] + side - 1) / side;
        }
    }
    /// The first sample of brick i.
    Lengths origin(std::int64_t i) const {
        Lengths at;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t place = i % count[k], last = count[k] - 1;
            at[k] = last > 0 ? place * (extent[k] - brick[k]) / last : 0;
            i /= count[k];
        }
        return at;
    }
};

/// All bricks where these are few, else one from each of 32 stretches of the tiling. Neighbours are
/// far apart in this order (bits are reversed), so that those that are used lie all over the data.
std::vector<std::int64_t> looked_at(std::int64_t bricks) {
    std::vector<std::int64_t> order;
    std::mt19937_64 bits(kLooked);
    for (int i = 0; i < kLooked; ++i) {
        int stretch = 0;
        for (int bit = 1; bit < kLooked; bit *= 2) stretch = stretch * 2 + (i & bit ? 1 : 0);
        const double within = static_cast<double>(bits() >> 11) * 0x1p-53;
        const double drawn = (stretch + within) / kLooked * static_cast<double>(bricks);
        if (bricks > kLooked)
            order.push_back(static_cast<std::int64_t>(drawn));
        else if (stretch < bricks)
            order.push_back(stretch);
    }
    return order;
}

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

/// Everything that is the same for all bricks of one data set.
class Rings {
 public:
    Rings(const Tiling& tiling, std::pmr::memory_resource* memory)
        : brick_(tiling.brick),
          length_(lengths_of(tiling)),
          tile_(bytes(), memory),
          turned_(bytes(), memory) {
        int axes = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            window_[k] = window_of(brick_[k]);
            plan_.push_back(Fourier::along_lines(length_[k], product(length_) / length_[k], false));
            axes += length_[k] > 1;
            double square = 0;
            for (const double w : window_[k]) square += w * w;
            energy_ *= square;
        }
        const auto rings = static_cast<std::size_t>(std::lround(std::sqrt(axes) / 2 / kRing)) + 1;
        power_.resize(rings);
        share_.resize(rings);
        each_frequency([&](std::size_t, std::size_t ring) { share_[ring] += 1; });
        for (double& share : share_) share /= static_cast<double>(product(length_));
    }

    /// Adds the power of a brick. @param value  (x, y, z) -> f64
    /// @return whether anything varies in it
    template <class Value>
    bool add(const Value& value) {
        double sum = 0, weights = 0, low = HUGE_VAL, high = -HUGE_VAL;
        each_sample(
            [&](std::size_t, double w, double v) {
                if (!std::isfinite(v)) return;
                sum += w * v;
                weights += w;
                low = std::min(low, v);
                high = std::max(high, v);
            },
            value);
        if (!(low < high)) return false;
        const double mean = sum / weights, scale = 1 / (high - low);
        auto* tile = static_cast<Complex*>(tile_.data());
        std::fill_n(tile, product(length_), Complex());
        each_sample(
            [&](std::size_t at, double w, double v) {
                if (std::isfinite(v)) tile[at] = static_cast<float>(w * (v - mean) * scale);
            },
            value);
        transform();
        const double unit = 1 / (scale * scale * energy_ * static_cast<double>(product(length_)));
        each_frequency([&](std::size_t at, std::size_t ring) {
            power_[ring] += unit * std::norm(std::complex<double>(tile[at]));
        });
        return true;
    }

    const std::vector<double>& power() const noexcept { return power_; }
    const std::vector<double>& share() const noexcept { return share_; }

 private:
    static Lengths lengths_of(const Tiling& tiling) {
        const std::int64_t side = tiling.extent[2] == 1 ? kSideOfImages : kSide;
        Lengths length;
        for (std::size_t k = 0; k < 3; ++k) length[k] = tiling.extent[k] > 1 ? side : 1;
        return length;
    }
    std::size_t bytes() const {
        return static_cast<std::size_t>(product(length_)) * sizeof(Complex);
    }

    template <class Body, class Value>
    void each_sample(const Body& body, const Value& value) const {
        for (std::int64_t z = 0; z < brick_[2]; ++z)
            for (std::int64_t y = 0; y < brick_[1]; ++y)
                for (std::int64_t x = 0; x < brick_[0]; ++x)
                    body(static_cast<std::size_t>((z * length_[1] + y) * length_[0] + x),
                         window_[0][static_cast<std::size_t>(x)] *
                             window_[1][static_cast<std::size_t>(y)] *
                             window_[2][static_cast<std::size_t>(z)],
                         value(x, y, z));
    }

    template <class Body>
    void each_frequency(const Body& body) const {
        const auto square = [&](std::int64_t i, std::size_t k) {
            const double f =
                static_cast<double>(std::min(i, length_[k] - i)) / static_cast<double>(length_[k]);
            return f * f;
        };
        std::size_t at = 0;
        for (std::int64_t z = 0; z < length_[2]; ++z)
            for (std::int64_t y = 0; y < length_[1]; ++y)
                for (std::int64_t x = 0; x < length_[0]; ++x)
                    body(at++, static_cast<std::size_t>(std::lround(
                                   std::sqrt(square(x, 0) + square(y, 1) + square(z, 2)) / kRing)));
    }

    /// Lines along x, then the axes turn (y becomes x): after three rounds they are as before.
    void transform() {
        auto *tile = static_cast<Complex*>(tile_.data()),
             *turned = static_cast<Complex*>(turned_.data());
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

    Lengths brick_, length_;  // samples of a brick; with the zeros behind them
    std::array<std::vector<double>, 3> window_;
    double energy_ = 1;  // sum of the squares of the window
    std::vector<Fourier> plan_;
    Array tile_, turned_;
    std::vector<double> power_, share_;
};

}  // namespace

double RadialPower::white() const {
    double high = 0, part = 0;
    for (std::size_t ring = 0; ring < power.size(); ++ring) {
        if (frequency[ring] <= kHigh) continue;
        high += power[ring];
        part += share[ring];
    }
    return part > 0 ? std::sqrt(high / part) : 0;
}

RadialPower measure_radial_power(const Data& data, std::pmr::memory_resource* memory) {
    const Representation& what = data.what;
    const Tiling tiling(what.extent);
    Rings rings(tiling, memory);
    RadialPower found;
    for (const std::int64_t brick : looked_at(product(tiling.count))) {
        if (found.bricks == kUsed) break;
        const Lengths from = tiling.origin(brick);
        bool varies = false;
        for (int channel = 0; channel < what.channels; ++channel)
            with_type(what.type, [&]<class T>(T) {
                varies |= rings.add([&](std::int64_t x, std::int64_t y, std::int64_t z) {
                    const std::int64_t row = (from[2] + z) * what.extent.y + from[1] + y;
                    const std::int64_t at = row * what.extent.x + from[0] + x;
                    return static_cast<double>(data.as<T>()[at * what.channels + channel]);
                });
            });
        ++(varies ? found.bricks : found.empty);
        found.samples += product(tiling.brick) * what.channels;
    }
    found.power = rings.power();
    found.share = rings.share();
    const double each = what.values.slope * what.values.slope / what.channels;
    for (std::size_t ring = 0; ring < found.power.size(); ++ring) {
        found.frequency.push_back(static_cast<double>(ring) * kRing);
        found.power[ring] *= each / std::max(1, found.bricks);
    }
    return found;
}

}  // namespace edgewise
