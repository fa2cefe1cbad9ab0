#pragma once

#include <memory_resource>
#include <optional>

#include "engine/request/input.hpp"
#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "scene/histogram.hpp"
#include "scene/statistics.hpp"
#include "transitions/spectrum/radial_power.hpp"

namespace edgewise {

// Facts of loaded samples, known from an earlier run or measured now. What took long to measure is
// kept (engine/known_facts.hpp). Known and measured facts are the same to the last bit.

Statistics known_statistics(const Input& input, std::pmr::memory_resource* memory);
Histogram known_histogram(const Input& input, const Statistics& statistics);
RadialPower known_spectrum(const Input& input, const Statistics& statistics,
                           std::pmr::memory_resource* memory);
/// Statistics, preview, and what counts of edges ask of the data (scene/scene.hpp).
/// @param times  so many times the usual draws of a preview
/// @param asked  demands whose parameters are measured in addition to those that a planner tries
Scene known_scene(const Catalogue& edges, const Input& input, const Statistics& statistics,
                  const Request& want, std::pmr::memory_resource* memory, int times = 1,
                  const Demands& asked = {});
/// The same where an earlier run has left it, else nothing.
std::optional<Scene> kept_scene(const Input& input, const Statistics& statistics,
                                const Request& want, const Demands& asked);

}  // namespace edgewise
