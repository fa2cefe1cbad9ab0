#pragma once

#include <memory_resource>

#include "graph/data.hpp"
#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "reference/phantoms.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

struct Preview;  // scene/preview.hpp
struct PreviewOf;

/// Measures what errors of a catalogue's edges depend on beyond the statistics: a preview of a few
/// hundred rays (or points of a warp), by the edges' models against the reference. At most 8 MB of
/// memory, with more draws too. Edges without a model and without an answer of their own are run on
/// a few small tiles. The same for any number of threads.
///
/// Errors are upper estimates (97 %, one-sided), and the range is that of reference values which
/// really occur, so that it is rather too small than too large.
/// @param input       the loaded samples
/// @param statistics  of the same samples
/// @param formula     of Field::formula, else null
/// @param times       so many times the usual draws, within what there is and what fits
/// @param asked       demands whose parameters are measured in addition to those that a planner
/// tries
Scene measure_scene(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
                    const Request& want, const Phantom* formula, std::pmr::memory_resource* memory,
                    int times = 1, const Demands& asked = {});

/// The first part of that: the preview, without running edges. Of jobs whose results are neither
/// points nor rays, whose errors are measured by running alone, all of it.
Scene preview_scene(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
                    const Request& want, const Phantom* formula, std::pmr::memory_resource* memory,
                    int times = 1, const Demands& asked = {});

/// Errors that decide between a few paths: facts of a preview, from few draws, without running
/// edges. Of jobs whose results are points or rays.
Preview preview_facts(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
                      const Request& want, const Phantom* formula, const PreviewOf& of,
                      std::pmr::memory_resource* memory);

/// The second part: runs the edges without an answer about their errors that are of use to the
/// request, within its limits, and adds what that gave.
void run_scene(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
               const Request& want, const Phantom* formula, Scene& scene,
               std::pmr::memory_resource* memory, const Demands& asked = {});

/// Whether a catalogue has such edges.
bool has_silent_edges(const Catalogue& catalogue);

/// Adds what the counts of a catalogue's edges ask of the data (Transition::count).
/// @param asked  untried() demands: edges that no path takes unasked are counted where they are
///               among these; null: all are
void count_scene(const Catalogue& catalogue, const Data& input, const Request& want, Scene& scene,
                 std::pmr::memory_resource* memory, const Demands* asked = nullptr);

/// The same without the preview: costs are as exact, errors are the models' guesses.
Scene unseen_scene(const Statistics& statistics);

}  // namespace edgewise
