#pragma once

#include <memory_resource>

#include "graph/data.hpp"
#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "transitions/reference/phantoms.hpp"
#include "transitions/reference/statistics.hpp"

namespace edgewise {

/// Measures what cost and error models of a request ask for beyond the statistics: a preview of a
/// few hundred rays (or points of a warp) against the reference. At most 8 MB of memory, with more
/// draws too. The same for any number of threads.
///
/// Errors are upper estimates (97 %, one-sided), and the range is that of reference values which
/// really occur, so that it is rather too small than too large.
/// @param input       the loaded samples
/// @param statistics  of the same samples
/// @param formula     of Field::formula, else null
/// @param times       so many times the usual draws, within what there is and what fits
Scene measure_scene(const Data& input, const Statistics& statistics, const Request& want,
                    const Phantom* formula, std::pmr::memory_resource* memory, int times = 1);

/// The same without the preview: costs are as exact, errors are the models' guesses.
Scene unseen_scene(const Statistics& statistics);

}  // namespace edgewise
