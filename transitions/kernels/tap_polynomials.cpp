#include "transitions/kernels/tap_polynomials.hpp"

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace edgewise::kernels {
namespace {

using Weights = std::array<double, TapPolynomials::kMostTaps>;

Weights weights_at(const Filter& filter, double f) {
    Weights weights{};
    filter.weights(f, weights.data());
    return weights;
}

/// Coefficients [power][tap] through the weights at Chebyshev's nodes, of which none is 0 or 1.
Eigen::MatrixXd through_nodes(const Filter& filter, int degree) {
    const int nodes = degree + 1;
    Eigen::MatrixXd powers(nodes, nodes), values(nodes, filter.taps);
    for (int node = 0; node < nodes; ++node) {
        const double f = 0.5 - 0.5 * std::cos(std::numbers::pi * (node + 0.5) / nodes);
        const Weights weights = weights_at(filter, f);
        for (int power = 0; power < nodes; ++power) powers(node, power) = std::pow(f, power);
        for (int tap = 0; tap < filter.taps; ++tap) values(node, tap) = weights[tap];
    }
    return powers.fullPivLu().solve(values);
}

double farthest_off(const Filter& filter, const Eigen::MatrixXd& coefficients) {
    constexpr int kPlaces = 257;
    double most = 0;
    for (int i = 0; i < kPlaces; ++i) {
        const double f = static_cast<double>(i) / kPlaces;
        const Weights weights = weights_at(filter, f);
        for (int tap = 0; tap < filter.taps; ++tap) {
            double value = 0;
            for (auto power = coefficients.rows(); power-- > 0;)
                value = value * f + coefficients(power, tap);
            most = std::max(most, std::abs(value - weights[tap]));
        }
    }
    return most;
}

/// Of magnitudes of the weights of one axis.
double largest_sum(const Filter& filter) {
    constexpr int kPlaces = 1024;
    double largest = 1;
    for (int i = 0; i < kPlaces; ++i) {
        double sum = 0;
        for (const double weight : weights_at(filter, static_cast<double>(i) / kPlaces))
            sum += std::abs(weight);
        largest = std::max(largest, sum);
    }
    return largest;
}

}  // namespace

TapPolynomials::TapPolynomials(const Filter& filter) : taps_(filter.taps) {
    if (filter.taps > kMostTaps)
        throw std::invalid_argument("filter " + filter.name + ": too many taps");
    for (degree_ = 0; degree_ <= kMostDegree; ++degree_) {
        const Eigen::MatrixXd found = through_nodes(filter, degree_);
        if (farthest_off(filter, found) > 0x1p-24) continue;
        for (int tap = 0; tap < taps_; ++tap)
            for (int power = 0; power <= degree_; ++power)
                coefficients_[tap][power] = static_cast<float>(found(power, tap));
        return;
    }
    throw std::invalid_argument("filter " + filter.name + ": its weights are no polynomials");
}

const TapPolynomials& TapPolynomials::of(const Filter& filter) {
    static std::mutex mutex;
    static std::map<std::string, TapPolynomials> made;
    const std::lock_guard lock(mutex);
    return made.try_emplace(filter.name, filter).first->second;
}

Overshoot overshoot_of(const Filter& filter, int axes) {
    if (filter.positive) return {};
    static std::mutex mutex;
    static std::map<std::string, double> known;
    const std::lock_guard lock(mutex);
    const auto [found, is_new] = known.try_emplace(filter.name);
    if (is_new) found->second = largest_sum(filter);
    const double sizes = found->second;
    // Between two places the sum may be a little larger; f32 polynomials and sums of their taps are
    // off by less than 4e-6 a tap.
    const double roundings = 1e-5 + 4e-6 * filter.taps;
    const double all = std::pow(sizes + roundings, axes);
    // Positive weights add up to P and negative ones to -N: P - N = 1, P + N = all. Of samples in
    // [low, high] the value is at most P high - N low = high + N (high - low).
    return {.range = (all - 1) / 2, .magnitude = axes * roundings * all};
}

Hold hold_of(const Filter& filter) noexcept {
    // There is but one filter of each: weights add up to 1, and two that keep linear functions lie
    // on a line.
    if (filter.taps == 1) return Hold::zoh;
    if (filter.taps == 2 && filter.order == 2) return Hold::foh;
    return filter.taps == 4 && filter.coefficients ? Hold::bspline3 : Hold::weighted;
}

}  // namespace edgewise::kernels
