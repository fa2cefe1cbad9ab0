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

double ErrorTally::rms() const {
    double sum = 0, weight = 0;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        sum += sums_[i];
        weight += weights_[i];
    }
    return weight > 0 ? std::sqrt(sum / weight) : 0;
}

double ErrorTally::upper() const {
    const double mean = rms() * rms(), n = static_cast<double>(sums_.size());
    if (n == 0) return 0;
    double weight = 0, spread = 0;  // of a ratio of sums, to first order
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        weight += weights_[i];
        spread += std::pow(sums_[i] - mean * weights_[i], 2);
    }
    const double error = n > 1 ? std::sqrt(spread * n / (n - 1)) / weight : mean;
    return std::sqrt(mean + 2 * error);
}

}  // namespace edgewise
