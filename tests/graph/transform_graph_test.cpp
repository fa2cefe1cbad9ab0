#include "graph/transform_graph.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

namespace edgewise {
namespace {

/// A made-up edge between kinds "space/content"; it leads to what it says.
Transition edge(std::string name, std::string from, std::string to) {
    const std::size_t slash = to.find('/');
    const std::string space = to.substr(0, slash), content = to.substr(slash + 1);
    Transition made{.name = std::move(name), .joins = {{from, to}}};
    made.offer = [space, content](const Representation& what, const Ask&, const Parameters&) {
        Offer offer{.from = what, .to = what};
        offer.to.space = space;
        offer.to.content = content;
        return offer;
    };
    return made;
}

Transition refusing(std::string name, std::string from, std::string to, std::string why) {
    Transition made = edge(std::move(name), std::move(from), std::move(to));
    made.offer = [why](const Representation&, const Ask&, const Parameters&) {
        return Offer::no(why);
    };
    return made;
}

struct Spanning {
    Request want;
    Scene scene;
    Spanning() { want.job = Job::warp; }

    TransformGraph of(const Catalogue& catalogue, const Demands& demands = {},
                      std::vector<Source> sources = {{}}) const {
        return expand(catalogue, {want, scene}, sources, demands);
    }
};

std::multiset<std::string> arcs_of(const TransformGraph& spanned, const Catalogue& catalogue) {
    std::multiset<std::string> all;
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Arc& what = spanned.graph[arc];
        all.insert(spanned.graph[boost::source(arc, spanned.graph)].what.kind() + " " +
                   catalogue[what.edge].name + what.offer.with.text());
    }
    return all;
}

std::vector<std::string> texts(const TransformGraph& spanned, const Catalogue& catalogue,
                               Graph::vertex_descriptor at) {
    const auto& graph = spanned.graph;
    std::vector<std::string> all;
    if (graph[at].target) all.push_back("");
    for (const auto arc : boost::make_iterator_range(boost::out_edges(at, graph)))
        for (const std::string& rest : texts(spanned, catalogue, boost::target(arc, graph)))
            all.push_back(" " + catalogue[graph[arc].edge].name + graph[arc].offer.with.text() +
                          rest);
    return all;
}

/// All paths of a graph without cycles, as text.
std::set<std::string> paths(const TransformGraph& spanned, const Catalogue& catalogue) {
    std::set<std::string> all;
    for (const auto source : spanned.sources)
        for (const std::string& text : texts(spanned, catalogue, source))
            EXPECT_TRUE(all.insert(text).second) << text << " is there twice";
    return all;
}

TEST(Expansion, AsksSomeEdgesOnlyWhereTheyAreNamed) {
    Catalogue catalogue{edge("a.first", "object/scalar", "screen/classified"),
                        edge("a.second", "screen/classified", "screen/scalar"),
                        edge("b.other", "object/scalar", "screen/scalar")};
    catalogue[1].on_demand = true;
    const Spanning spanning;
    using Names = std::multiset<std::string>;
    const TransformGraph unasked = spanning.of(catalogue);
    EXPECT_EQ(arcs_of(unasked, catalogue), Names{"object/scalar b.other"});
    ASSERT_EQ(unasked.refused.size(), 1u);
    EXPECT_EQ(unasked.refused[0].reason, message("taken only where @via names it"));
    const Names asked{"object/scalar a.first", "screen/classified a.second"};
    EXPECT_EQ(arcs_of(spanning.of(catalogue, {.via = {{.name = "a.second"}}}), catalogue), asked);
    // By its family, which the edge before it answers.
    EXPECT_EQ(arcs_of(spanning.of(catalogue, {.via = {{.name = "a"}}}), catalogue), asked);
    // One that is forbidden has that reason.
    EXPECT_TRUE(spanning.of(catalogue, {.via = {{.name = "a"}}, .without = {{.name = "a.second"}}})
                    .targets.empty());
}

TEST(Expand, AsksOnlyWhereKindsJoin) {
    Catalogue edges = {edge("a.on", "object/scalar", "middle/scalar"),
                       edge("a.off", "middle/scalar", "screen/scalar"),
                       edge("a.elsewhere", "object/spectrum", "screen/scalar")};
    int asked = 0;
    edges[2].offer = [&](const Representation&, const Ask&, const Parameters&) {
        ++asked;
        return Offer::no("never");
    };
    const TransformGraph spanned = Spanning().of(edges);
    EXPECT_EQ(asked, 0);
    EXPECT_EQ(paths(spanned, edges), (std::set<std::string>{" a.on a.off"}));
    ASSERT_EQ(spanned.refused.size(), 1u);
    EXPECT_EQ(spanned.refused[0].reason, "nothing makes its object/spectrum");
}

TEST(Expand, RefusalsReachTheUserOnlyWhereNothingWasAccepted) {
    Catalogue edges = {refusing("a.never", "object/scalar", "screen/scalar", "det is 0.5"),
                       edge("a.make", "object/scalar", "middle/scalar"),
                       edge("a.sometimes", "object/scalar", "screen/scalar"),
                       refusing("a.spectrum", "object/scalar", "object/spectrum", "too large"),
                       edge("a.slice", "object/spectrum", "screen/scalar")};
    edges[2].joins.push_back({"middle/scalar", "screen/scalar"});
    edges[2].offer = [](const Representation& what, const Ask& ask, const Parameters&) {
        if (what.space == "middle") return Offer::no("not from here");
        return Offer{.from = what, .to = screen_scalar(what, ask.want)};
    };
    const TransformGraph spanned = Spanning().of(edges);
    std::map<std::string, std::string> why;
    for (const Refusal& refusal : spanned.refused) why[refusal.transition] = refusal.reason.text();
    EXPECT_EQ(why, (std::map<std::string, std::string>{
                       {"a.never", "det is 0.5"},
                       {"a.spectrum", "too large"},
                       {"a.slice", "nothing makes its object/spectrum: a.spectrum: too large"}}));
    EXPECT_EQ(paths(spanned, edges), (std::set<std::string>{" a.sometimes"}));
    // What leads nowhere is dropped: the middle is made, but no edge takes it to the screen.
    EXPECT_EQ(boost::num_vertices(spanned.graph), 2u);
}

TEST(Expand, PreparationsKeepTheOrderOfTheCatalogue) {
    Catalogue edges;
    for (const char* facet : {"a", "b", "c"}) {
        Transition add = edge(std::string("prepare.") + facet, "", "");
        // Every set of facets that lacks this one.
        add.joins.clear();
        for (const char* kind : {"", "+a", "+b", "+c", "+a+b", "+a+c", "+b+c"})
            add.joins.push_back({std::string("object/scalar") + kind, "object/scalar+more"});
        add.offer = [facet = std::string(facet)](const Representation& what, const Ask&,
                                                 const Parameters&) {
            Offer offer{.from = what, .to = what};
            offer.to.facets.insert(facet);
            return offer;
        };
        edges.push_back(add);
    }
    Transition warp = edge("warp.toy", "", "screen/scalar");
    warp.joins.clear();
    for (const char* kind : {"", "+a", "+b", "+c", "+a+b", "+a+c", "+b+c", "+a+b+c"})
        warp.joins.push_back({std::string("object/scalar") + kind, "screen/scalar"});
    warp.offer = [](const Representation& what, const Ask& ask, const Parameters&) {
        return Offer{.from = what, .to = screen_scalar(what, ask.want)};
    };
    edges.push_back(warp);
    const std::set<std::string> ordered = {
        " warp.toy",
        " prepare.a warp.toy",
        " prepare.b warp.toy",
        " prepare.c warp.toy",
        " prepare.a prepare.b warp.toy",
        " prepare.a prepare.c warp.toy",
        " prepare.b prepare.c warp.toy",
        " prepare.a prepare.b prepare.c warp.toy",
    };
    EXPECT_EQ(paths(Spanning().of(edges), edges), ordered);
    // A program appends its own preparation behind the warps: they still follow it.
    Catalogue appended{edges[3]};
    for (std::size_t i = 0; i < 3; ++i) appended.push_back(edges[i]);
    edges = appended;
    EXPECT_EQ(edges[0].name, "warp.toy");
    EXPECT_EQ(paths(Spanning().of(edges), edges), ordered);
}

TEST(Expand, ParametersMakeParallelArcs) {
    Catalogue edges = {edge("a.b", "object/scalar", "screen/scalar")};
    edges[0].parameters = {{"filter", one_of({"zoh", "foh"})}, {"step", number(0, 9, {1, 2})}};
    const TransformGraph spanned = Spanning().of(edges);
    EXPECT_EQ(boost::num_vertices(spanned.graph), 2u);
    EXPECT_EQ(paths(spanned, edges),
              (std::set<std::string>{" a.b/filter=foh/step=1", " a.b/filter=foh/step=2",
                                     " a.b/filter=zoh/step=1", " a.b/filter=zoh/step=2"}));
    std::set<std::size_t> indices;
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph)))
        indices.insert(spanned.graph[arc].index);
    EXPECT_EQ(indices, (std::set<std::size_t>{0, 1, 2, 3}));
}

/// Two ways over the middle and one straight on, each with a value to choose.
Catalogue crossing() {
    Catalogue edges = {edge("over.on", "object/scalar", "middle/scalar"),
                       edge("over.off", "middle/scalar", "screen/scalar"),
                       edge("straight.on", "object/scalar", "screen/scalar")};
    edges[0].parameters = {{"step", number(0, 9, {1, 2})}};
    return edges;
}

TEST(Expand, ViaIsPassedInOrderWithItsValues) {
    const Catalogue edges = crossing();
    const auto via = [&](std::vector<std::string> names) {
        Demands demands;
        for (const std::string& name : names) demands.via.push_back(demand_of(name, edges));
        return paths(Spanning().of(edges, demands), edges);
    };
    EXPECT_EQ(via({}).size(), 3u);
    EXPECT_EQ(via({"straight"}), (std::set<std::string>{" straight.on"}));
    EXPECT_EQ(via({"over.on/step=2"}), (std::set<std::string>{" over.on/step=2 over.off"}));
    EXPECT_EQ(via({"over.on/step=7"}),  // a value that is not tried by itself
              (std::set<std::string>{" over.on/step=7 over.off"}));
    EXPECT_EQ(via({"over.off"}).size(), 2u);
    EXPECT_EQ(via({"over", "over"}).size(), 2u);
    EXPECT_TRUE(via({"over.off", "over.on"}).empty());
    EXPECT_TRUE(via({"straight", "over"}).empty());
}

TEST(Expand, WithoutForbidsAnEdgeAFamilyOrOneValue) {
    const Catalogue edges = crossing();
    const auto without = [&](const char* name) {
        return paths(Spanning().of(edges, {.without = {demand_of(name, edges)}}), edges);
    };
    EXPECT_EQ(without("over"), (std::set<std::string>{" straight.on"}));
    EXPECT_EQ(without("over.off"), (std::set<std::string>{" straight.on"}));
    EXPECT_EQ(without("over.on/step=1"),
              (std::set<std::string>{" straight.on", " over.on/step=2 over.off"}));
    const TransformGraph spanned =
        Spanning().of(edges, {.without = {demand_of("straight", edges)}});
    ASSERT_EQ(spanned.refused.size(), 1u);
    EXPECT_EQ(spanned.refused[0].reason, "forbidden by the request");
}

TEST(Expand, SourcesStayApartFromWhatEdgesMake) {
    const Catalogue edges = crossing();
    Representation middle;
    middle.space = "middle";
    const TransformGraph spanned =
        Spanning().of(edges, {}, {{}, {middle, {.bias = 3}}, {middle, {.seconds = 1}}});
    EXPECT_EQ(spanned.sources.size(), 3u);
    std::set<int> sources;
    for (const auto at : spanned.sources) {
        sources.insert(spanned.graph[at].source);
        EXPECT_EQ(boost::in_degree(at, spanned.graph), 0u);
    }
    EXPECT_EQ(sources, (std::set<int>{0, 1, 2}));
    EXPECT_EQ(arcs_of(spanned, edges).count("middle/scalar over.off"), 3u);
}

TEST(Expand, TargetMayBeThereAlready) {
    Representation there;
    there.space = "screen";
    const TransformGraph spanned = Spanning().of(crossing(), {}, {{there}});
    EXPECT_EQ(spanned.sources, spanned.targets);
    EXPECT_EQ(boost::num_edges(spanned.graph), 0u);
    EXPECT_TRUE(Spanning()
                    .of(crossing(), {.via = {{"straight"}}}, {{there}})
                    .targets.empty());  // what is demanded has not been done
}

TEST(Expand, EndlessEdgesAreReported) {
    Catalogue edges = {edge("a.grow", "middle/scalar", "middle/scalar")};
    edges[0].offer = [](const Representation& what, const Ask&, const Parameters&) {
        Offer offer{.from = what, .to = what};
        ++offer.to.extent.x;
        return offer;
    };
    Representation middle;
    middle.space = "middle";
    EXPECT_THROW(Spanning().of(edges, {}, {{middle}}), RequestError);
}

TEST(Export, JsonHoldsTheGraph) {
    const Catalogue edges = crossing();
    const TransformGraph spanned = Spanning().of(edges);
    const nlohmann::json json = nlohmann::json::parse(
        to_json(spanned, edges, [](const Arc& arc) { return nlohmann::json(arc.index); }).dump());
    EXPECT_EQ(json.at("schema"), 1);
    ASSERT_EQ(json.at("vertices").size(), 3u);
    ASSERT_EQ(json.at("edges").size(), 4u);
    std::set<int> ids;
    for (const auto& vertex : json["vertices"]) ids.insert(vertex.at("id").get<int>());
    int sources = 0, targets = 0;
    for (const auto& vertex : json["vertices"]) {
        sources += vertex.at("source").get<bool>();
        targets += vertex.at("target").get<bool>();
        EXPECT_EQ(vertex.at("bytes"), 4);
    }
    EXPECT_EQ(sources, 1);
    EXPECT_EQ(targets, 1);
    std::multiset<std::string> names;
    for (const auto& arc : json["edges"]) {
        EXPECT_TRUE(ids.contains(arc.at("from")) && ids.contains(arc.at("to")));
        names.insert(arc.at("transition").get<std::string>() + arc.at("parameters").dump());
        EXPECT_TRUE(arc.at("cost").is_number());
    }
    EXPECT_EQ(names, (std::multiset<std::string>{"over.off{}", R"(over.on{"step":1.0})",
                                                 R"(over.on{"step":2.0})", "straight.on{}"}));
    EXPECT_EQ(to_json(edges).at("edges").size(), 3u);
    EXPECT_TRUE(to_json(spanned, edges)["edges"][0]["cost"].is_null());
}

/// Every line of a DOT file is one of a few kinds, and quotes are closed.
void expect_dot(const std::string& dot) {
    const std::regex line(
        R"(digraph \w+ \{|  rankdir=LR;|  (node|edge) \[.*\];|\})"
        R"(|  (\w+|"([^"\\]|\\.)*")( -> (\w+|"([^"\\]|\\.)*"))? \[label="([^"\\]|\\.)*".*\];)");
    std::istringstream lines(dot);
    for (std::string text; std::getline(lines, text);)
        EXPECT_TRUE(std::regex_match(text, line)) << text;
}

TEST(Export, DotIsWellFormedAlsoWithOddText) {
    Catalogue edges = crossing();
    const TransformGraph spanned = Spanning().of(edges);
    const std::string dot = to_dot(spanned, edges, [](const Arc&) { return "a \"cost\"\nof \\"; });
    expect_dot(dot);
    EXPECT_NE(dot.find(R"(straight.on\na \"cost\"\nof \\)"), std::string::npos) << dot;
    expect_dot(to_dot(spanned, edges));
    expect_dot(to_dot(edges));
    EXPECT_NE(to_dot(edges).find(R"("object/scalar" -> "screen/scalar" [label="straight.on"];)"),
              std::string::npos);
}

}  // namespace
}  // namespace edgewise
