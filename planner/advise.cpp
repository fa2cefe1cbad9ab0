#include "planner/advise.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace edgewise {
namespace {

constexpr double kAlike = 1.35;    // sizes within this factor are one, as in Rates
constexpr int kQuantiles = 256;    // that stand for a log-normal distribution
constexpr double kMeasured = 3;    // runs that a measurement takes
constexpr double kFar = 2;         // times its bound: from there on an edge is missing
constexpr double kNothing = 1e-6;  // of the plan's seconds

using At = Graph::vertex_descriptor;
using ArcOf = Graph::edge_descriptor;

/// Where a normal distribution has so much below it.
double normal_quantile(double share) {
    double low = -9, high = 9;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (0.5 * std::erfc(-middle / std::sqrt(2.0)) < share ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

const std::vector<double>& normal_quantiles() {
    static const std::vector<double> all = [] {
        std::vector<double> z;
        for (int k = 0; k < kQuantiles; ++k) z.push_back(normal_quantile((k + 0.5) / kQuantiles));
        return z;
    }();
    return all;
}

/// Where a cost comes from; "measured" needs no advice.
std::string state_of(const std::string& name, const Counted& work, const Profile& profile,
                     const std::string& build) {
    const auto found = profile.rates.measured().find(name);
    const double counted = work.seconds;
    if (found != profile.rates.measured().end() && counted > 0) {
        const std::vector<Rate>& curve = found->second;
        if (profile.build != build) return "stale";
        const bool among =
            counted * kAlike >= curve.front().counted && counted <= kAlike * curve.back().counted;
        return among ? "measured" : "beyond";
    }
    if (profile.rates.at(name, work).ratio > 0) return "borrowed";
    for (std::string known = name.substr(0, name.find(' '));; known.resize(known.rfind('/'))) {
        if (profile.factors.contains(known)) {
            const auto origin = profile.provenance.find("factors." + known);
            if (origin == profile.provenance.end()) return "guessed";
            return origin->second.substr(0, origin->second.find_first_of(" :,;"));
        }
        if (known.find('/') == std::string::npos) return "guessed";
    }
}

class Adviser {
 public:
    Adviser(const Candidates& paths, const Plan& plan, const Profile& profile,
            const std::string& build)
        : paths_(paths),
          graph_(paths.spanned().graph),
          profile_(profile),
          build_(build),
          want_(paths.ask().want),
          budget_(want_.budget) {
        budget_.seconds.reset();
        if (budget_.like && !accurate_enough(plan.predicted, budget_)) budget_.like.reset();
        chosen_ = paths.find(plan.texts());
        if (!chosen_) return;
        name_arcs();
        each_part([this](const Part& part) {
            const auto [fastest, fresh] = fastest_.emplace(part.ends, part.seconds);
            if (!fresh) fastest->second = std::min(fastest->second, part.seconds);
        });
        for (const Candidate& path : paths.all())
            if (could_win(path.choice)) able_.push_back(&path);
    }

    Advice advice() const {
        Advice advice;
        if (!chosen_) return advice;
        advice.seconds = chosen_->choice.seconds;
        if (!chosen_->route.arcs.empty())
            advice.bound =
                bound({chosen_->route.source, boost::target(chosen_->route.arcs.back(), graph_)});
        for (std::size_t name = 0; name < names_.size(); ++name) advise_cost(name, advice);
        std::stable_sort(
            advice.costs.begin(), advice.costs.end(),
            [](const CostAdvice& a, const CostAdvice& b) { return a.worth() > b.worth(); });
        advice.arcs = missing();
        return advice;
    }

 private:
    using Ends = std::pair<At, At>;

    /// A part of a path: what there is between two vertices.
    struct Part {
        const Candidate* path = nullptr;
        std::size_t begin = 0, end = 0;  // of its arcs
        Ends ends = {};
        double seconds = 0;
    };

    template <typename Visit>
    void each_part(Visit visit) const {
        for (const Candidate& path : paths_.all()) {
            const auto& arcs = path.route.arcs;
            for (std::size_t i = 0; i < arcs.size(); ++i) {
                Part part{&path, i, i, {boost::source(arcs[i], graph_), {}}, 0};
                for (; part.end < arcs.size(); visit(std::as_const(part))) {
                    const ArcOf last = arcs[part.end++];
                    part.seconds += path.scale * paths_.priced().cost(last).seconds;
                    part.ends.second = boost::target(last, graph_);
                }
            }
        }
    }

    void name_arcs() {
        std::map<std::string, std::size_t> places;
        name_of_.resize(boost::num_edges(graph_));
        for (const ArcOf arc : boost::make_iterator_range(boost::edges(graph_))) {
            const Arc& what = graph_[arc];
            const Transition& edge = paths_.catalogue()[static_cast<std::size_t>(what.edge)];
            const auto [place, fresh] =
                places.emplace(timing_name(edge, what.offer, want_, paths_.priced().cost(arc).work),
                               names_.size());
            if (fresh) names_.push_back(place->first);
            name_of_[what.index] = place->second;
        }
    }

    bool could_win(const Predicted& predicted) const {
        return feasible(predicted, budget_) &&
               (want_.minimize == Minimize::time ||
                objective(predicted, want_.minimize) <= objective(chosen_->choice, want_.minimize));
    }

    double seconds_in(const Candidate& path, std::size_t name) const {
        double sum = 0;
        for (const ArcOf arc : path.route.arcs)
            if (name_of_[graph_[arc].index] == name) sum += paths_.priced().cost(arc).seconds;
        return path.scale * sum;
    }

    /// The arc of that name that is run fastest, on paths that could win.
    std::optional<ArcOf> fastest(std::size_t name) const {
        std::optional<ArcOf> best;
        for (const Candidate* path : able_)
            for (const ArcOf arc : path->route.arcs)
                if (name_of_[graph_[arc].index] == name && (!best || one_run(arc) < one_run(*best)))
                    best = arc;
        return best;
    }

    double one_run(ArcOf arc) const {
        return paths_.priced().cost(arc).seconds / graph_[arc].offer.to.runs();
    }

    void advise_cost(std::size_t name, Advice& advice) const {
        const auto arc = fastest(name);
        if (!arc) return;
        const StepCost& cost = paths_.priced().cost(*arc);
        const double among = std::max(1.0, cost.from_ranks);
        CostAdvice one;
        one.name = names_[name];
        one.state = state_of(one.name, profile_.counted(cost.work) / among, profile_, build_);
        if (one.state == "measured") {
            ++advice.measured;
            return;
        }
        if (one.state == "stale") one.when = profile_.when;
        one.seconds = one_run(*arc);
        one.spread = cost.spread;
        one.measuring = kMeasured * one.seconds;
        one.regret = regret(name, cost.spread);
        if (one.regret > kNothing * chosen_->choice.seconds)
            advice.costs.push_back(std::move(one));
        else
            ++advice.idle;
    }

    /// Each path is a line in this cost. Among lines of one slope the lowest counts.
    double regret(std::size_t name, double spread) const {
        std::map<double, double> lines;  // slope, the rest
        for (const Candidate* path : able_) {
            const double slope = seconds_in(*path, name);
            const double rest = path->choice.seconds - slope;
            const auto [line, fresh] = lines.emplace(slope, rest);
            if (!fresh) line->second = std::min(line->second, rest);
        }
        const double own = seconds_in(*chosen_, name), rest = chosen_->choice.seconds - own;
        double sum = 0;
        for (const double z : normal_quantiles()) {
            const double factor = std::exp(spread * z), now = rest + own * factor;
            double best = now;
            for (const auto& [slope, others] : lines)
                best = std::min(best, others + slope * factor);
            sum += now - best;
        }
        return sum / kQuantiles;
    }

    /// Algorithms that read a part of their input, a plane of a spectrum or what is not empty, can
    /// take less than all of it moved once: then no more than the fastest of them.
    double bound(const Ends& ends) const {
        const Representation &in = graph_[ends.first].what, &out = graph_[ends.second].what;
        const Work least{.operations = static_cast<double>(std::max(in.samples(), out.samples())),
                         .streamed = in.bytes() + out.bytes(),
                         .swept = in.bytes() + out.bytes()};
        const bool spread = in.place == Place::ranks || out.place == Place::ranks;
        const double moved = out.runs() * profile_.counted(least).seconds /
                             std::max(1, profile_.processors) /
                             (spread ? std::max(1, want_.ranks) : 1);
        const auto known = fastest_.find(ends);
        return known == fastest_.end() ? moved : std::min(moved, known->second);
    }

    /// A path with an ideal edge in place of its arcs from `i` to before `j`.
    Predicted with_ideal(const Candidate& path, std::size_t i, std::size_t j, double least) const {
        const Priced& priced = paths_.priced();
        const auto& arcs = path.route.arcs;
        Label label = priced.start(path.route.source);
        for (std::size_t k = 0; k < arcs.size(); ++k) {
            if (k == i) {
                const At from = boost::source(arcs[i], graph_),
                         to = boost::target(arcs[j - 1], graph_);
                StepCost ideal;
                ideal.seconds = least;
                ideal.from_ranks = priced.cost(arcs[i]).from_ranks;
                ideal.to_ranks = priced.cost(arcs[j - 1]).to_ranks;
                label = extend(label, {.from = graph_[from].what, .to = graph_[to].what}, ideal,
                               graph_[from].source >= 0, priced.pinned);
            }
            if (k < i || k >= j) label = priced.step(label, arcs[k]);
        }
        return {label.seconds, 0,
                paths_.options().resident +
                    std::max(label.peak, priced.pinned + paths_.options().after),
                label.error() / paths_.ask().scene.range, label.known};
    }

    std::vector<ArcAdvice> missing() const {
        std::map<Ends, Part> known;      // the fastest; one on a path that could win before others
        std::map<Ends, double> planned;  // the fastest path with an ideal edge there
        each_part([&](const Part& part) {
            Part& way = known[part.ends];
            const bool serves = could_win(part.path->choice);
            const bool served = way.path && could_win(way.path->choice);
            if (!way.path || (serves == served ? part.seconds < way.seconds : serves)) way = part;
            const Predicted ideal = with_ideal(*part.path, part.begin, part.end, bound(part.ends));
            if (!could_win(ideal)) return;
            const auto [best, fresh] = planned.emplace(part.ends, ideal.seconds);
            if (!fresh) best->second = std::min(best->second, ideal.seconds);
        });
        std::vector<ArcAdvice> all;
        for (const auto& [ends, seconds] : planned) {
            const Part& way = known[ends];
            const double least = bound(ends);
            const double gain = chosen_->choice.seconds - seconds;
            if (way.seconds < kFar * least || gain <= kNothing * chosen_->choice.seconds) continue;
            all.push_back(arc_advice(way, least));
            all.back().plan = seconds;
            all.back().gain = gain;
        }
        return ranked(std::move(all));
    }

    ArcAdvice arc_advice(const Part& way, double least) const {
        const Representation& in = graph_[way.ends.first].what;
        const Representation& out = graph_[way.ends.second].what;
        const auto begin = way.path->steps.begin();
        ArcAdvice one{in.text(),   out.text(), in.kind(),
                      out.kind(),  {},         could_win(way.path->choice),
                      way.seconds, least};
        one.best.assign(begin + std::ptrdiff_t(way.begin), begin + std::ptrdiff_t(way.end));
        return one;
    }

    /// Largest gain first; vertices that differ in history alone are one.
    static std::vector<ArcAdvice> ranked(std::vector<ArcAdvice> all) {
        std::stable_sort(all.begin(), all.end(),
                         [](const ArcAdvice& a, const ArcAdvice& b) { return a.gain > b.gain; });
        std::set<std::pair<std::string, std::string>> seen;
        std::vector<ArcAdvice> each;
        for (ArcAdvice& one : all)
            if (seen.emplace(one.from, one.to).second) each.push_back(std::move(one));
        return each;
    }

    const Candidates& paths_;
    const Graph& graph_;
    const Profile& profile_;
    const std::string& build_;
    const Request& want_;
    Budget budget_;
    const Candidate* chosen_ = nullptr;
    std::map<Ends, double> fastest_;      // [s] of a part between these, whatever its error
    std::vector<std::string> names_;      // of costs
    std::vector<std::size_t> name_of_;    // of arcs, by edge_index
    std::vector<const Candidate*> able_;  // to win
};

}  // namespace

Advice advise(const Candidates& paths, const Plan& plan, const Profile& profile,
              const std::string& build) {
    return Adviser(paths, plan, profile, build).advice();
}

}  // namespace edgewise
