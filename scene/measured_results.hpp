#pragma once

#include <memory_resource>

#include "graph/data.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Measures the errors of edges that lead at once from the samples to the result of a job with a
/// reference of its own (filters, lines): it runs them, as rounding depends on kernel and data in
/// ways that no closed form tells within a factor of three.
///
/// Small inputs are filtered whole, larger ones in parts: some spread evenly, and those around the
/// least and the largest sample. All samples of these are held against an edge that filters them in
/// f64, where there is one, else some drawn ones against the reference. What an edge takes is
/// bounded by its counted operations; one that would take more is left out.
///
/// Adds facts as fact_of_runs() names them, in values of the result, kWritten, and sets the range.
/// Of samples that were first made another type, kResultType tells which they had, the name ends
/// with " of TYPE", and the error is that of both steps. Adds kResultRms of results: their root
/// mean square. Edges that cannot err are not run.
/// @param asked  edges that are offered on demand alone are measured where these name them
void measure_results(const Catalogue& catalogue, const Demands& asked, const Data& input,
                     const Statistics& statistics, const Request& want, Scene& scene,
                     std::pmr::memory_resource* memory);

}  // namespace edgewise
