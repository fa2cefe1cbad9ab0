#include "measure/repeated.hpp"

#include <cmath>

#include "measure/quantiles.hpp"

namespace edgewise {

double undisturbed(const std::vector<double>& seconds) { return quantile(seconds, 0.2); }

double spread_of_runs(const std::vector<double>& seconds) {
    constexpr double kFewRuns = 0.2;  // what single runs scatter by on a shared machine
    std::vector<double> away;
    const double middle = median(seconds);
    for (const double one : seconds) away.push_back(std::abs(std::log(one / middle)));
    // Normal distributions: deviation 1.4826 of the median distance; of the 0.2 quantile of n it is
    // 1.43 / sqrt(n) of theirs (David, Nagaraja, Order Statistics, 2003, 10.2).
    const double scatter = seconds.size() < 4 ? kFewRuns : 1.4826 * median(away);
    return 1.43 * scatter / std::sqrt(static_cast<double>(seconds.size()));
}

bool needs_warming(double expected) noexcept { return expected < 0.05; }

}  // namespace edgewise
