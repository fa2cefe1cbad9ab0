#include "transitions/reference/preview.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {

void ErrorTally::close() {
    if (weight_ > 0) {
        sums_.push_back(sum_);
        weights_.push_back(weight_);
    }
    sum_ = weight_ = 0;
}

double ErrorTally::rms() const { return std::sqrt(mean()); }

double ErrorTally::mean() const {
    double sum = 0, weight = 0;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        sum += sums_[i];
        weight += weights_[i];
    }
    return weight > 0 ? sum / weight : 0;
}

double ErrorTally::error() const {
    const double mean = this->mean(), n = static_cast<double>(sums_.size());
    if (n < 2) return mean;
    double weight = 0, spread = 0;  // of a ratio of sums, to first order
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        weight += weights_[i];
        spread += std::pow(sums_[i] - mean * weights_[i], 2);
    }
    return std::sqrt(spread * n / (n - 1)) / weight;
}

ErrorEstimate estimate_of(std::span<const Stratum> strata) {
    double mean = 0, variance = 0;
    for (const Stratum& stratum : strata) {
        mean += stratum.share * stratum.tally.mean();
        if (!stratum.whole) variance += std::pow(stratum.share * stratum.tally.error(), 2);
    }
    return {std::sqrt(mean), std::sqrt(mean + ErrorTally::kStandardErrors * std::sqrt(variance))};
}

}  // namespace edgewise
