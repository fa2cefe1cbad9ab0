#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "graph/request.hpp"
#include "request/query.hpp"

namespace edgewise {

using Mat3 = Eigen::Matrix3d;

/// Where the samples of an input lie: all that geometry needs to know of a file.
struct InputGrid {
    int axes = 3;
    Extent extent;
    Vec3 spacing = Vec3::Ones();        // [file unit]
    Mat3 direction = Mat3::Identity();  // columns: where its own axes point, in LPS
    /// Columns, of length one: where x, y and z of a sheared grid point (a tilted gantry) among its
    /// own perpendicular axes, of which the first is x and the second lies in the plane of x and y.
    Mat3 lean = Mat3::Identity();
    bool anatomical = false;  // the file says so, or `orient`

    bool leans() const { return lean != Mat3::Identity(); }
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
    bool eye_placed = false;  // by `eye`: grid.centre counts from there
    double condition = 1;  // of the affine map: its largest stretch over its least; a homography: 1
    /// warp: where the samples of the output lie, which its header says: output index -> input
    /// index. What turns the grid is in both maps, what moves the content in `views` alone.
    Mat4 lies = Mat4::Identity();
    double depth = 1;  // warp: of the moved volume, along the output's z [output sample]
    double cut = 0;    // of that, what lies beyond the output at its worse end
    /// mesh: what is to be added to its vertices, where the origin is so far away that f32 would
    /// take their shape from them [file unit]; else 0.
    Vec3 offset = Vec3::Zero();
};

/// Works geometry out, for both jobs.
///
/// Frames: object space [sample] -> centred object space [file unit], origin at (n-1)/2 ->
/// (`view`, then the steps in order) centred screen space [file unit], x right, y down, z away from
/// the eye -> screen space [output sample; a picture's z in smallest spacings]. Axes of centred
/// spaces are perpendicular, also where those of the grid lean; but a warp's screen leans like the
/// input, so that it is counted along the axes of the grid.
/// @throws RequestError naming the option, its value and what was expected
Geometry geometry_of(const GeometrySpec& spec, const InputGrid& input, Job job);

/// A picture of which nobody said how large it is has at least 512 samples on its longer side:
/// where it would have less, as if that size had been asked for. The field of view stays.
/// @throws RequestError where no picture is asked for, and a size that is of pictures
void take_usual_size(GeometrySpec& spec, const InputGrid& input, Job job);

/// Takes where the axes of a grid point apart into perpendicular axes and how it leans among them.
/// What does not move any sample of the grid by a tenth of one is no lean.
/// @param points  columns, of length one: where x, y and z point
void take_axes(InputGrid& grid, const Mat3& points);

/// Directions of "RAS", "LPI" ...: columns in LPS. @throws RequestError
Mat3 directions_of(const std::string& letters);
/// The inverse of directions_of for the nearest axes.
std::string letters_of(const Mat3& direction);

/// Signed permutation from the file's axes to screen axes (right, down, away from the eye).
/// @param name front, back, left, right, top, bottom, coronal, sagittal, axial, x, y or z, in any
/// case; @throws RequestError
Mat3 view_of(const std::string& name, const Mat3& direction);

/// The turn that makes a direction that of depth, and keeps what is up as far up as it can be;
/// `right` stays where it is where the direction is up or down itself.
/// @param along  axes are right, down and away from the eye; longer than 0
Mat3 looking_along(const Vec3& along);

/// EQ 37: Rz(c) Ry(b) Rx(a) [degree]; entries are exact for multiples of 90.
Mat3 rotation_of(double a, double b, double c);

/// One of the steps that are one map, of centred screen space [file unit]. @throws RequestError
Mat4 map_of(const GeometryStep& step, const InputGrid& input);
/// The maps of a step that is one for each view: a turntable or a path. @throws RequestError
std::vector<Mat4> maps_of(const GeometryStep& step, const InputGrid& input);
bool makes_views(GeometryStep::Kind kind) noexcept;

/// Corners of the volume, half a sample beyond its outermost centres: indices of the input.
std::vector<Vec3> corners_of(const InputGrid& input);
/// Where a map sends a point; nullopt where it is beyond the horizon of a homography.
std::optional<Vec3> sent(const Mat4& map, const Vec3& point);

}  // namespace edgewise
