#include "reference/interval.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <tbb/parallel_for.h>

namespace edgewise {
namespace {

constexpr double kNormal = 1.959964;  // 97.5 % quantile
constexpr int kResamples = 999;       // so that quantiles of 0.025 are order statistics

/// Of parts that were drawn: their sum and its standard error.
struct Sum {
    double value = 0, error = 0;

    /// @param times  how often the part counts
    void add(const Part& part, double times = 1) {
        const double counted = times * part.value;
        value += counted;
        if (part.missing > 0) {
            drawn_ += counted;
            squares_ += part.missing * counted * counted;
            crossed_ += part.missing * counted;
            missing_ += part.missing;
        }
        if (part.looks > 0) {
            looked_ += counted;
            fourth_ += counted * part.square;
        }
    }
    /// @param n  parts that were left to chance
    void finish(double n, const AroundParts& around) {
        double variance = 0;
        if (n > 1) {
            const double mean = drawn_ / n;
            const double spread = squares_ - 2 * mean * crossed_ + mean * mean * missing_;
            variance += std::max(0.0, spread) * n / (n - 1);
        }
        if (around.looked > 1)
            variance += std::max(0.0, fourth_ - looked_ * looked_) * (1 - around.seen) /
                        (around.looked - 1);
        error = std::sqrt(variance);
    }

 private:
    double drawn_ = 0, squares_ = 0, crossed_ = 0, missing_ = 0, looked_ = 0, fourth_ = 0;
};

/// Random numbers of one resample.
class Chance {
 public:
    explicit Chance(std::uint64_t seed) : bits_(seed) {}
    std::size_t below(std::size_t n) {
        return static_cast<std::size_t>((bits_() >> 32) * static_cast<std::uint64_t>(n) >> 32);
    }
    /// How often `looks` would be looked at again, over `looks` (Knuth's product of uniforms).
    double again(double looks) {
        constexpr double kMany = 16;  // then it is 1, for what the second phase leaves
        if (!(looks > 0) || looks > kMany) return 1;
        const double end = std::exp(-looks);
        double product = uniform(), times = 0;
        for (; product > end; product *= uniform()) ++times;
        return times / looks;
    }

 private:
    double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
    std::mt19937_64 bits_;
};

/// Parts with their standard error; the first `drawn` of them were left to chance.
struct Drawn {
    const std::vector<Part>& parts;
    std::size_t drawn;
    const AroundParts& around;

    Sum sum() const {
        Sum sum;
        for (const Part& part : parts) sum.add(part);
        sum.finish(static_cast<double>(drawn), around);
        return sum;
    }
    /// Of as many, drawn again.
    Sum resampled(std::uint64_t seed) const {
        Chance chance(seed);
        const double unseen = std::sqrt(1 - around.seen);
        const auto times = [&](const Part& part) {
            return unseen > 0 ? 1 + unseen * (chance.again(part.looks) - 1) : 1;
        };
        Sum sum;
        for (std::size_t i = 0; i < drawn; ++i) {
            const Part& part = parts[chance.below(drawn)];
            sum.add(part, times(part));
        }
        for (std::size_t i = drawn; i < parts.size(); ++i) sum.add(parts[i], times(parts[i]));
        sum.finish(static_cast<double>(drawn), around);
        return sum;
    }
};

/// Many parts as `most` sums of them, which spread as far. Neighbours come into different ones.
std::vector<Part> joined(std::span<const Part> parts, std::size_t most) {
    if (parts.size() <= most) return {parts.begin(), parts.end()};
    std::vector<Part> sums(most, Part{.missing = 0});
    std::vector<double> squares(most);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const Part& part = parts[i];
        const std::size_t to = i % most;
        Part& sum = sums[to];
        sum.value += part.value;
        sum.looks += part.looks;
        sum.square += part.value * part.square;
        sum.missing += part.missing * part.value * part.value;
        squares[to] += part.value * part.value;
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
        if (sums[i].value > 0) sums[i].square /= sums[i].value;
        sums[i].missing = squares[i] > 0 ? sums[i].missing / squares[i] : parts[i].missing;
    }
    return sums;
}

/// How many standard errors a sum may be off, below and above.
struct Reach {
    double below = kNormal, above = kNormal;
};

Reach reach_of(const Drawn& drawn, const Sum& sum, std::uint64_t seed) {
    if (!(sum.error > 0)) return {};
    std::vector<double> t(kResamples);
    tbb::parallel_for(std::size_t{0}, t.size(), [&](std::size_t i) {
        const Sum again = drawn.resampled(seed + i);
        // A resample without spread missed the tail altogether: it says nothing but "lower".
        t[i] = again.error > 0 ? (again.value - sum.value) / again.error : -1e3;
    });
    std::sort(t.begin(), t.end());
    return {std::max(kNormal, t[kResamples - kResamples / 40 - 1]),
            std::max(kNormal, -t[kResamples / 40])};
}

}  // namespace

Interval root_sum_interval(std::vector<Part> parts, const AroundParts& around, std::uint64_t seed) {
    const auto sure = std::stable_partition(parts.begin(), parts.end(),
                                            [](const Part& part) { return part.missing > 0; });
    const Drawn drawn{parts, static_cast<std::size_t>(sure - parts.begin()), around};
    const Sum sum = drawn.sum();
    // Of so many parts the skew is that of sums of them as well, at a fraction of the time.
    constexpr std::size_t kMost = 1 << 13;
    const std::span all(parts);
    std::vector<Part> few = joined(all.first(drawn.drawn), kMost);
    const std::size_t few_drawn = few.size();
    for (const Part& part : joined(all.subspan(drawn.drawn), kMost)) few.push_back(part);
    const Drawn resampled{few, few_drawn, around};
    const Reach reach = reach_of(resampled, resampled.sum(), seed);
    const double low = std::max(sum.value - reach.below * sum.error, around.least);
    const double high = std::min(sum.value + reach.above * sum.error, around.most);
    return {std::sqrt(std::clamp(low, 0.0, sum.value)), std::sqrt(std::max(high, sum.value))};
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
