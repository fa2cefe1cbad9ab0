#include "measure/quantiles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace edgewise {

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    std::sort(values.begin(), values.end());
    const double at = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    const double part = at - static_cast<double>(below);
    // An infinite neighbour of weight 0 must not make it not a number.
    return part == 0 ? values[below] : values[below] * (1 - part) + values[above] * part;
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double geometric_mean(const std::vector<double>& values) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    double sum = 0;
    for (const double value : values) sum += std::log(value);
    return std::exp(sum / static_cast<double>(values.size()));
}

double jackknife_error(const std::vector<double>& without) {
    const auto n = static_cast<double>(without.size());
    if (n < 2) return 0;
    double mean = 0, squares = 0;
    for (const double estimate : without) mean += estimate / n;
    for (const double estimate : without) squares += (estimate - mean) * (estimate - mean);
    return std::sqrt((n - 1) / n * squares);
}

double kendall_tau(const std::vector<double>& a, const std::vector<double>& b) {
    double agree = 0, ordered_a = 0, ordered_b = 0;
    const auto sign = [](double x, double y) { return x < y ? -1 : x > y ? 1 : 0; };
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t k = 0; k < i; ++k) {
            const int in_a = sign(a[i], a[k]), in_b = sign(b[i], b[k]);
            agree += in_a * in_b;
            ordered_a += in_a * in_a;
            ordered_b += in_b * in_b;
        }
    return agree / std::sqrt(ordered_a * ordered_b);
}

}  // namespace edgewise
