#include "planner/search.hpp"

#include <algorithm>
#include <boost/graph/r_c_shortest_paths.hpp>
#include <gtest/gtest.h>
#include <optional>
#include <set>

#include "tests/planner/random_graph.hpp"

namespace edgewise {
namespace {

using toys::BruteForce;
using toys::Planned;
using toys::random_graph;
using toys::ToyEdge;
using toys::unit_profile;
using toys::Walked;

constexpr int kGraphs = 600;
constexpr double kPinned = 2;

/// Labels rounded to where whole numbers under gains of 1, 1.5 and 2 stay exact, and hypot to 1e-9.
std::vector<std::int64_t> rounded(const Label& label) {
    std::vector<std::int64_t> all;
    for (double x : {label.seconds, label.peak, label.held, label.bias, label.noise})
        all.push_back(std::llround(x * 1e9));
    all.push_back(label.known);
    return all;
}

bool better_or_equal(const std::vector<std::int64_t>& a, const std::vector<std::int64_t>& b) {
    return a[5] >= b[5] && a[0] <= b[0] && a[1] <= b[1] && a[2] <= b[2] && a[3] <= b[3] &&
           a[4] <= b[4];
}

/// The different labels that no other label beats.
std::set<std::vector<std::int64_t>> best_labels(const std::vector<Walked>& paths) {
    std::set<std::vector<std::int64_t>> all, best;
    for (const Walked& path : paths) all.insert(rounded(path.label));
    for (const auto& b : all)
        if (std::none_of(all.begin(), all.end(),
                         [&](const auto& a) { return a != b && better_or_equal(a, b); }))
            best.insert(b);
    return best;
}

/// A random graph spanned and priced.
struct Spanned : Planned {
    TransformGraph spanned;
    Priced priced;
    BruteForce brute;

    explicit Spanned(std::mt19937& random)
        : Planned(random_graph(random)),
          spanned(expand(catalogue, ask(), sources)),
          priced{spanned, sources, {}, kPinned},
          brute(toy, kPinned) {
        priced.costs.resize(boost::num_edges(spanned.graph));
        for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
            const Arc& what = spanned.graph[arc];
            priced.costs[what.index] =
                cost_of(catalogue[what.edge], what.offer, ask(), unit_profile(), 1);
        }
    }
};

TEST(Search, FrontIsThatOfBruteForce) {
    std::mt19937 random(1);
    std::size_t paths = 0, fronts = 0;
    for (int i = 0; i < kGraphs; ++i) {
        const Spanned graph(random);
        std::set<std::vector<std::int64_t>> found;
        const std::vector<Route> routes = pareto_routes(graph.priced);
        for (const Route& route : routes) {
            found.insert(rounded(route.label));
            std::set<Graph::vertex_descriptor> visited{route.source};
            for (const auto arc : route.arcs)
                EXPECT_TRUE(visited.insert(boost::target(arc, graph.spanned.graph)).second)
                    << "graph " << i << ": a path goes round a cycle";
        }
        EXPECT_EQ(found, best_labels(graph.brute.paths())) << "graph " << i;
        EXPECT_EQ(found.size(), routes.size()) << "graph " << i << ": equal labels kept twice";
        paths += graph.brute.paths().size();
        fronts += found.size();
    }
    EXPECT_GT(paths, 20 * kGraphs);  // else the graphs say little
    EXPECT_GT(fronts, kGraphs);
}

TEST(Search, LeastTimeIsThatOfBruteForce) {
    std::mt19937 random(2);
    for (int i = 0; i < kGraphs; ++i) {
        const Spanned graph(random);
        const std::optional<Route> fastest = fastest_route(graph.priced);
        if (graph.brute.paths().empty()) {
            EXPECT_FALSE(fastest) << "graph " << i;
            continue;
        }
        double least = graph.brute.paths()[0].label.seconds;
        for (const Walked& path : graph.brute.paths()) least = std::min(least, path.label.seconds);
        ASSERT_TRUE(fastest) << "graph " << i;
        EXPECT_DOUBLE_EQ(fastest->label.seconds, least) << "graph " << i;
        double sum = 0;
        for (const auto arc : fastest->arcs) sum += graph.priced.cost(arc).seconds;
        EXPECT_DOUBLE_EQ(sum, least) << "graph " << i;
    }
}

TEST(Search, EverySimplePathIsEnumeratedOnce) {
    std::mt19937 random(3);
    for (int i = 0; i < kGraphs; ++i) {
        const Spanned graph(random);
        std::multiset<std::pair<std::vector<std::string>, std::vector<std::int64_t>>> ours, theirs;
        for (const Walked& path : graph.brute.paths())
            ours.insert({path.texts, rounded(path.label)});
        for (const Route& route : simple_routes(graph.priced, 1000000)) {
            std::vector<std::string> texts;
            for (const auto arc : route.arcs) {
                const Arc& what = graph.spanned.graph[arc];
                texts.push_back(graph.catalogue[what.edge].name + what.offer.with.text());
            }
            theirs.insert({texts, rounded(route.label)});
        }
        EXPECT_EQ(ours, theirs) << "graph " << i;
    }
    const Spanned graph(random);
    EXPECT_LE(simple_routes(graph.priced, 3).size(), 3u);
}

/// What boost::check_r_c_path walks with: the rules of the test, not those of the planner.
struct Checked {
    Label label;
    bool first = true;
    friend bool operator==(const Checked& a, const Checked& b) {
        return rounded(a.label) == rounded(b.label);
    }
    friend bool operator<(const Checked& a, const Checked& b) {
        return rounded(a.label) < rounded(b.label);
    }
};

TEST(Search, RoutesPassTheCheckOfBoost) {
    std::mt19937 random(4);
    int checked = 0;
    for (int i = 0; i < kGraphs; ++i) {
        const Spanned graph(random);
        const auto extend_by_table = [&](const Graph& g, Checked& to, const Checked& from,
                                         Graph::edge_descriptor arc) {
            const Arc& what = g[arc];
            const ToyEdge& edge = graph.toy.edges[what.edge];
            const bool chosen = what.offer.with.contains("p");
            const auto& cost = edge.choices[chosen ? int(what.offer.with.number("p")) : 0];
            to = {graph.brute.extended(from.label, edge, cost, from.first), false};
            return true;
        };
        for (const Route& route : pareto_routes(graph.priced)) {
            if (route.arcs.empty()) continue;
            bool path = false, feasible = false, right = false;
            Checked actual;
            Graph::edge_descriptor last;
            boost::check_r_c_path(
                graph.spanned.graph, route.arcs, Checked{graph.priced.start(route.source)}, true,
                Checked{route.label}, actual, extend_by_table, path, feasible, right, last);
            EXPECT_TRUE(path && feasible && right) << "graph " << i;
            EXPECT_EQ(boost::source(route.arcs.front(), graph.spanned.graph), route.source);
            ++checked;
        }
    }
    EXPECT_GT(checked, kGraphs);
}

/// The graph as boost::r_c_shortest_paths takes it: one source and one sink, joined to the others
/// by arcs that cost nothing.
struct NetArc {
    std::size_t index = 0;
    std::optional<Graph::edge_descriptor> arc = {};      // none: to the sink, or
    std::optional<Graph::vertex_descriptor> first = {};  // from the source, to this vertex
};
using Net =
    boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, boost::no_property, NetArc>;

struct Resources {
    Label label;
    [[maybe_unused]] friend bool operator==(const Resources& a, const Resources& b) {
        return !before(a.label, b.label) && !before(b.label, a.label);
    }
    friend bool operator<(const Resources& a, const Resources& b) {
        return before(a.label, b.label);
    }
};

std::set<std::vector<std::int64_t>> labels_by_boost(const Priced& priced) {
    const Graph& graph = priced.spanned.graph;
    const auto from = boost::num_vertices(graph), to = from + 1;
    Net net(to + 1);
    const auto add = [&](std::size_t u, std::size_t v, NetArc arc) {
        arc.index = boost::num_edges(net);
        boost::add_edge(u, v, arc, net);
    };
    for (const auto at : priced.spanned.sources) add(from, at, {.first = at});
    for (const auto at : priced.spanned.targets) add(at, to, {});
    for (const auto arc : boost::make_iterator_range(boost::edges(graph)))
        add(boost::source(arc, graph), boost::target(arc, graph), {.arc = arc});
    const auto extend_label = [&](const Net& n, Resources& next, const Resources& label, auto arc) {
        const NetArc& what = n[arc];
        next.label = what.arc     ? priced.step(label.label, *what.arc)
                     : what.first ? priced.start(*what.first)
                                  : label.label;
        return true;
    };
    const auto beats = [](const Resources& a, const Resources& b) {
        return dominates(a.label, b.label);
    };
    std::vector<std::vector<Net::edge_descriptor>> paths;
    std::vector<Resources> found;
    // The overload for one solution returns the first label that reached the sink (Boost 1.74).
    boost::r_c_shortest_paths(net, boost::get(boost::vertex_index, net),
                              boost::get(&NetArc::index, net), from, to, paths, found, Resources{},
                              extend_label, beats,
                              std::allocator<boost::r_c_shortest_paths_label<Net, Resources>>(),
                              boost::default_r_c_shortest_paths_visitor());
    std::set<std::vector<std::int64_t>> labels;
    for (const Resources& one : found) labels.insert(rounded(one.label));
    return labels;
}

TEST(Search, FrontIsThatOfBoost) {
    std::mt19937 random(5);
    std::size_t labels = 0;
    for (int i = 0; i < kGraphs; ++i) {
        const Spanned graph(random);
        if (graph.spanned.targets.empty()) continue;
        std::set<std::vector<std::int64_t>> ours;
        for (const Route& route : pareto_routes(graph.priced)) ours.insert(rounded(route.label));
        EXPECT_EQ(ours, labels_by_boost(graph.priced)) << "graph " << i;
        labels += ours.size();
    }
    EXPECT_GT(labels, kGraphs);
}

TEST(Search, EqualLabelsAreKeptOnceAndCyclesWithoutCostEnd) {
    toys::ToyGraph toy;
    toy.vertices = {{1}, {1}, {1}, {1, true}};
    const toys::ToyCost free{.operations = 0};
    // Twelve equal ways from 0 to 1, a cycle 1 <-> 2 for nothing, one way out.
    for (int i = 0; i < 12; ++i) toy.edges.push_back({0, 1, {free}});
    toy.edges.push_back({1, 2, {free, free}});
    toy.edges.push_back({2, 1, {free, free}});
    toy.edges.push_back({1, 3, {free, free}});
    const Planned planned(toy);
    const Answer answer = planned.answer();
    ASSERT_TRUE(answer.plan);
    EXPECT_EQ(answer.front.size(), 1u);
    EXPECT_EQ(answer.plan->steps.size(), 2u);
    EXPECT_EQ(answer.plan->steps[0].by->name, "toy.e0");  // the earlier in the catalogue
}

TEST(Search, ThirtyLayersOfTiesAreNoMoreWorkThanOne) {
    // 4^30 paths, all of one label: only weak dominance ends.
    toys::ToyGraph toy;
    for (int v = 0; v < 31; ++v) toy.vertices.push_back({1, v == 30});
    for (int v = 0; v < 30; ++v) toy.edges.push_back({v, v + 1, {{}, {}, {}, {}}});
    const Planned planned(toy);
    const Answer answer = planned.answer();
    ASSERT_TRUE(answer.plan);
    EXPECT_EQ(answer.plan->steps.size(), 30u);
    EXPECT_EQ(answer.front.size(), 1u);
}

}  // namespace
}  // namespace edgewise
