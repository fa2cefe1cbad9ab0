#pragma once

#include <functional>
#include <string>

#include "graph/transform_graph.hpp"

namespace edgewise {
struct Looked;
}

namespace edgewise::cli {

/// What an arc's label says of its cost, in a few words each.
using CostWords = std::function<std::vector<std::string>(const Arc&)>;

/// Seconds, and what is added to the error, of a request's arcs. The looked must stay alive.
CostWords cost_words(const Looked& looked);

/// The transform graph of a request as DOT, for a reader: arcs of one edge between the same
/// vertices are one line with a row for each choice of parameters. The chosen path is bold. Refused
/// edges are dashed, with the reason in lines of a readable length.
/// @param chosen  null where no plan is
std::string picture_dot(const TransformGraph& spanned, const Catalogue& catalogue,
                        const CostWords& cost, const Plan* chosen);

/// DOT as SVG. @throws RunError Graphviz is not installed, or failed
std::string laid_out(const std::string& dot);

}  // namespace edgewise::cli
