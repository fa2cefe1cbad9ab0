#include "measure/probe_fit.hpp"

#include <algorithm>
#include <cmath>

#include "measure/quantiles.hpp"

namespace edgewise {
namespace {

constexpr double kAlike = 1.25;  // costs within this factor are those of one level

/// Values of several neighbours.
struct Pool {
    double log_sum = 0;
    std::size_t count = 0;

    double mean() const { return log_sum / static_cast<double>(count); }
};

/// The values nearest to these, by the squares of their logarithms' differences, that never fall.
/// (Pool adjacent violators: Ayer et al. 1955.)
std::vector<double> never_falling(const std::vector<double>& values) {
    std::vector<Pool> pools;
    for (const double value : values) {
        pools.push_back({std::log(value), 1});
        while (pools.size() > 1 && pools.back().mean() < pools[pools.size() - 2].mean()) {
            pools[pools.size() - 2].log_sum += pools.back().log_sum;
            pools[pools.size() - 2].count += pools.back().count;
            pools.pop_back();
        }
    }
    std::vector<double> fitted;
    for (const Pool& pool : pools) fitted.insert(fitted.end(), pool.count, std::exp(pool.mean()));
    return fitted;
}

/// One kind of access in all sets.
struct Kind {
    std::vector<double> cost, spread;
};

Kind kind_of(const std::vector<SetTimes>& sets, std::vector<double> SetTimes::*rounds) {
    Kind kind;
    for (const SetTimes& set : sets) {
        const Settled each = settled(set.*rounds);
        kind.cost.push_back(each.value);
        kind.spread.push_back(each.spread);
    }
    const std::vector<double> fitted = never_falling(kind.cost);
    for (std::size_t i = 0; i < fitted.size(); ++i)
        kind.spread[i] = std::max(kind.spread[i], std::abs(std::log(kind.cost[i] / fitted[i])));
    kind.cost = fitted;
    return kind;
}

/// The mean of some neighbours, whose costs never fall, and at least how far they are from it.
Settled joined(const Kind& kind, std::size_t begin, std::size_t end) {
    const std::vector<double> costs(kind.cost.begin() + static_cast<std::ptrdiff_t>(begin),
                                    kind.cost.begin() + static_cast<std::ptrdiff_t>(end));
    // Rounding may put the mean of equal costs beside them, and below the level before.
    Settled mean{.value = std::clamp(geometric_mean(costs), costs.front(), costs.back())};
    for (std::size_t i = begin; i < end; ++i)
        mean.spread =
            std::max({mean.spread, kind.spread[i], std::abs(std::log(kind.cost[i] / mean.value))});
    return mean;
}

}  // namespace

Settled settled(const std::vector<double>& rounds) {
    const double middle = median(rounds);
    std::vector<double> away;
    for (const double each : rounds) away.push_back(std::abs(std::log(each / middle)));
    // Normal distributions: deviation 1.4826 of the median distance, of a median 1.2533 of a mean.
    return {middle, 1.2533 * 1.4826 * median(away) / std::sqrt(static_cast<double>(rounds.size()))};
}

Levels levels_from(const std::vector<SetTimes>& sets) {
    const Kind streamed = kind_of(sets, &SetTimes::streamed),
               gather = kind_of(sets, &SetTimes::gather), line = kind_of(sets, &SetTimes::line);
    const auto alike = [&](std::size_t a, std::size_t b) {
        return streamed.cost[b] <= kAlike * streamed.cost[a] &&
               gather.cost[b] <= kAlike * gather.cost[a] && line.cost[b] <= kAlike * line.cost[a];
    };
    Levels levels;
    for (std::size_t begin = 0, end = 0; begin < sets.size(); begin = end) {
        while (end < sets.size() && alike(begin, end)) ++end;
        const Settled in_order = joined(streamed, begin, end),
                      anywhere = joined(gather, begin, end), alone = joined(line, begin, end);
        levels.push_back({.streamed = in_order.value,
                          .gather = anywhere.value,
                          .line = alone.value,
                          .spread = std::max({in_order.spread, anywhere.spread, alone.spread})});
        if (end < sets.size()) levels.back().bytes = sets[end - 1].bytes;
    }
    return levels;
}

}  // namespace edgewise
