#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "graph/plan.hpp"
#include "planner/profile.hpp"

namespace edgewise {

/// What one arc of the transform graph costs for all views of a request.
struct StepCost {
    Work work;           // one run: the mean of at most eight views
    double seconds = 0;  // all runs
    double spread = 0;   // of seconds: standard deviation of the log
    double scratch = 0;  // bytes in addition to input and output, of one rank
    double made = 0;     // bytes that the output takes: of an attached facet its own
    double from_ranks = 1, to_ranks = 1;  // that input and output are spread over
    Error error;
    bool barred = false;  // no path may contain it
    double rounding = 0;  // of writing what the edge makes, unless it is copied [value]
};

/// The error of an edge as labels count it. Where copies make no difference to the file, every edge
/// counts as a copy, so that copying does not decide which label beats another.
Error counted_error(const Transition& edge, const Offer& offer, const Ask& ask);
/// What rounding and clipping to the type of the file add to results that are not copies of
/// samples: as measured on the scene, else that of values spread evenly between neighbouring
/// numbers [value].
double rounding_of(const Ask& ask);

/// "EDGE/key=value.../VARIANT KIND TYPE": all that decides how fast an edge's kernel runs, except
/// the size. VARIANT is Work::way, if it has one. KIND is the mode of a picture, "view" for a
/// volume that is warped to be combined to one, else "2d" or "3d". TYPE is that of the samples it
/// reads.
std::string timing_name(const Transition& edge, const Offer& offer, const Request& want,
                        const Work& work);

/// @param threads  that share one run
StepCost cost_of(const Transition& edge, const Offer& offer, const Ask& ask, const Profile& profile,
                 int threads);

/// The same with seconds replaced by a number in (0, 1] that depends on the edge, its parameters
/// and the seed alone. So ordinary tests run paths that would never win (FFTW's idea).
void randomise(StepCost& cost, const Transition& edge, const Offer& offer, std::uint64_t seed);

/// The label behind an edge.
/// @param from_source  the input is a source, whose bytes the caller has counted as pinned
/// @param pinned       bytes that stay whatever the path
Label extend(const Label& label, const Offer& offer, const StepCost& cost, bool from_source,
             double pinned);

/// Whether a path with label a makes one with label b superfluous, whatever edges follow.
bool dominates(const Label& a, const Label& b) noexcept;

/// Lexicographic over all resources: a total order that makes answers repeatable.
bool before(const Label& a, const Label& b) noexcept;

}  // namespace edgewise
