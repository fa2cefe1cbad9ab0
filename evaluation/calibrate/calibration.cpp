#include "evaluation/calibrate/calibration.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "evaluation/calibrate/calibration_trials.hpp"
#include "evaluation/calibrate/exam.hpp"
#include "evaluation/calibrate/prepared_trial.hpp"
#include "graph/errors.hpp"
#include "graph/version.hpp"
#include "measure/machine.hpp"
#include "measure/machine_probe.hpp"
#include "measure/quantiles.hpp"
#include "measure/repeated.hpp"
#include "measure/since.hpp"
#include "planner/cost.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

class Calibration {
 public:
    Calibration(const Catalogue& edges, bool quick, Listener& listener)
        : edges_(edges), listener_(listener), quick_(quick), limit_(quick ? 6 : 45) {
        profile_ = default_profile(edges);
        profile_.processors = usable_cores();
        probe_machine(profile_, quick, listener.stop());  // first: rates refer to it
    }

    Profile measure() {
        const std::vector<EdgeTrial> all =
            trials_of(edges_, quick_ ? Trial::Part::quick : Trial::Part::full);
        begin_ = Clock::now();
        std::vector<Case> cases(all.size());
        for (std::size_t i = 0; i < all.size(); ++i) {
            show(all[i].trial);
            // What a trial leaves of its time goes to those that follow.
            const double left = kFirstRound * limit_ - since(begin_);
            end_ = since(begin_) + left / static_cast<double>(all.size() - i);
            begin_case(cases[i], all[i]);
        }
        bool lacking = true;  // runs
        for (int round = 1; lacking && since(begin_) < limit_; ++round) {
            lacking = false;
            // Always in the same order: between two visits of one trial lies a whole round, so that
            // no bad moment of the host spoils all of them.
            for (std::size_t i = 0; i < all.size(); ++i) {
                if (is_enough(cases[i])) continue;
                lacking = true;
                show(all[i].trial);
                repeat_case(cases[i], round);
            }
        }
        for (const Case& each : cases) collect(each);
        fit(kept());
        if (!quick_) missed_ = missed_in_exams(profile_, phantoms_, edges_, listener_);
        listener_.end_progress();
        return finished();
    }

 private:
    static constexpr double kFirstRound = 0.3;  // of the time, at most
    static constexpr double kLong = 0.04;       // [s]
    /// Runs of a path; of a long one; of one that others of its trial beat by kDear.
    static constexpr std::size_t kMany = 12, kFew = 6, kLeast = 4;
    static constexpr double kDear = 5;

    /// What each step of a path took, run by run. Between two runs lie seconds: a core that is
    /// shared (with the other hyperthread, with another guest of the host) is slow for tenths of a
    /// second and more, so consecutive runs would all meet the same state.
    using Runs = std::vector<std::vector<double>>;

    struct TimedPath {
        Plan plan;
        Runs alone, together;  // on one thread, on all
        double longest = 0;    // of all runs
        bool dear = false;     // others are far cheaper
    };

    struct TimedStep {
        std::vector<double> alone, together;  // of all its frames
    };

    struct Case {
        std::string edge;  // of the trial, or ""
        std::unique_ptr<PreparedTrial> prepared;
        std::vector<TimedPath> paths;  // the cheap ones first
    };

    void show(const Trial& trial) const {
        listener_.progress(since(begin_) / limit_,
                           fmt::format("{} {} {}", name_of(trial.job),
                                       trial.mode ? name_of(*trial.mode) : "", trial.input));
    }

    std::string name(const Case& of, const Step& step) const {
        return timing_name(*step.by, step.offer, of.prepared->looked.want, step.work);
    }

    /// What is timed: name, counted seconds, those of line misses, frames.
    using What = std::tuple<std::string, double, double, int>;
    What what(const Case& of, const Step& step) const {
        const Counted counted = profile_.counted(step.work);
        return {name(of, step), counted.seconds, counted.apart, step.runs()};
    }

    /// What reads what another step just wrote takes longer than what reads the input: of paths
    /// that are timed for one edge others tell nothing, and no rates are of steps behind a copy.
    static bool counts(const Case& of, const Plan& plan, std::size_t k) {
        if (!of.edge.empty()) return plan.steps[k].by->name == of.edge;
        return k == 0 || !plan.steps[k - 1].by->name.starts_with("store.");
    }

    static bool has_fine_steps(const Plan& plan) {
        return std::any_of(plan.steps.begin(), plan.steps.end(), [](const Step& step) {
            const Parameters& with = step.offer.with;
            return with.contains("step") && with.number("step") < 1;
        });
    }

    static bool passes(const Plan& plan, const std::string& edge) {
        return std::any_of(plan.steps.begin(), plan.steps.end(),
                           [&](const Step& step) { return step.by->name == edge; });
    }

    void begin_case(Case& one, const EdgeTrial& timed) {
        one.prepared = std::make_unique<PreparedTrial>(timed.trial, phantoms_, edges_, listener_);
        one.edge = timed.edge;
        std::vector<Plan> plans = one.prepared->paths(default_profile(edges_));
        // The expensive ones may find their steps already timed.
        std::stable_sort(plans.begin(), plans.end(), [](const Plan& a, const Plan& b) {
            return a.predicted.seconds < b.predicted.seconds;
        });
        // Elsewhere such rates go along those of whole steps.
        if (!timed.trial.fine) std::erase_if(plans, has_fine_steps);
        if (timed.trial.alone) {
            std::erase_if(plans, [&](const Plan& plan) { return !passes(plan, one.edge); });
            plans.resize(std::min<std::size_t>(1, plans.size()));
        }
        const double cheapest = plans.empty() ? 0 : plans.front().predicted.seconds;
        std::size_t paths = 0;
        for (Plan& plan : plans) {
            std::set<What> brought;
            for (std::size_t k = 0; k < plan.steps.size(); ++k)
                if (counts(one, plan, k)) brought.insert(what(one, plan.steps[k]));
            if (std::includes(seen_.begin(), seen_.end(), brought.begin(), brought.end())) continue;
            // The cheapest few are timed even where the time is used up.
            if (since(begin_) > end_ && paths >= 4) break;
            TimedPath path{.plan = std::move(plan), .alone = {}, .together = {}};
            path.dear = path.plan.predicted.seconds > kDear * cheapest;
            for (Runs* runs : {&path.alone, &path.together}) runs->resize(path.plan.steps.size());
            one.paths.push_back(std::move(path));
            if (!time(one, one.paths.back(), profile_.processors)) {
                one.paths.pop_back();
                continue;
            }
            seen_.merge(brought);
            ++paths;
        }
        if (profile_.processors > 1)
            for (TimedPath& path : one.paths) time(one, path, 1);
        one.prepared->looked.memory->trim();
    }

    /// All paths on all threads, then, in every third round, all of them on one: a thread that
    /// wakes for every second run is slower than those of a machine at work.
    void repeat_case(Case& one, int round) {
        repeat_paths(one, round, profile_.processors);
        const bool alone = round % 3 == 0 || is_enough(one, profile_.processors);
        if (profile_.processors > 1 && alone) repeat_paths(one, round / 3, 1);
        one.prepared->looked.memory->trim();
    }

    /// Those that have not had enough runs. Long runs are fewer: their own length is a mean
    /// over what the machine does.
    void repeat_paths(Case& one, int round, int threads) {
        for (std::size_t i = 0; i < one.paths.size(); ++i) {
            TimedPath& path = one.paths[round % 2 ? one.paths.size() - 1 - i : i];
            const int every = path.longest < kLong ? 1 : 4;
            const bool due = round % every == 0 && !is_enough(path, threads);
            if (due && since(begin_) < limit_) time(one, path, threads);
        }
    }

    static bool is_enough(const TimedPath& path, int threads) {
        const Runs& runs = threads == 1 ? path.alone : path.together;
        const std::size_t enough = path.dear ? kLeast : path.longest >= kLong ? kFew : kMany;
        return runs.front().size() >= enough;
    }
    static bool is_enough(const Case& one, int threads) {
        return std::all_of(one.paths.begin(), one.paths.end(),
                           [&](const TimedPath& path) { return is_enough(path, threads); });
    }
    bool is_enough(const Case& one) const {
        return is_enough(one, profile_.processors) &&
               (profile_.processors == 1 || is_enough(one, 1));
    }

    /// Another path ran before: a short run counts when warm. @return false where a step failed
    bool time(Case& one, TimedPath& path, int threads) {
        if (listener_.stop()) throw Cancelled();
        const PreparedTrial& trial = *one.prepared;
        if (needs_warming(path.longest)) trial.run(path.plan, threads);
        const Outcome outcome = trial.run(path.plan, threads);
        if (outcome.steps != path.plan.texts()) return false;
        path.longest = std::max(path.longest, outcome.seconds);
        // What setting up takes, and going from step to step, is part of the steps.
        const std::vector<double>& steps = outcome.step_seconds;
        const double between = outcome.seconds - std::accumulate(steps.begin(), steps.end(), 0.0);
        Runs& runs = threads == 1 ? path.alone : path.together;
        for (std::size_t k = 0; k < runs.size(); ++k)
            runs[k].push_back(steps[k] + std::max(0.0, between) / double(steps.size()));
        return true;
    }

    /// The same step of several paths and trials is one thing.
    void collect(const Case& one) {
        for (const TimedPath& path : one.paths)
            for (std::size_t k = 0; k < path.plan.steps.size(); ++k) {
                if (!counts(one, path.plan, k)) continue;
                TimedStep& timed = steps_[what(one, path.plan.steps[k])];
                const auto join = [](std::vector<double>& to, const std::vector<double>& from) {
                    to.insert(to.end(), from.begin(), from.end());
                };
                join(timed.alone, path.alone[k]);
                join(timed.together, profile_.processors > 1 ? path.together[k] : path.alone[k]);
            }
    }

    std::map<std::string, std::vector<Timed>> kept() {
        std::map<std::string, std::vector<Timed>> timed;
        for (const auto& [what, step] : steps_) {
            const auto& [name, counted, apart, frames] = what;
            if (step.alone.empty() || step.together.empty()) continue;
            const double shared = undisturbed(step.together);
            // So many threads are not faster than so many times.
            const double alone = std::min(undisturbed(step.alone), profile_.processors * shared);
            timed[name].push_back({.counted = counted,
                                   .apart = apart,
                                   .alone = alone / frames,
                                   .together = shared / frames,
                                   .spread = spread_of_runs(step.together),
                                   .runs = static_cast<int>(step.together.size()),
                                   .frames = frames});
        }
        return timed;
    }

    void fit(const std::map<std::string, std::vector<Timed>>& timed) {
        profile_.rates = rates_of(timed);
        rebase_factors(profile_);
        std::vector<double> shared;
        for (const auto& [name, curve] : profile_.rates.measured())
            for (const Rate& rate : curve) shared.push_back(rate.shared);
        const double each = 1.0 / profile_.processors;
        if (profile_.processors > 1 && !shared.empty())
            profile_.serial = std::clamp((median(shared) - each) / (1 - each), 0.0, 1.0);
    }

    Profile finished() {
        profile_.name = quick_ ? "this machine (quick)" : "this machine";
        profile_.cpu = cpu_name();
        profile_.build = version();
        profile_.when = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
        if (!missed_.empty()) {
            for (double& miss : missed_) miss = std::abs(miss);
            // Of a normal distribution 90 % lie within 1.645 deviations; the tails are longer, and
            // intervals of 90 % are what the spread is for.
            profile_.spread = std::clamp(quantile(missed_, 0.9) / 1.645, 0.02, 2.0);
        }
        profile_.provenance.insert(
            {{"rates",
              "measured; phantoms of 48^3 to 270^3 and 256^2 to 2000^2 samples; 0.2 quantiles of "
              "runs that lie apart"},
             {"serial", "derived from rates"},
             {"spread",
              fmt::format("measured on {} paths that the rates have not seen", missed_.size())},
             {"factors",
              "guessed: of another machine, scaled to the rates; where these have no name"}});
        return profile_;
    }

    const Catalogue& edges_;
    Listener& listener_;
    bool quick_;
    double limit_, end_ = 0;  // [s] since the begin: of everything, of the trial at hand
    Clock::time_point begin_;
    Phantoms phantoms_;  // outlives the cases, which measure() holds
    Profile profile_;
    std::set<What> seen_;  // that some path brings
    std::map<What, TimedStep> steps_;
    std::vector<double> missed_;  // logarithms of measured over predicted
};

}  // namespace

Profile measured_profile(const Catalogue& edges, bool quick, Listener& listener) {
    return Calibration(edges, quick, listener).measure();
}

}  // namespace edgewise
