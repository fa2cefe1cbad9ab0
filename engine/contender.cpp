#include "engine/contender.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "measure/quantiles.hpp"
#include "measure/repeated.hpp"

namespace edgewise {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::size_t kRuns = 7;  // of close contenders, at least
constexpr std::size_t kFewRuns = 3;
constexpr double kClose = 1.3;    // slower than the best by more: no further runs
constexpr double kHopeless = 3;   // so too for those of few runs
constexpr double kWaking = 0.02;  // [s]; a processor that slept takes up to so long
constexpr double kOneSided = 1.645;
/// Standard deviations of logs. Of what a path takes in two processes: audits minutes later differ
/// by 0.04 in the median. Of models, at least.
constexpr double kLater = 0.06, kModels = 0.15;

}  // namespace

bool Contender::is_timed() const { return seconds.size() >= kFewRuns; }

bool Contender::is_sure() const { return seconds.size() >= kRuns; }

double Contender::least() const {
    return seconds.empty() ? kNever : *std::min_element(seconds.begin(), seconds.end());
}

double Contender::typical() const { return seconds.empty() ? kNever : undisturbed(seconds); }

Belief Contender::belief(double level) const {
    if (seconds.empty()) return {kNever, 0};
    const double measured = std::hypot(kLater, spread_of_runs(seconds));
    const double modelled = std::max(kModels, plan.predicted.spread);
    if (!(plan.predicted.seconds > 0)) return {typical(), measured};
    const double of_runs = 1 / (measured * measured), of_models = 1 / (modelled * modelled);
    const double log =
        (of_runs * std::log(typical()) + of_models * std::log(level * plan.predicted.seconds)) /
        (of_runs + of_models);
    return {std::exp(log), 1 / std::sqrt(of_runs + of_models)};
}

double Contender::low() const {
    return plan.predicted.seconds * std::exp(-kOneSided * plan.predicted.spread);
}

bool Contender::is_close_to(const Contender& best) const {
    const double rival = best.typical();
    if (is_timed()) return least() <= kClose * rival;
    const bool woke = least() <= rival + kWaking && low() <= rival;
    return least() <= kHopeless * rival || woke;
}

}  // namespace edgewise
