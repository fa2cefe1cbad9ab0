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
/// them. Pictures are made whole, of all views or of four, and some 500 of their pixels are drawn
/// and held against the reference as --verify does it (Verifier). Of pictures beyond four million
/// pixels four parts are made. Of a warp six boxes are made, each from the part of the input that
/// it sees. Of the shortest paths that go through an edge, one with the whole input and one with a
/// cropped one, the worse counts. Adds facts as fact_of_runs() names them, as errors of the edge's
/// own samples: what later edges make of these is divided by their gains. Where an edge that rounds
/// or blurs may come before, the measured one is run once more behind it: how its result changes,
/// over that edge's own error, is its gain, the fact that gain_of_runs() names. Where nothing could
/// be drawn or run, or memory is too small, there is no fact, and the error stays unknown.
/// @param asked  edges that a path has to go through; those on demand are measured if they are
/// @param scene  with the facts of models
void measure_runs(const Catalogue& catalogue, const Demands& asked, const Data& input,
                  const Statistics& statistics, const Request& want, const Phantom* formula,
                  Scene& scene, std::pmr::memory_resource* memory);

}  // namespace edgewise
