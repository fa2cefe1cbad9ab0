#include "transitions/reference/interval.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <tbb/parallel_for.h>
#include <vector>

namespace edgewise {
namespace {

constexpr double kNormal = 1.959964;  // 97.5 % quantile
constexpr int kResamples = 999;       // so that quantiles of 0.025 are order statistics

/// Of parts that were drawn: their sum and its standard error.
struct Sum {
    double value = 0, error = 0;

    void add(const Part& part) {
        value += part.value;
        squares_ += part.missing * part.value * part.value;
        crossed_ += part.missing * part.value;
        missing_ += part.missing;
    }
    void finish(double n) {
        const double mean = value / n;
        const double spread = squares_ - 2 * mean * crossed_ + mean * mean * missing_;
        error = std::sqrt(std::max(0.0, spread) * n / (n - 1));
    }

 private:
    double squares_ = 0, crossed_ = 0, missing_ = 0;
};

/// Of as many parts, drawn with replacement.
Sum resampled(std::span<const Part> parts, std::uint64_t seed) {
    std::mt19937_64 bits(seed);
    const auto n = static_cast<std::uint64_t>(parts.size());
    Sum sum;
    const auto take = [&](std::uint64_t draw) {  // 32 bits of it
        sum.add(parts[(draw & 0xffffffffu) * n >> 32]);
    };
    for (std::uint64_t i = 0; i < n; i += 2) {
        const std::uint64_t both = bits();
        take(both);
        if (i + 1 < n) take(both >> 32);
    }
    sum.finish(static_cast<double>(n));
    return sum;
}

/// How many standard errors a sum may be off, below and above.
struct Reach {
    double below = kNormal, above = kNormal;
};

Reach reach_of(std::span<const Part> parts, const Sum& sum, std::uint64_t seed) {
    if (!(sum.error > 0)) return {};
    std::vector<double> t(kResamples);
    tbb::parallel_for(std::size_t{0}, t.size(), [&](std::size_t i) {
        const Sum again = resampled(parts, seed + i);
        // A resample without spread missed the tail altogether: it says nothing but "lower".
        t[i] = again.error > 0 ? (again.value - sum.value) / again.error : -1e3;
    });
    std::sort(t.begin(), t.end());
    return {std::max(kNormal, t[kResamples - kResamples / 40 - 1]),
            std::max(kNormal, -t[kResamples / 40])};
}

}  // namespace

Interval root_sum_interval(std::span<const Part> parts, const AroundParts& around,
                           std::uint64_t seed) {
    Sum sum;
    for (const Part& part : parts) sum.add(part);
    const double all = around.sure + sum.value;
    Reach reach;
    if (parts.size() >= 2) {
        sum.finish(static_cast<double>(parts.size()));
        reach = reach_of(parts, sum, seed);
    }
    const double error = std::sqrt(sum.error * sum.error + around.variance);
    const double low = std::max(all - reach.below * error, around.least);
    const double high = std::min(all + reach.above * error, around.most);
    return {std::sqrt(std::clamp(low, 0.0, all)), std::sqrt(std::max(high, all))};
}

Interval root_share_interval(std::int64_t hits, std::int64_t samples) {
    if (samples == 0) return {};
    const double n = static_cast<double>(samples), share = static_cast<double>(hits) / n;
    const double z2 = kNormal * kNormal, middle = share + z2 / (2 * n);
    const double half = kNormal * std::sqrt(share * (1 - share) / n + z2 / (4 * n * n));
    const double low = (middle - half) / (1 + z2 / n), high = (middle + half) / (1 + z2 / n);
    return {hits == 0 ? 0 : std::sqrt(std::max(0.0, low)), std::sqrt(std::min(1.0, high))};
}

}  // namespace edgewise
