#pragma once

#include <array>
#include <memory>

#include "graph/transition.hpp"
#include "transitions/kernels/visible_runs.hpp"

namespace edgewise {

/// What shade.runs does for parallel rays, for rays from an eye at a finite distance: these cross
/// slices of several axes, so runs are made of the slices of each axis that has some in a view.
/// Edge    object/scalar -> object/sliced_runs
/// Shape   [nz, ny, nx], x fastest, any real type; 4 bytes a run, and a row has one run for each 9
///         cells at most; where slices lie across x, also a copy of the samples with rows along y
/// Needs   what shade.runs needs but parallel rays, and an eye at least a voxel outside of the
///         volume
/// Work    that of shade.runs for each axis
/// Error   none: a cell is left out only where every value interpolated in it adds nothing
/// Source  Lacroute and Levoy 1994
Transition sliced_runs();

/// Slices of an axis, and runs along their rows.
struct SlicedRuns {
    kernels::VisibleRuns runs;
    Array turned;  // samples whose rows these are; empty: those of the data (SlicedSamples)
};
/// By axes; null: no view has slices along it.
using RunsOfAxes = std::array<std::shared_ptr<const SlicedRuns>, 3>;

/// The runs of data that have them for an eye.
std::shared_ptr<const RunsOfAxes> runs_of_axes(const Data& data);

}  // namespace edgewise
