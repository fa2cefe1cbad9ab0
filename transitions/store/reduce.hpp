#pragma once

#include <array>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/scale.hpp"

namespace edgewise {

// Levels of detail: what a small or a rough picture needs of a volume. A level is a vertex of its
// own
// ("level2/scalar"), so its error is told from those of casts through all samples.

/// How many levels there are.
inline constexpr int kLevels = 5;

/// "level2": the space of samples at a level.
std::string level_space(int level);
/// The level of a space; 0: none.
int level_of(const std::string& space) noexcept;

/// The cells that samples are averaged over, about equally wide in space.
struct ReducedGrid {
    Extent extent;  // cells
    /// Weights of samples in each cell, along x, y and z.
    std::array<kernels::ScaledAxis, 3> axes;
    /// Indices of samples -> indices of cells.
    Mat4 map;
};
/// @param spacing  of the samples [any unit]
ReducedGrid reduced_grid(const Extent& samples, const Vec3& spacing, int level);

/// Means over cells that are 2^level times the smallest spacing wide along each axis, or as wide as
/// the samples where these lie further apart.
/// Edge    object/scalar -> level1/scalar ... level5/scalar, volumes for pictures; f32 out
/// Grid    as many cells along an axis as fit best; together they cover the voxels of the input
///         exactly, so a cell may take shares of voxels
/// Needs   all samples where the input has them, finite, and no labels
/// Work    a sample: a product and a sum along z, 1 / 2^level of it along y, of that along x
/// Error   of rounding alone: what means leave out is measured with the casts that read them
/// Source  Williams 1983 (pyramids by means); [W93] 4.2.1 for the casts behind it
Transition reduce();

/// The same of samples that are classified already: optical depths and the light that they emit are
/// averaged, not opacities, so that a thin medium keeps its opacity at every level.
/// Edge    object/colored -> object/colored; only by --via
/// Error   measured by running it
/// Source  Kraus and Buerger 2008 (why opacities must not be averaged)
Transition reduce_colored();

}  // namespace edgewise
