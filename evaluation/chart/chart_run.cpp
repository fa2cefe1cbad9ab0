#include "evaluation/chart/chart_run.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <limits>

#include "engine/chart_pictures.hpp"
#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "request/errors.hpp"

namespace edgewise {
namespace {

/// Of longer runs two tell as much as many of short ones.
constexpr double kLong = 1;  // [s]
/// What a first run needs in addition to the path: verifying, a picture.
constexpr double kBeside = 0.02;  // [s]

std::vector<std::string> chosen_steps(const Planned& planned) {
    return planned.answer.plan ? planned.answer.plan->texts() : std::vector<std::string>{};
}

/// The request up to the paths that are worth running. Budgets are drawn: where no plan keeps them
/// there still are paths.
TriedPaths tried_of(const Planned& planned, const PathSettings& settings,
                    const std::set<std::string>& only) {
    TriedPaths tried = tried_paths(planned, settings.limit, settings.seed, only);
    if (tried.plans.empty() && only.empty()) expect_plan(planned);
    return tried;
}

/// --max-memory would fence the process in; it is shown, not applied.
Query without_fences(const Query& query) {
    Query free = query;
    free.max_memory.reset();
    free.strict = false;
    return free;
}

Planned planned_of(const Query& query, const Engine& engine, Listener& messages) {
    Reached reached(ask(engine, without_fences(query), {.runs = true}));
    reached.open_all(messages);
    reached.look_at({}, messages);
    reached.price_all({}, messages);
    if (!reached.plan().answer.plan) messages.warning("no plan keeps the budgets");
    return reached.plan();
}

/// Runs the paths of one request for a chart: all of them alike, since all are shown.
class ChartRun {
 public:
    ChartRun(const Planned& planned, Listener& messages, const TriedPaths& tried,
             const ChartedRuns& settings, double resident, Charted& result,
             const ChartProgress& progress)
        : messages_(messages),
          settings_(settings),
          result_(result),
          progress_(progress),
          taker_(planned),
          rasters_(tried.plans.size()),
          runs_(planned, messages, result.paths, tried.plans, settings.paths, resident) {
        for (const MeasuredPath& path : result.paths)
            all_ += (1 + settings.paths.repeat) * path.predicted.seconds + kBeside;
    }

    void run_all() {
        const InState collecting(messages_, Listener::State::collecting);
        try {
            run_first_ones();
            for (int round = 0; round < settings_.paths.repeat; ++round)
                runs_.run_round(
                    round, [&](std::size_t i) { return is_wanted(i); },
                    [&](std::size_t i) { begins_round(round, i); });
            result_.interrupted = messages_.stop();
        } catch (const Cancelled&) {
            result_.interrupted = true;
        }
        if (settings_.pictures) take_pictures();
    }

 private:
    const MeasuredPath& path(std::size_t i) const { return result_.paths[i]; }

    /// What is most worth having comes first: an interrupted chart keeps it.
    void run_first_ones() {
        std::vector<std::size_t> order(result_.paths.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return rank(path(a)) < rank(path(b));
        });
        for (std::size_t n = 0; n < order.size(); ++n) {
            const std::size_t i = order[n];
            progress_(done_ / all_, fmt::format("path {}/{}", n + 1, order.size()));
            runs_.run_first(i, std::numeric_limits<double>::infinity(),
                            [&](int frame, const std::shared_ptr<const Data>& data) {
                                if (settings_.pictures && frame == 0)
                                    rasters_[i] = taker_.taken(*data);
                            });
            done_ += path(i).predicted.seconds + kBeside;
        }
    }

    static int rank(const MeasuredPath& path) { return path.chosen ? 0 : path.front ? 1 : 2; }

    void begins_round(int round, std::size_t i) {
        progress_(done_ / all_, fmt::format("round {}/{}", round + 1, settings_.paths.repeat));
        done_ += path(i).predicted.seconds;
    }

    bool is_wanted(std::size_t i) const {
        const MeasuredPath& path = this->path(i);
        return settings_.repeat_given || path.seconds.empty() || path.least() <= kLong;
    }

    void take_pictures() {
        charts::Pictures pictures;
        std::size_t first = rasters_.size();
        for (std::size_t i = 0; i < rasters_.size(); ++i)
            if (rasters_[i] && (first == rasters_.size() || path(i).chosen)) first = i;
        if (first == rasters_.size()) return;
        const auto reference = taker_.reference(runs_.field(), &runs_.reference_memory(),
                                                *rasters_[first], [&](double share) {
                                                    progress_(share, "reference picture");
                                                    return !messages_.stop();
                                                });
        result_.interrupted = result_.interrupted || messages_.stop();
        pictures.base = reference ? *reference : *rasters_[first];
        pictures.base_is = reference            ? "the reference"
                           : path(first).chosen ? "the chosen path"
                                                : fmt::format("path {}", first);
        pictures.points = std::move(rasters_);
        pictures.note = taker_.note();
        taker_.set_window(pictures);
        result_.pictures = std::move(pictures);
    }

    Listener& messages_;
    const ChartedRuns& settings_;
    Charted& result_;
    const ChartProgress& progress_;
    PictureTaker taker_;
    std::vector<std::optional<charts::Raster>> rasters_;
    PathRuns runs_;
    double done_ = 0, all_ = 0;
};

void describe(Charted& charted, const Planned& planned, const TriedPaths& tried) {
    const Budget& budget = planned.want.budget;
    charted.machine = planned.engine.machine().name;
    charted.seconds_budget = budget.seconds;
    charted.error_budget = budget.error;
    charted.all_paths = tried.all;
    for (const Plan& plan : tried.plans) {
        charted.plans.push_back(plan);
        charted.families.push_back(family_of(plan.texts()));
    }
}

}  // namespace

std::string family_of(const std::vector<std::string>& steps) {
    std::string family;
    for (const std::string& step : steps) {
        const std::string edge = step.substr(0, step.find('/'));
        if (!edge.starts_with("store.")) family += (family.empty() ? "" : " > ") + edge;
    }
    return family.empty() ? "the input itself" : family;
}

Charting charting_of(const Query& query, const Engine& engine, const PathSettings& settings,
                     Listener& listener) {
    const Planned planned = planned_of(query, engine, listener);
    const TriedPaths tried = tried_of(planned, settings, {});
    const std::vector<std::string> chosen = chosen_steps(planned);
    Charting charting;
    if (!chosen.empty()) charting.chosen = path_text(chosen);
    for (std::size_t i = 0; i < tried.plans.size(); ++i) {
        charting.paths.push_back(path_text(tried.plans[i].texts()));
        if (tried.front[i] || tried.plans[i].texts() == chosen)
            charting.wanted.push_back(charting.paths.back());
    }
    return charting;
}

Charted charted(const Query& query, const Engine& engine, const ChartedRuns& settings,
                const ChartProgress& progress, Listener& listener) {
    const Planned planned = planned_of(query, engine, listener);
    const TriedPaths tried = tried_of(planned, settings.paths, settings.only);
    planned.memory->trim();
    const double resident = resident_now() - static_cast<double>(planned.memory->used());
    Charted charted;
    describe(charted, planned, tried);
    if (settings.planned) settings.planned(planned);
    const std::vector<std::string> chosen = chosen_steps(planned);
    const bool has_plan = planned.answer.plan.has_value();
    charted.paths = unmeasured(tried, has_plan ? &chosen : nullptr);
    ChartRun(planned, listener, tried, settings, resident, charted, progress).run_all();
    listener.end_progress();
    charted.warnings = listener.warnings();
    return charted;
}

}  // namespace edgewise
