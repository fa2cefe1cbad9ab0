#include "reference/error_tally.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

constexpr double kMostLeverage = 0.9;  // beyond, a cluster alone would tell the slope

}  // namespace

Auxiliary Auxiliary::over(std::span<const double> of, double population) {
    const auto n = static_cast<double>(of.size());
    double mean = 0, spread = 0;
    for (double value : of) mean += value / n;
    for (double value : of) spread += (value - mean) * (value - mean);
    if (n < 2) return {mean, mean * mean};
    return {mean, spread / (n - 1) / n * std::max(0.0, 1 - n / population)};
}

void ErrorTally::close(double chance) {
    open_.missing = 1 - chance;
    if (open_.weight > 0) clusters_.push_back(open_);
    open_ = {};
}

void ErrorTally::append(const ErrorTally& other) {
    clusters_.insert(clusters_.end(), other.clusters_.begin(), other.clusters_.end());
}

ErrorTally::Cluster ErrorTally::sum() const {
    Cluster sum;
    for (const Cluster& cluster : clusters_) {
        sum.square += cluster.square;
        sum.auxiliary += cluster.auxiliary;
        sum.weight += cluster.weight;
    }
    return sum;
}

MeanSquare ErrorTally::plain() const {
    const Cluster all = sum();
    if (!(all.weight > 0)) return {};
    const double mean = all.square / all.weight, n = static_cast<double>(clusters_.size());
    if (n < 2) return {mean, mean * mean};
    double spread = 0;  // of a ratio of sums, to first order
    for (const Cluster& cluster : clusters_)
        spread += cluster.missing * std::pow(cluster.square - mean * cluster.weight, 2);
    return {mean, spread * n / (n - 1) / (all.weight * all.weight)};
}

MeanSquare ErrorTally::regressed(const Auxiliary& auxiliary) const {
    const MeanSquare alone = plain();
    const auto n = static_cast<double>(clusters_.size());
    if (n < 3) return alone;
    const Cluster all = sum();
    const double x = all.auxiliary / all.weight;
    const auto off = [&](const Cluster& of) { return of.auxiliary - x * of.weight; };
    double both = 0, spread = 0;
    for (const Cluster& cluster : clusters_) {
        both += off(cluster) * (cluster.square - alone.mean * cluster.weight);
        spread += off(cluster) * off(cluster);
    }
    if (!(both > 0)) return alone;
    const double slope = both / spread;
    double left = 0;
    for (const Cluster& cluster : clusters_) {
        const double residual = cluster.square - alone.mean * cluster.weight - slope * off(cluster);
        const double leverage = off(cluster) * off(cluster) / spread;
        left += cluster.missing * std::pow(residual / (1 - std::min(leverage, kMostLeverage)), 2);
    }
    const MeanSquare with = {
        std::max(0.0, alone.mean + slope * (auxiliary.mean - x)),
        left * n / (n - 1) / (all.weight * all.weight) + slope * slope * auxiliary.variance};
    return with.variance < alone.variance ? with : alone;
}

ErrorEstimate estimate_of(std::span<const Stratum> strata, double more) {
    MeanSquare all{0, more};
    for (const Stratum& stratum : strata) {
        const MeanSquare of =
            stratum.whole ? stratum.tally.plain() : stratum.tally.regressed(stratum.auxiliary);
        all.mean += stratum.share * of.mean;
        if (!stratum.whole) all.variance += stratum.share * stratum.share * of.variance;
    }
    return {std::sqrt(all.mean),
            std::sqrt(all.mean + ErrorTally::kStandardErrors * std::sqrt(all.variance))};
}

}  // namespace edgewise
