#include "cli/machine/paced_runs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "cli/machine/data_lines.hpp"
#include "cli/machine/quantiles.hpp"

namespace edgewise::cli {
namespace {

/// Siblings make up to 1.8 of it; beyond this the loop itself was interrupted, not the run.
constexpr double kSlowest = 2.5;
/// Runs whose looks differ by less are alike: half of what looks at calm ones may differ by.
constexpr double kAlike = 1.05;
constexpr double kNever = std::numeric_limits<double>::infinity();

/// How many times as far as the nearest lines are; 1 where that was not looked at.
double times_as_far(double line, double least) noexcept {
    return line > 0 && least > 0 ? std::max(1.0, line / least) : 1;
}

}  // namespace

Pace PacedRuns::Run::pace() const noexcept {
    return {(beside.before.loop + beside.after.loop) / 2,
            std::max(beside.before.hop, beside.after.hop)};
}

void PacedRuns::join(const PacedRuns& others) {
    runs_.insert(runs_.end(), others.runs_.begin(), others.runs_.end());
}

void PacedRuns::disturbed_from(std::size_t first) {
    for (std::size_t i = first; i < runs_.size(); ++i)
        runs_[i].beside.before = runs_[i].beside.after = Pace{kNever, kNever};
}

double PacedRuns::least_line() const {
    double least = runs_.empty() ? 0 : nearest_line(runs_.front().beside.held);
    for (const Run& run : runs_)
        if (run.beside.line > 0 && !(least > 0 && least <= run.beside.line))
            least = run.beside.line;
    return least;
}

std::size_t PacedRuns::calm(const Pace& best) const {
    const double least = least_line();
    return static_cast<std::size_t>(std::count_if(runs_.begin(), runs_.end(), [&](const Run& run) {
        return is_calm(run.pace(), best) && times_as_far(run.beside.line, least) <= kNearLines;
    }));
}

std::vector<PacedRuns::Run> PacedRuns::calmest(const Pace& best, std::size_t least,
                                               std::size_t calm) const {
    std::vector<Run> runs = runs_;
    const double nearest = least_line();
    // How much longer a run takes, about: a ray caster of 6 MB took 2.4 times as long where a line
    // took ten times as long.
    const auto slower = [&](const Run& run) {
        return run.pace().loop * std::cbrt(times_as_far(run.beside.line, nearest));
    };
    std::stable_sort(runs.begin(), runs.end(), [&](const Run& a, const Run& b) {
        return std::pair(is_far(a.pace(), best), slower(a)) <
               std::pair(is_far(b.pace(), best), slower(b));
    });
    // Where nothing is known of any, none is better than the others.
    if (runs.empty() || !std::isfinite(runs.front().pace().loop)) return runs;
    std::size_t count = std::min(runs.size(), std::max({least, calm, std::size_t{1}}));
    if (calm < count) {
        // More runs make a steadier median.
        const Run& last = runs[count - 1];
        const auto alike = [&](const Run& run) {
            return is_far(run.pace(), best) == is_far(last.pace(), best) &&
                   slower(run) <= kAlike * slower(last);
        };
        while (count < runs.size() && alike(runs[count])) ++count;
    }
    runs.resize(count);
    return runs;
}

PacedRuns::Counted PacedRuns::counted(const Pace& best, std::size_t least) const {
    const double nearest = least_line();
    const std::size_t calm = this->calm(best);
    Counted counted;
    std::vector<double> loops, hops, lines;
    for (const Run& run : calmest(best, least, calm)) {
        counted.seconds.push_back(run.seconds);
        loops.push_back(run.pace().loop / best.loop);
        hops.push_back(best.hop > 0 ? run.pace().hop / best.hop : 1);
        lines.push_back(times_as_far(run.beside.line, nearest));
    }
    if (!loops.empty())
        counted.worse = {median(std::move(loops)), median(std::move(hops)),
                         median(std::move(lines)), nearest, calm >= counted.seconds.size()};
    return counted;
}

double PacedRuns::undisturbed(const Pace& best) const {
    constexpr std::size_t kEnough = 3;
    constexpr double kQuantile = 0.2;  // chosen on audits
    const double nearest = least_line();
    std::vector<double> all, near, calmed;
    for (const Run& run : runs_) {
        all.push_back(run.seconds);
        const double loop = std::min(run.beside.before.loop, run.beside.after.loop) / best.loop;
        if (loop > kSlowest || is_far(run.pace(), best)) continue;
        near.push_back(run.seconds / std::max(1.0, loop / kCalmLoop));
        if (times_as_far(run.beside.line, nearest) <= kNearLines) calmed.push_back(near.back());
    }
    if (calmed.size() < kEnough) calmed = near;
    return quantile(calmed.size() >= kEnough ? calmed : all, kQuantile);
}

}  // namespace edgewise::cli
