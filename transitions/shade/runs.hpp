#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/kernels/visible_runs.hpp"

namespace edgewise {

/// Classifies cells between samples and lays runs of those that may be seen beside the samples,
/// which are shared: what a transfer function leaves transparent is then passed over in every view.
/// A content of its own and no facet, so that only edges read it that gain from it.
/// Edge    object/scalar -> object/runs, aligned/scalar -> aligned/runs
/// Shape   [nz, ny, nx], x fastest, any real type; 4 bytes a run, and a row has one run for each 9
///         cells at most
/// Needs   a mode with a transfer function or a level, without light; rows of 65535 samples at most
/// Work    a cell: the extremes of its four samples, and two comparisons a transparent stretch of
///         the transfer function
/// Error   none: a cell is left out only where every value interpolated in it adds nothing
/// Source  Lacroute and Levoy 1994; runs of cells in place of samples, as opacities are looked up
///         behind the interpolation
Transition visible_runs();

/// Stored numbers that add nothing to a ray; none: all do, or the mode does not say.
std::vector<kernels::UnseenSpan> unseen_of(const Request& want, const ValueMap& values);
/// The runs of data that have them.
std::shared_ptr<const kernels::VisibleRuns> runs_of(const Data& data);

// What this edge and project.sliced_runs share.

/// Why a request gains nothing from runs, wherever its rays come from; empty: it may.
std::string no_runs(const Representation& from, const Ask& ask);
/// The share of cells in runs, and runs a row.
inline constexpr Fact kRunsSeen{"runs/seen"}, kRunsRow{"runs/row"};

/// Adds both of rows that are spread evenly over the volume.
void count_runs(const Data& input, const Request& want, std::map<std::string, double>& facts,
                std::pmr::memory_resource* memory);
/// Of classifying all samples once.
Work work_of_runs(const Representation& from, const Ask& ask);
kernels::VisibleRuns made_runs(const kernels::Grid& volume,
                               std::span<const kernels::UnseenSpan> unseen, Context& context);

/// Of the samples, those that are added by runs: in a run, and not hidden. Bricks of a ray cast
/// leave out both, of bricks that are coarser than runs.
double share_in_runs(const Ask& ask);

}  // namespace edgewise
