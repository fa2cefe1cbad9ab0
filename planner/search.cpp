#include "planner/search.hpp"

#include <algorithm>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <boost/graph/r_c_shortest_paths.hpp>
#include <limits>

namespace edgewise {
namespace {

using At = Graph::vertex_descriptor;
using ArcOf = Graph::edge_descriptor;

struct SearchVertex {};

/// An arc of the search: one of the transform graph, or one from the super-source or to the
/// super-sink, which r_c_shortest_paths needs and which cost nothing.
struct SearchArc {
    std::size_t index = 0;
    ArcOf arc{};
    bool real = false;
    At source{};  // of an arc from the super-source
    double seconds = 0;
};

using SearchGraph =
    boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, SearchVertex, SearchArc>;

struct Search {
    SearchGraph graph;
    At from, to;

    explicit Search(const Priced& priced)
        : graph(boost::num_vertices(priced.spanned.graph) + 2),
          from(boost::num_vertices(graph) - 2),
          to(boost::num_vertices(graph) - 1) {
        const Graph& spanned = priced.spanned.graph;
        for (const At source : priced.spanned.sources)
            add(from, source, {.source = source, .seconds = priced.start(source).seconds});
        for (const ArcOf arc : boost::make_iterator_range(boost::edges(spanned)))
            add(boost::source(arc, spanned), boost::target(arc, spanned),
                {.arc = arc, .real = true, .seconds = priced.cost(arc).seconds});
        for (const At target : priced.spanned.targets) add(target, to, {});
    }

    void add(At u, At v, SearchArc arc) {
        arc.index = boost::num_edges(graph);
        boost::add_edge(u, v, arc, graph);
    }
};

/// The resources of a path; the queue of the search is ordered by operator<.
struct Resources {
    Label label;
    // The library's concept asks for it; its code does not call it.
    [[maybe_unused]] friend bool operator==(const Resources& a, const Resources& b) {
        return !before(a.label, b.label) && !before(b.label, a.label);
    }
    friend bool operator<(const Resources& a, const Resources& b) {
        return before(a.label, b.label);
    }
};

struct Extend {
    const Priced* priced;
    bool operator()(const SearchGraph& graph, Resources& to, const Resources& from,
                    SearchGraph::edge_descriptor arc) const {
        const SearchArc& step = graph[arc];
        if (step.real)
            to.label = priced->step(from.label, step.arc);
        else if (boost::source(arc, graph) == boost::num_vertices(graph) - 2)
            to.label = priced->start(step.source);
        else
            to.label = from.label;
        return true;  // budgets choose on the finished front; nothing is pruned
    }
};

struct Dominance {
    bool operator()(const Resources& a, const Resources& b) const {
        return dominates(a.label, b.label);  // must be "<=" here: see dominates()
    }
};

Route route_of(const Search& search, const std::vector<SearchGraph::edge_descriptor>& path,
               const Priced& priced) {
    Route route;
    for (const auto& arc : path) {
        const SearchArc& step = search.graph[arc];
        if (step.real)
            route.arcs.push_back(step.arc);
        else if (boost::source(arc, search.graph) == search.from)
            route.source = step.source;
    }
    route.label = priced.start(route.source);
    for (const ArcOf arc : route.arcs) route.label = priced.step(route.label, arc);
    return route;
}

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

std::vector<Route> pareto_routes(const Priced& priced) {
    if (priced.spanned.targets.empty()) return {};
    const Search search(priced);
    std::vector<std::vector<SearchGraph::edge_descriptor>> paths;
    std::vector<Resources> resources;
    // The overload for one solution returns the first label that reached the target, not the best
    // (Boost 1.74), so all are asked for and sorted here.
    boost::r_c_shortest_paths(
        search.graph, boost::get(boost::vertex_index, search.graph),
        boost::get(&SearchArc::index, search.graph), search.from, search.to, paths, resources,
        Resources{}, Extend{&priced}, Dominance{},
        std::allocator<boost::r_c_shortest_paths_label<SearchGraph, Resources>>(),
        boost::default_r_c_shortest_paths_visitor());
    std::vector<Route> routes;
    for (auto& path : paths) {
        std::reverse(path.begin(), path.end());  // they come from target to source
        routes.push_back(route_of(search, path, priced));
    }
    std::stable_sort(routes.begin(), routes.end(),
                     [](const Route& a, const Route& b) { return before(a.label, b.label); });
    return routes;
}

std::vector<Route> fastest_route(const Priced& priced) {
    if (priced.spanned.targets.empty()) return {};
    const Search search(priced);
    std::vector<At> before_it(boost::num_vertices(search.graph));
    std::vector<double> seconds(before_it.size());
    boost::dijkstra_shortest_paths(
        search.graph, search.from,
        boost::weight_map(boost::get(&SearchArc::seconds, search.graph))
            .predecessor_map(boost::make_iterator_property_map(
                before_it.begin(), boost::get(boost::vertex_index, search.graph)))
            .distance_map(boost::make_iterator_property_map(
                seconds.begin(), boost::get(boost::vertex_index, search.graph))));
    std::vector<SearchGraph::edge_descriptor> path;
    for (At at = search.to; at != search.from; at = before_it[at]) {
        // Of parallel arcs the cheapest is the one that Dijkstra took.
        std::optional<SearchGraph::edge_descriptor> best;
        for (const auto arc :
             boost::make_iterator_range(boost::out_edges(before_it[at], search.graph)))
            if (boost::target(arc, search.graph) == at &&
                (!best || search.graph[arc].seconds < search.graph[*best].seconds))
                best = arc;
        path.push_back(*best);
    }
    std::reverse(path.begin(), path.end());
    return {route_of(search, path, priced)};
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
