#pragma once

#include "cli/request/input.hpp"
#include "cli/request/job_options.hpp"
#include "cli/request/options.hpp"
#include "cli/request/outputs.hpp"
#include "cli/request/tail.hpp"
#include "scene/statistics.hpp"

namespace edgewise::cli {

/// All that can be said of a request before the input's samples are read. @throws RequestError
/// How costs are found: from models alone, by running the contenders, or all.
enum class Planner { estimate, pilot, exhaustive };

struct Wish {
    Request want;  // without geometry and without what hangs on the samples
    std::optional<Window> window;
    std::optional<std::size_t> verify;  // samples; 0: all
    std::uint64_t seed = 1;
    int repeat = 1;
    std::optional<int> quality;
    std::optional<int> bits;
    bool memory_given = false;  // --max-memory
    Planner planner = Planner::estimate;
    std::optional<double> planning_time;  // [s]
    bool strict = false;                  // a broken budget is a failure
    store::Selection selection;
};
Wish wish_of(const JobOptions& options);

/// Puts the geometry into the request. @throws RequestError, NoPlan
Geometry take_geometry(Request& want, const JobOptions& options, const Input& input,
                       const std::optional<Outputs>& outputs);

/// Puts in what hangs on values: what a MIP's misses show, an X-ray's zero, a composite's ramp.
/// A window of values or percentiles that became the ramp is taken from `wish`.
/// @throws RequestError
void take_values(Wish& wish, const JobOptions& options, const Data& data,
                 const Statistics& statistics);

}  // namespace edgewise::cli
