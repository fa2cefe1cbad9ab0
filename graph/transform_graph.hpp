#pragma once

#include <boost/graph/adjacency_list.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "graph/plan.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// An edge or a family by name, with values for some of its parameters: of `--via`, `--without`.
struct Demand {
    std::string name = {};  // "project.ray_cast", or the family "project"
    Parameters with = {};   // keys not given are free

    bool names(const Transition& edge) const { return name == edge.name || name == edge.family(); }
    bool fits(const Transition& edge, const Parameters& chosen) const;
};

/// Reads "NAME[/key=value]...", in any case; of a name its end will do ("ray_cast") where only one
/// edge ends so. @throws RequestError for what the catalogue does not know, with what is nearest
Demand demand_of(const std::string& text, const Catalogue& catalogue);
/// The same for a job: a name that several edges end with means the one that may lead to its
/// target.
Demand demand_of(const std::string& text, const Catalogue& catalogue, Job job);

/// Which paths count.
struct Demands {
    std::vector<Demand> via = {};      // all of them, in this order
    std::vector<Demand> without = {};  // none of these
};

/// Those of the demanded edges that previews might not measure unasked: with a value that nobody
/// tries, or any but plain ones (Transition::plain).
Demands untried(const Demands& demands, const Catalogue& catalogue);

/// Data that is there already, and what a path that starts with it begins with.
struct Source {
    Representation what = {};
    Label label = {};
};

/// A vertex of the transform graph.
struct Vertex {
    Representation what;
    int demanded = 0;   // how many of Demands::via lie behind it
    int prepared = -1;  // the last edge applied in object space; a later one has a higher place
    int source = -1;    // index of the source that it is, or -1
    bool target = false;
};

/// An edge of the transform graph: one offer of one transition.
struct Arc {
    int edge = 0;           // place in the catalogue
    std::size_t index = 0;  // among the edges of the graph
    Offer offer;
};

using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::bidirectionalS, Vertex, Arc>;

/// All that a request spans: vertices between a source and a target, and why the rest is not there.
struct TransformGraph {
    Graph graph;
    std::vector<Graph::vertex_descriptor> sources, targets;
    std::vector<Refusal> refused;
};

/// Walks forward from the sources by `joins` and `offer`, then drops what cannot reach a target.
/// @throws RequestError where an edge of the user's leads to more than 4096 vertices
TransformGraph expand(const Catalogue& catalogue, const Ask& ask,
                      const std::vector<Source>& sources, const Demands& demands = {});

/// Text for the pen of an arc; by default the edge with its parameters.
using ArcText = std::function<std::string(const Arc&)>;
std::string to_dot(const TransformGraph& spanned, const Catalogue& catalogue,
                   const ArcText& cost = {});
/// {"vertices": [{id, what, bytes, source, target}], "edges": [{from, to, transition, parameters,
/// cost}], "refused": [...]}
nlohmann::json to_json(const TransformGraph& spanned, const Catalogue& catalogue,
                       const std::function<nlohmann::json(const Arc&)>& cost = {});

/// The graph without a request: kinds, and the edges that join them.
std::string to_dot(const Catalogue& catalogue);
nlohmann::json to_json(const Catalogue& catalogue);

}  // namespace edgewise
