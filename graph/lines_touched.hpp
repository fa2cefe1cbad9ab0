#pragma once

#include <Eigen/Core>

namespace edgewise {

/// Cache lines of a volume for each sample of a lattice: neighbours share them, along the lattice's
/// rows and across, as long as a cache holds the lines between.
///
/// A line is touched where a sample lies in the line's box, widened by the reach of the taps. Each
/// of four bounds holds for the mean number of boxes a sample: that of single samples, and those of
/// the segments, parallelograms and parallelepipeds between neighbours, by the volume that each
/// sweeps. The least is the estimate. So distant rays share lines too, where they follow the rows
/// of the volume or lie in its slices.
/// @param lattice  columns: from one sample to its three neighbours [voxels]. Of an image's two
///                 directions the third is along z
/// @param bytes    of a voxel; lines lie along x
/// @param taps     that a sample reads along each axis
double lines_touched(const Eigen::Matrix3d& lattice, double bytes, const Eigen::Vector3d& taps);

/// The same where nothing is kept for other rows: `side` x `side` rows of samples, along the
/// lattice's third column, are read together, and share lines among themselves alone. A line is
/// touched where the parallelogram of the front, swept along the rows, meets its box: the shadow of
/// the Minkowski sum of both, a zonotope, along the rows. The front counts as `side` pixels wide,
/// so at most (side / (side - 1))^2 times what samples at its corners meet.
/// @param lattice  as above, the third column from sample to sample along a row [voxels]
/// @param bytes    of a voxel; lines lie along x
/// @param taps     that a sample reads along each axis
/// @return lines for each sample
double lines_swept(const Eigen::Matrix3d& lattice, int side, double bytes,
                   const Eigen::Vector3d& taps);

}  // namespace edgewise
