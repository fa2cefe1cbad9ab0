#include "planner/search.hpp"

#include <algorithm>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <boost/property_map/function_property_map.hpp>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

namespace edgewise {
namespace {

using At = Graph::vertex_descriptor;
using ArcOf = Graph::edge_descriptor;

/// A vertex and how it was reached.
struct Reached {
    Label label;
    At at{};
    std::ptrdiff_t before = -1;  // index of the label that it extends, or -1: a source
    ArcOf arc{};                 // that led here
    bool beaten = false;         // another label of this vertex dominates it
};

/// Label setting with dominance (Martins 1984): the least label, in the order of `before`, is
/// extended along all arcs. At every vertex those labels stay that no other dominates. Boost's
/// r_c_shortest_paths does the same, and tests compare this one with it.
class LabelSetting {
 public:
    /// @param only  by edge_index, where given: the arcs that routes may take
    explicit LabelSetting(const Priced& priced, const std::vector<char>* only = nullptr)
        : priced_(priced),
          only_(only),
          fronts_(boost::num_vertices(priced.spanned.graph)),
          open_([this](std::size_t a, std::size_t b) { return later(a, b); }) {}

    std::vector<Route> routes() {
        const Graph& graph = priced_.spanned.graph;
        for (const At source : priced_.spanned.sources)
            reach({.label = priced_.start(source), .at = source});
        while (!open_.empty()) {
            const std::size_t place = open_.top();
            open_.pop();
            if (reached_[place].beaten) continue;
            for (const ArcOf arc :
                 boost::make_iterator_range(boost::out_edges(reached_[place].at, graph))) {
                if (priced_.cost(arc).barred || (only_ && !(*only_)[graph[arc].index])) continue;
                reach({.label = priced_.step(reached_[place].label, arc),
                       .at = boost::target(arc, graph),
                       .before = static_cast<std::ptrdiff_t>(place),
                       .arc = arc});
            }
        }
        return found();
    }

 private:
    /// A label of a vertex that none of the others there dominates; copied, as it is compared
    /// often.
    struct Kept {
        Label label;
        std::size_t place;
    };

    bool later(std::size_t a, std::size_t b) const {
        const Label &x = reached_[a].label, &y = reached_[b].label;
        return before(y, x) || (!before(x, y) && a > b);  // of equal ones the first
    }

    void reach(const Reached& next) {
        std::vector<Kept>& front = fronts_[next.at];
        for (const Kept& kept : front)
            if (dominates(kept.label, next.label)) return;  // must be "<=": see dominates()
        // An edge with a gain below 1 may make going round a cycle worth while, for ever.
        if (was_at(next.before, next.at)) return;
        std::erase_if(front, [&](const Kept& kept) {
            const bool beaten = dominates(next.label, kept.label);
            if (beaten) reached_[kept.place].beaten = true;
            return beaten;
        });
        front.push_back({next.label, reached_.size()});
        reached_.push_back(next);
        open_.push(reached_.size() - 1);
    }

    bool was_at(std::ptrdiff_t place, At at) const {
        for (; place >= 0; place = reached_[static_cast<std::size_t>(place)].before)
            if (reached_[static_cast<std::size_t>(place)].at == at) return true;
        return false;
    }

    /// What is left at all targets, in order: whatever dominates a label comes before it.
    std::vector<Route> found() const {
        std::vector<std::size_t> places;
        for (const At target : priced_.spanned.targets)
            for (const Kept& kept : fronts_[target]) places.push_back(kept.place);
        std::sort(places.begin(), places.end(),
                  [&](std::size_t a, std::size_t b) { return later(b, a); });
        std::vector<Route> routes;
        for (const std::size_t place : places) {
            const Label& label = reached_[place].label;
            if (std::none_of(routes.begin(), routes.end(),
                             [&](const Route& other) { return dominates(other.label, label); }))
                routes.push_back(route_to(place));
        }
        return routes;
    }

    Route route_to(std::size_t place) const {
        Route route;
        route.label = reached_[place].label;
        for (; reached_[place].before >= 0;
             place = static_cast<std::size_t>(reached_[place].before))
            route.arcs.push_back(reached_[place].arc);
        route.source = reached_[place].at;
        std::reverse(route.arcs.begin(), route.arcs.end());
        return route;
    }

    const Priced& priced_;
    const std::vector<char>* only_;
    std::vector<Reached> reached_;
    std::vector<std::vector<Kept>> fronts_;  // by vertex
    std::priority_queue<std::size_t, std::vector<std::size_t>,
                        std::function<bool(std::size_t, std::size_t)>>
        open_;
};

void walk(const Priced& priced, std::size_t limit, At at, Route& so_far, std::vector<char>& seen,
          std::vector<Route>& found) {
    const Graph& graph = priced.spanned.graph;
    if (found.size() == limit) return;
    if (graph[at].target) found.push_back(so_far);
    for (const ArcOf arc : boost::make_iterator_range(boost::out_edges(at, graph))) {
        const At next = boost::target(arc, graph);
        if (seen[next]) continue;
        const Label label = so_far.label;
        so_far.arcs.push_back(arc);
        so_far.label = priced.step(label, arc);
        seen[next] = 1;
        walk(priced, limit, next, so_far, seen, found);
        seen[next] = 0;
        so_far.arcs.pop_back();
        so_far.label = label;
    }
}

}  // namespace

const StepCost& Priced::cost(ArcOf arc) const { return costs[spanned.graph[arc].index]; }

Label Priced::start(At source) const { return sources[spanned.graph[source].source].label; }

Label Priced::step(const Label& label, ArcOf arc) const {
    const bool from_source = spanned.graph[boost::source(arc, spanned.graph)].source >= 0;
    return extend(label, spanned.graph[arc].offer, cost(arc), from_source, pinned);
}

std::vector<Route> pareto_routes(const Priced& priced) { return LabelSetting(priced).routes(); }

std::optional<Route> fastest_route(const Priced& priced) {
    const Graph& graph = priced.spanned.graph;
    if (priced.spanned.sources.empty()) return {};
    constexpr double kNone = std::numeric_limits<double>::infinity();
    // No arc leads to a source, so what a source starts with goes with the arcs that leave it.
    const auto weight = [&](const ArcOf& arc) {
        const StepCost& cost = priced.cost(arc);
        const At from = boost::source(arc, graph);
        const double start = graph[from].source >= 0 ? priced.start(from).seconds : 0;
        return cost.barred ? kNone : start + cost.seconds;
    };
    std::vector<double> seconds(boost::num_vertices(graph));
    const auto index = boost::get(boost::vertex_index, graph);
    boost::dijkstra_shortest_paths(
        graph, priced.spanned.sources.begin(), priced.spanned.sources.end(),
        boost::dummy_property_map(), boost::make_iterator_property_map(seconds.begin(), index),
        boost::make_function_property_map<ArcOf>(weight), index, std::less<>(),
        boost::closed_plus<double>(kNone), kNone, 0.0, boost::default_dijkstra_visitor());
    const auto total = [&](At at) {
        return graph[at].source >= 0 ? priced.start(at).seconds : seconds[at];
    };
    double least = kNone;
    for (const At target : priced.spanned.targets) least = std::min(least, total(target));
    if (least == kNone) return {};
    // The arcs of all shortest paths are those that make no vertex later than it must be. Mostly
    // they are a tree; where paths tie, that of least label is taken.
    std::vector<char> tight(boost::num_edges(graph));
    for (const ArcOf arc : boost::make_iterator_range(boost::edges(graph)))
        tight[graph[arc].index] = seconds[boost::source(arc, graph)] + weight(arc) ==
                                      seconds[boost::target(arc, graph)] &&
                                  seconds[boost::target(arc, graph)] <= least;
    return LabelSetting(priced, &tight).routes().front();
}

std::vector<Route> simple_routes(const Priced& priced, std::size_t limit) {
    std::vector<Route> found;
    for (const At source : priced.spanned.sources) {
        std::vector<char> seen(boost::num_vertices(priced.spanned.graph));
        seen[source] = 1;
        Route so_far{source, {}, priced.start(source)};
        walk(priced, limit, source, so_far, seen, found);
    }
    return found;
}

}  // namespace edgewise
