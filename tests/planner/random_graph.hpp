#pragma once

#include <memory>
#include <random>
#include <vector>

#include "planner/candidates.hpp"

namespace edgewise::toys {

/// Costs of one offer of a made-up edge; operations are seconds with unit_profile().
struct ToyCost {
    double operations = 1, scratch = 0, workspace = 0;
    Error error = {};
};

/// A made-up edge between two vertices; more than one choice makes parallel arcs, "toy.e3/p=1".
struct ToyEdge {
    int from = 0, to = 0;
    std::vector<ToyCost> choices;
};

/// A made-up vertex: so many bytes, made once or once a view.
struct ToyVertex {
    std::int64_t bytes = 1;
    bool each_view = false;
};

struct ToySource {
    int vertex = 0;
    Label label;
};

/// A graph written down as tables, so that a test can work out every label by itself. The last
/// vertex is what the request asks for.
struct ToyGraph {
    std::vector<ToyVertex> vertices;
    std::vector<ToyEdge> edges;
    std::vector<ToySource> sources{{}};
    int frames = 4;

    /// A warp without geometry that turns a little from view to view.
    Request request() const {
        Request want;
        want.job = Job::warp;
        want.frames = frames;
        std::vector<Mat4> maps;
        for (int view = 0; view < frames; ++view) {
            maps.push_back(Mat4::Identity());
            maps.back()(0, 3) = view;
        }
        want.views = Placement::each(maps);
        return want;
    }

    Representation representation(int at, const Request& want) const {
        const bool last = at + 1 == static_cast<int>(vertices.size());
        Representation what;
        what.space = last ? "screen" : "n" + std::to_string(at);
        what.type = Type::u8;
        what.extent = {vertices[at].bytes, 1, 1};
        if (vertices[at].each_view) what.placed = want.views;
        return what;
    }

    Catalogue catalogue() const {
        Catalogue all;
        for (std::size_t i = 0; i < edges.size(); ++i) all.push_back(transition(i));
        return all;
    }

    std::vector<Source> planner_sources(const Request& want) const {
        std::vector<Source> all;
        for (const ToySource& source : sources)
            all.push_back({representation(source.vertex, want), source.label});
        return all;
    }

 private:
    Transition transition(std::size_t i) const {
        const ToyEdge edge = edges[i];
        const auto self = std::make_shared<ToyGraph>(*this);
        const auto cost = [edge](const Offer& offer) -> const ToyCost& {
            const bool chosen = offer.with.contains("p");
            return edge.choices[chosen ? static_cast<int>(offer.with.number("p")) : 0];
        };
        const Request want = request();
        Transition made{
            .name = "toy.e" + std::to_string(i),
            .joins = {{representation(edge.from, want).kind(),
                       representation(edge.to, want).kind()}},
            .offer =
                [self, edge](const Representation& from, const Ask& ask, const Parameters&) {
                    return Offer{.from = from, .to = self->representation(edge.to, ask.want)};
                },
            .work =
                [cost](const Offer& offer, const Ask&, int) {
                    const ToyCost& c = cost(offer);
                    return Work{
                        .operations = c.operations, .scratch = c.scratch, .workspace = c.workspace};
                },
            .error = [cost](const Offer& offer, const Ask&) { return cost(offer).error; },
        };
        if (edge.choices.size() > 1) {
            std::vector<double> tried;
            for (std::size_t p = 0; p < edge.choices.size(); ++p) tried.push_back(double(p));
            made.parameters = {{"p", number(0, 9, tried)}};
        }
        return made;
    }
};

/// One operation is one second on one thread; nothing else costs any.
inline Profile unit_profile(int processors = 1, double serial = 0) {
    Profile profile;
    profile.processors = processors;
    profile.operation = 1;
    profile.streamed = profile.gather = profile.local = profile.global = profile.start = 0;
    profile.serial = serial;
    return profile;
}

/// A small random graph: ties, edges without cost, cycles, parallel edges, unknown errors.
inline ToyGraph random_graph(std::mt19937& random, double unknown = 0.1) {
    const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
    const auto chance = [&](double p) { return std::bernoulli_distribution(p)(random); };
    ToyGraph graph;
    const int vertices = 3 + below(5), edges = vertices + below(3 * vertices);
    for (int v = 0; v < vertices; ++v) graph.vertices.push_back({1 + below(6), chance(0.3)});
    graph.vertices.back().each_view = true;
    const auto cost = [&] {
        ToyCost c;
        c.operations = below(4);  // 0 is allowed, and small whole numbers tie
        c.scratch = below(3);
        c.workspace = below(3);
        c.error = {.gain = 1 + 0.5 * below(3),
                   .noise_gain = 1 + 0.5 * below(3),
                   .bias = double(below(3)),
                   .noise = double(below(3)),
                   .known = !chance(unknown)};
        return c;
    };
    for (int e = 0; e < edges; ++e) {
        ToyEdge edge{below(vertices - 1), below(vertices), {cost()}};
        if (chance(0.25)) edge.choices.push_back(cost());
        if (e == 0) edge.from = 0;
        if (edge.from != edge.to) graph.edges.push_back(edge);
    }
    if (chance(0.3))
        graph.sources.push_back(
            {below(vertices - 1), {.bias = double(below(3)), .noise = double(below(2))}});
    return graph;
}

/// A path that the test walked by itself.
struct Walked {
    std::vector<std::string> texts;
    Label label;
    int source = 0;
};

/// Every path without a repeated vertex, with its label worked out from the tables alone
/// (the rules of the design: seconds and held add, peak is the largest step, bias adds behind its
/// gain, noise in squares). A source is a vertex apart from the same data made by an edge.
class BruteForce {
 public:
    BruteForce(const ToyGraph& graph, double pinned) : graph_(graph), pinned_(pinned) {
        for (std::size_t s = 0; s < graph.sources.size(); ++s) {
            seen_.assign(graph.vertices.size(), false);
            source_ = static_cast<int>(s);
            walk(graph.sources[s].vertex, graph.sources[s].label, true);
        }
    }
    const std::vector<Walked>& paths() const { return paths_; }

    Label extended(const Label& a, const ToyEdge& edge, const ToyCost& cost, bool first) const {
        const ToyVertex &u = graph_.vertices[edge.from], &v = graph_.vertices[edge.to];
        const int runs_u = u.each_view ? graph_.frames : 1,
                  runs_v = v.each_view ? graph_.frames : 1;
        const double input = first ? 0 : double(u.bytes);
        Label b;
        b.seconds = a.seconds + runs_v * cost.operations;
        b.held = a.held + (runs_v > runs_u ? input : 0);
        const double beside = runs_v > runs_u ? b.held : b.held + input;
        b.peak = std::max(a.peak, pinned_ + beside + v.bytes + cost.scratch + cost.workspace);
        b.bias = cost.error.gain * a.bias + cost.error.bias;
        b.noise = std::hypot(cost.error.noise_gain * a.noise, cost.error.noise);
        b.known = a.known && cost.error.known;
        return b;
    }

 private:
    void walk(int at, const Label& label, bool first) {
        if (at + 1 == static_cast<int>(graph_.vertices.size()))
            paths_.push_back({texts_, label, source_});
        for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
            const ToyEdge& edge = graph_.edges[e];
            if (edge.from != at || seen_[edge.to]) continue;
            seen_[edge.to] = true;
            for (std::size_t p = 0; p < edge.choices.size(); ++p) {
                texts_.push_back("toy.e" + std::to_string(e));
                if (edge.choices.size() > 1) texts_.back() += "/p=" + std::to_string(p);
                walk(edge.to, extended(label, edge, edge.choices[p], first), false);
                texts_.pop_back();
            }
            seen_[edge.to] = false;
        }
    }

    const ToyGraph& graph_;
    const double pinned_;
    std::vector<char> seen_;
    std::vector<std::string> texts_;
    std::vector<Walked> paths_;
    int source_ = 0;
};

/// A graph with its request, ready to be planned.
struct Planned {
    ToyGraph toy;
    Request want;
    Scene scene;
    Catalogue catalogue;
    std::vector<Source> sources;

    explicit Planned(ToyGraph graph)
        : toy(std::move(graph)),
          want(toy.request()),
          catalogue(toy.catalogue()),
          sources(toy.planner_sources(want)) {}
    Ask ask() const { return {want, scene}; }
    Answer answer(const Profile& profile = unit_profile(), const PlanOptions& options = {}) const {
        return plan(catalogue, ask(), sources, profile, options);
    }
    Candidates candidates(const Profile& profile = unit_profile(),
                          const Candidates::Known& known = {}) const {
        return {catalogue, ask(),
                std::make_shared<PricedGraph>(catalogue, ask(), sources, profile, PlanOptions{}),
                PlanOptions{}, known};
    }
};

}  // namespace edgewise::toys
