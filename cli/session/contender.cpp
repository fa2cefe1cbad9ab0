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

}  // namespace

void Contender::choose(const Pace& best_pace) {
    if (runs.size() > 0) seconds = runs.seconds(best_pace, kFewRuns);
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
