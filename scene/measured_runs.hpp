#pragma once

#include <memory_resource>

#include "graph/data.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "reference/phantoms.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Measures the errors of edges that have no answer of their own (Transition::error), by running
/// them: on a few tiles of the output that are drawn evenly, from the part of the
/// input that each tile sees, at full sampling. The result of the shortest path that goes through
/// an edge is held against the reference of that part. Adds facts as fact_of_runs() names them, as
/// errors of the edge's own samples: what later edges make of these is divided by their gains.
/// Where nothing could be drawn or run there is no fact, and the error stays unknown.
/// @param asked  edges that a path has to go through; those on demand are measured if they are
/// @param scene  with the facts of models
void measure_runs(const Catalogue& catalogue, const Demands& asked, const Data& input,
                  const Statistics& statistics, const Request& want, const Phantom* formula,
                  Scene& scene, std::pmr::memory_resource* memory);

}  // namespace edgewise
