#pragma once

#include "request/geometry.hpp"

namespace edgewise {

/// Samples that a warp makes: `spacing` and `size`, else those of the input.
/// @param input    as `view` turns it
/// @param map      centred object -> centred screen space [file unit]
/// @param corners  of the input, centred object space [file unit]
/// @throws RequestError
ScreenGrid warp_grid(const GeometrySpec& spec, const InputGrid& input, const Mat4& map,
                     const std::vector<Vec3>& corners);

/// Pixels of all views, centred where the middle of the turn is; by default no view is cut off.
/// z: the depth that all views take, in units of the smallest spacing of the input.
/// @throws RequestError
ScreenGrid picture_grid(const GeometrySpec& spec, const InputGrid& input,
                        const std::vector<Mat4>& maps, const std::vector<Vec3>& corners);

/// Shows less of the scene, larger: `zoom`. @throws RequestError
void zoom(ScreenGrid& grid, double factor, Job job);

/// The eye that sees all corners of all views under the vertical angle `angle` [degree].
/// @throws RequestError
Eye eye_of(double angle, const ScreenGrid& grid, const std::vector<Mat4>& maps,
           const std::vector<Vec3>& corners);

/// The eye at the origin of centred screen space, under the vertical angle `angle` [degree] from
/// the top of the picture to its bottom. The grid's depth becomes that of the corners as seen from
/// there.
/// @throws RequestError
Eye eye_at_origin(double angle, ScreenGrid& grid, const std::vector<Mat4>& maps,
                  const std::vector<Vec3>& corners);

/// What one step along the grid's axes is to an eye, in steps in depth: to be said again of a grid
/// whose spacing has changed.
void take_steps(Eye& eye, const ScreenGrid& grid);

}  // namespace edgewise
