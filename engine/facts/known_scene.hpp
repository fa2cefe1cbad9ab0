#pragma once

#include <memory_resource>
#include <optional>

#include "engine/engine.hpp"
#include "engine/facts/few_draws.hpp"
#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "request/input.hpp"
#include "scene/histogram.hpp"
#include "scene/model.hpp"
#include "scene/statistics.hpp"
#include "transitions/spectrum/radial_power.hpp"

namespace edgewise {

// Facts of loaded samples, found in a store or measured now and kept there. Both are the same to
// the last bit: what is measured depends on nothing that the fact's key leaves out. Where memory
// ran out, what was measured is not kept.

/// @param store  null: nothing is known
Statistics known_statistics(FactStore* store, const Input& input,
                            std::pmr::memory_resource* memory);
Histogram known_histogram(FactStore* store, const Input& input, const Statistics& statistics);
RadialPower known_spectrum(FactStore* store, const Input& input, const Statistics& statistics,
                           std::pmr::memory_resource* memory);

/// seen_slope() of the samples. @param want  with its transfer function
double known_slope(const Engine& engine, const Input& input, const Request& want);

/// What a scene is measured for.
struct Measuring {
    const Engine& engine;
    const Input& input;
    const Statistics& statistics;  // of its samples
    const Scene& counted;          // by these, and by what counts of edges ask of the data
    const Request& want;
    const Demands& asked;  // whose parameters are measured beside those that a planner tries
    std::optional<double> most_bytes;  // that somebody allows the process
    std::pmr::memory_resource* memory;
};

/// What is counted, with a preview, and with what running edges gave that say nothing of their
/// errors (scene/scene.hpp).
/// @param times  so many times the usual draws of a preview
Scene known_scene(const Measuring& of, int times = 1);

/// What counts of all edges ask of the data, for Measuring::counted. Of much data alone these are
/// kept.
Counts known_counts(const Measuring& of);
/// Some facts, from few draws.
FewDraws known_draws(const Measuring& measuring, const PreviewOf& of);

}  // namespace edgewise
