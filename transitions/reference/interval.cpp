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

struct Mean {
    double value = 0, error = 0;  // standard error
};

Mean mean_of(double sum, double squares, double n) {
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

/// Of as many values, drawn with replacement.
Mean resampled_mean(std::span<const double> values, std::uint64_t seed) {
    std::mt19937_64 bits(seed);
    const auto n = static_cast<std::uint64_t>(values.size());
    double sum = 0, squares = 0;
    const auto take = [&](std::uint64_t draw) {  // 32 bits of it
        const double value = values[(draw & 0xffffffffu) * n >> 32];
        sum += value;
        squares += value * value;
    };
    for (std::uint64_t i = 0; i < n; i += 2) {
        const std::uint64_t both = bits();
        take(both);
        if (i + 1 < n) take(both >> 32);
    }
    return mean_of(sum, squares, static_cast<double>(n));
}

}  // namespace

Interval root_mean_interval(std::span<const double> squares, std::uint64_t seed) {
    const auto n = squares.size();
    double sum = 0, sum_of_squares = 0;
    for (double square : squares) {
        sum += square;
        sum_of_squares += square * square;
    }
    if (n < 2 || sum == 0) return {0, n == 1 ? std::sqrt(sum) : 0};
    const double count = static_cast<double>(n);
    const Mean mean = mean_of(sum, sum_of_squares, count);
    if (mean.error == 0) return {std::sqrt(mean.value), std::sqrt(mean.value)};

    std::vector<double> t(kResamples);
    tbb::parallel_for(std::size_t{0}, t.size(), [&](std::size_t i) {
        const Mean resampled = resampled_mean(squares, seed + i);
        // A resample without spread missed the tail altogether: it says nothing but "lower".
        t[i] = resampled.error > 0 ? (resampled.value - mean.value) / resampled.error : -1e3;
    });
    std::sort(t.begin(), t.end());
    const double below = t[kResamples - kResamples / 40 - 1], above = -t[kResamples / 40];
    const double low = mean.value - std::max(kNormal, below) * mean.error;
    const double high = mean.value + std::max(kNormal, above) * mean.error;
    // No error exceeds the largest one by the much that a resample without spread would claim.
    return {std::sqrt(std::max(0.0, low)),
            std::sqrt(std::min(high, *std::max_element(squares.begin(), squares.end())))};
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
