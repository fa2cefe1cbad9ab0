#include "cli/session/contender.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/machine/quantiles.hpp"

namespace edgewise::cli {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::size_t kRuns = 7;  // of close contenders, at least
constexpr std::size_t kFewRuns = 3;
constexpr std::size_t kCalmRuns = 5;  // of close contenders
constexpr double kClose = 1.3;        // slower than the best by more: no further runs
constexpr double kHopeless = 3;       // so too for those of few runs
constexpr double kWaking = 0.02;      // [s]; a processor that slept takes up to so long
constexpr double kOneSided = 1.645;
/// Standard deviations of logs. Of what a path takes in two processes: audits minutes later differ
/// by 0.04 in the median. Of runs of which none was calm: siblings alone make up to 1.8. Of models,
/// at least.
constexpr double kLater = 0.06, kBusy = 0.4, kModels = 0.15;

}  // namespace

void Contender::choose(const Pace& best_pace) {
    if (runs.size() == 0) return;
    seconds = runs.seconds(best_pace, kFewRuns);
    calm = std::min(1.0, static_cast<double>(runs.calm(best_pace)) / kCalmRuns);
}

bool Contender::is_timed() const { return seconds.size() >= kFewRuns; }

bool Contender::is_sure(const Pace& best_pace) const {
    if (runs.size() == 0) return is_timed();
    return runs.size() >= kRuns && runs.calm(best_pace) >= kCalmRuns;
}

double Contender::least() const {
    return seconds.empty() ? kNever : *std::min_element(seconds.begin(), seconds.end());
}

double Contender::median() const { return seconds.empty() ? kNever : cli::median(seconds); }

Belief Contender::belief() const {
    if (seconds.empty()) return {kNever, 0};
    std::vector<double> away;
    for (const double each : seconds) away.push_back(std::abs(std::log(each / median())));
    // Normal distributions: deviation 1.4826 of the median distance, of a median 1.2533 of a mean.
    const double scatter =
        1.2533 * 1.4826 * cli::median(away) / std::sqrt(static_cast<double>(seconds.size()));
    const double measured = std::hypot(kLater, scatter, (1 - calm) * kBusy);
    const double modelled = std::max(kModels, plan.predicted.spread);
    if (!(plan.predicted.seconds > 0)) return {median(), measured};
    const double of_runs = 1 / (measured * measured), of_models = 1 / (modelled * modelled);
    const double log =
        (of_runs * std::log(median()) + of_models * std::log(plan.predicted.seconds)) /
        (of_runs + of_models);
    return {std::exp(log), 1 / std::sqrt(of_runs + of_models)};
}

double Contender::low() const {
    return plan.predicted.seconds * std::exp(-kOneSided * plan.predicted.spread);
}

bool Contender::is_close_to(const Contender& best) const {
    const double rival = best.median();
    if (is_timed()) return least() <= kClose * rival;
    const bool woke = least() <= rival + kWaking && low() <= rival;
    return least() <= kHopeless * rival || woke;
}

}  // namespace edgewise::cli
