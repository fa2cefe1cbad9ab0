#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "graph/request.hpp"

namespace edgewise::cli {

using Mat3 = Eigen::Matrix3d;

/// Where the samples of an input lie: all that geometry needs to know of a file.
struct InputGrid {
    int axes = 3;
    Extent extent;
    Vec3 spacing = Vec3::Ones();        // [file unit]
    Mat3 direction = Mat3::Identity();  // columns: where x, y and z point, in LPS
    bool anatomical = false;            // the file says so, or --orient
};

/// Geometry as it was typed.
struct GeometryWords {
    std::optional<std::string> view, about, perspective, turntable, spacing, size;
    /// rotate, matrix, scale, translate, shear with their values, in the order given.
    std::vector<std::pair<std::string, std::string>> steps;
};

/// Samples of the output.
struct ScreenGrid {
    Extent extent;
    Vec3 spacing = Vec3::Ones();  // [file unit]
    Vec3 centre = Vec3::Zero();   // of the grid, from the centre of the input, in screen axes
};

/// All views of a request and the grid that they are seen on.
struct Geometry {
    std::vector<Mat4> views;  // input index -> screen index
    ScreenGrid grid;          // render: extent.z and spacing.z are those of the depth
    double unit = 1;          // one step in screen z of a picture [file unit]
    std::optional<Eye> eye;
    double condition = 1;  // of the affine map: its largest stretch over its least; a homography: 1
};

/// Works geometry out, for both jobs.
///
/// Frames: object space [sample] -> centred object space [file unit], origin at (n-1)/2 ->
/// (--view, then the steps in order) centred screen space [file unit], x right, y down, z away from
/// the eye -> screen space [output sample; a picture's z in smallest spacings].
/// @throws RequestError naming the option, its value and what was expected
Geometry geometry_of(const GeometryWords& words, const InputGrid& input, Job job);

/// Directions of "RAS", "LPI" ...: columns in LPS. @throws RequestError
Mat3 directions_of(const std::string& letters);
/// The inverse of directions_of for the nearest axes.
std::string letters_of(const Mat3& direction);

/// Signed permutation from the file's axes to screen axes (right, down, away from the eye).
/// @param name front, back, left, right, top, bottom, x, y or z; @throws RequestError
Mat3 view_of(const std::string& name, const Mat3& direction);

/// EQ 37: Rz(c) Ry(b) Rx(a) [degree]; entries are exact for multiples of 90.
Mat3 rotation_of(double a, double b, double c);

/// One of the steps as a map of centred screen space [file unit]. @throws RequestError
Mat4 step_of(const std::string& name, const std::string& value, const InputGrid& input);

/// Corners of the volume, half a sample beyond its outermost centres: indices of the input.
std::vector<Vec3> corners_of(const InputGrid& input);
/// Where a map sends a point; nullopt where it is beyond the horizon of a homography.
std::optional<Vec3> sent(const Mat4& map, const Vec3& point);

}  // namespace edgewise::cli
