#include "engine/contest.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/facts/known_scene.hpp"
#include "engine/planned.hpp"
#include "measure/quantiles.hpp"
#include "measure/since.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "planner/priced_graph.hpp"
#include "planner/search.hpp"
#include "scene/model.hpp"
#include "scene/preview.hpp"

namespace edgewise {
namespace {

constexpr double kFaster = 0.9;  // of the sure one's seconds
constexpr std::size_t kMostPaths = 8;
constexpr std::size_t kRoutes = 2048;  // that are looked at for these
/// What it takes to measure the facts of some paths, over what it takes to measure all: timed with
/// MIPs and X-rays, in proportion to what preview_operations() counts.
constexpr double kContested = 0.6;
/// Of the usual draws, one preview after the other: of rays; of points, which are cheap and are not
/// put into groups.
constexpr std::array kTimesOfRays = {0.125, 0.5, 2.0};
constexpr std::array kTimesOfPoints = {1.0};
constexpr std::size_t kGroups = 8;
constexpr double kSpent = 0.2;  // of what it may save, that a preview may cost
/// In standard errors: a path within the limit by so many is taken, beyond by so many is dropped.
constexpr double kTaken = 2, kDropped = 1;
/// A few draws may all be alike where those that decide were not drawn: the least standard error of
/// the usual number of draws; that of fewer grows with the root of how many.
constexpr double kLeastError = 0.04;

enum class Verdict { taken, dropped, open };

/// A path that may be as good as the sure one.
struct Entry {
    Route route;
    Plan plan;           // by the threads of the request
    double seconds = 0;  // by the profile's processors: these choose
    Verdict verdict = Verdict::open;
};

class Contesting {
 public:
    Contesting(const Planned& planned, const PricedGraph& graph, const Plan& sure)
        : planned_(planned),
          like_(*planned.want.budget.like),
          sources_(planned.sources()),
          graph_(graph),
          sure_(sure) {}

    Contest result() {
        Contest contest;
        const std::span<const double> all_times =
            planned_.want.job->of_rays() ? std::span<const double>(kTimesOfRays) : kTimesOfPoints;
        find_entries();
        if (entries_.empty() || worth() < preview_seconds(all_times.front())) return contest;
        const auto begin = std::chrono::steady_clock::now();
        find_wanted();
        for (const double times : all_times) {
            if (worth() < preview_seconds(times)) break;
            judge(draw(times), times, times == all_times.back());
            // What is dropped is nothing to save for.
            std::erase_if(entries_,
                          [](const Entry& each) { return each.verdict == Verdict::dropped; });
            if (entries_.empty() || entries_.front().verdict == Verdict::taken) break;
        }
        const auto winner = std::ranges::find(entries_, Verdict::taken, &Entry::verdict);
        if (winner != entries_.end()) contest.winner = std::move(winner->plan);
        contest.seconds = since(begin);
        return contest;
    }

 private:
    /// Of what the fastest entry may save over the runs asked for, the part that may be spent [s].
    double worth() const {
        return kSpent * planned_.query.repeat * (sure_seconds_ - entries_.front().seconds);
    }

    /// What a preview is expected to take [s]. It is counted and not timed.
    double preview_seconds(double times) const {
        const Profile& machine = planned_.engine.machine();
        const Work work{.operations = kContested * times * preview_operations(planned_.want)};
        return machine.counted(work).seconds / machine.processors;
    }

    std::vector<std::string> texts_of(const Route& route) const {
        std::vector<std::string> texts;
        for (const auto arc : route.arcs) {
            const Arc& what = graph_.spanned().graph[arc];
            texts.push_back(planned_.engine.edges()[static_cast<std::size_t>(what.edge)].name +
                            what.offer.with.text());
        }
        return texts;
    }

    /// The fastest paths that are not barred and keep all other budgets.
    void find_entries() {
        const Priced &choice = graph_.choice(), &real = graph_.real();
        std::vector<Route> routes = simple_routes(choice, kRoutes);
        std::ranges::stable_sort(
            routes, [](const Route& a, const Route& b) { return before(a.label, b.label); });
        sure_seconds_ = sure_.predicted.seconds;
        for (const Route& route : routes)
            if (texts_of(route) == sure_.texts()) sure_seconds_ = route.label.seconds;
        const Ask ask{planned_.want, planned_.guessed};
        for (Route& route : routes) {
            if (route.label.seconds >= kFaster * sure_seconds_ || entries_.size() == kMostPaths)
                break;
            if (likeness_of(route, choice) == Likeness::barred) continue;
            Plan plan = plan_of(route, real, planned_.engine.edges(), ask, planned_.plan_options);
            const Predicted by_choice = predicted_of(route, choice, ask, planned_.plan_options);
            Budget others = planned_.want.budget;
            others.like.reset();
            if (!feasible(plan.predicted, others) || !feasible(by_choice, others)) continue;
            entries_.push_back({std::move(route), std::move(plan), by_choice.seconds});
        }
    }

    /// The facts that tell the entries from the plain path.
    void find_wanted() {
        Scene scene = planned_.guessed;
        scene.supposed = 1;  // an error that lacks one fact may not ask for the next
        scene.asked = &wanted_;
        const Ask ask{planned_.want, scene};
        plain_way(planned_.engine.edges(), ask, sources_, like_);
        for (const Entry& each : entries_) likely_error(each.plan, ask, sources_);
    }

    FewDraws draw(double times) const {
        const Demands asked = untried(planned_.query.demands, planned_.engine.edges());
        return known_draws({planned_.engine, planned_.input, planned_.statistics, planned_.guessed,
                            planned_.want, asked, planned_.query.max_memory, planned_.memory.get()},
                           {.asked = asked,
                            .times = times,
                            .wanted = &wanted_,
                            .spanned = &graph_.spanned(),
                            .groups = kGroups});
    }

    /// The logarithm of the ratio of a path's likely error to the plain one's, by some facts.
    std::optional<double> ratio_of(const Plan& plan,
                                   const std::map<std::string, double>& facts) const {
        Scene scene = planned_.guessed;
        for (const auto& [name, value] : facts) scene.facts[name] = value;
        const Ask ask{planned_.want, scene};
        const auto plain = plain_way(planned_.engine.edges(), ask, sources_, like_);
        const auto error = likely_error(plan, ask, sources_);
        if (!plain || !error) return std::nullopt;
        const double least = std::numeric_limits<double>::min();
        return std::log(std::max(least, *error * scene.range) / std::max(least, plain->likely));
    }

    /// @param at_last  nothing more is drawn: one standard error has to do
    void judge(const FewDraws& draws, double times, bool at_last) {
        const double limit = std::log(like_.times);
        for (Entry& each : entries_) {
            const std::optional<double> ratio = ratio_of(each.plan, draws.likely);
            if (!ratio) {
                each.verdict = Verdict::dropped;
                continue;
            }
            const double off =
                std::max(spread_of(each.plan, draws), kLeastError / std::sqrt(times));
            if (*ratio + kTaken * off <= limit)
                each.verdict = Verdict::taken;
            else if (*ratio - kDropped * off > limit)
                each.verdict = Verdict::dropped;
            else if (at_last)
                each.verdict = *ratio + off <= limit ? Verdict::taken : Verdict::dropped;
        }
    }

    /// The standard error of that ratio.
    double spread_of(const Plan& plan, const FewDraws& draws) const {
        std::vector<double> ratios;
        for (const auto& facts : draws.without)
            if (const auto ratio = ratio_of(plan, facts)) ratios.push_back(*ratio);
        return jackknife_error(ratios);
    }

    const Planned& planned_;
    const Like& like_;
    const std::vector<Source> sources_;
    const PricedGraph& graph_;
    const Plan& sure_;
    double sure_seconds_ = 0;
    std::vector<Entry> entries_;  // fastest first
    std::set<std::string> wanted_;
};

}  // namespace

Contest contest_of(const Planned& planned, const PricedGraph& graph, const Plan& sure) {
    return Contesting(planned, graph, sure).result();
}

}  // namespace edgewise
