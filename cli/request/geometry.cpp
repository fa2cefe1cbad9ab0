#include "cli/request/geometry.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "cli/request/numbers.hpp"
#include "cli/request/screen.hpp"
#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

Vec3 centre_of(const Extent& extent) {
    return {(extent.x - 1) / 2.0, (extent.y - 1) / 2.0, (extent.z - 1) / 2.0};
}

Mat4 shift_by(const Vec3& by) {
    Mat4 map = Mat4::Identity();
    map.topRightCorner<3, 1>() = by;
    return map;
}

Mat4 linear(const Mat3& matrix) {
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = matrix;
    return map;
}

/// The sample of --about, from the centre [file unit].
Vec3 held_point(const GeometryWords& words, const InputGrid& input) {
    if (!words.about) return Vec3::Zero();
    const std::vector<double> at = numbers_of("--about", *words.about);
    if (static_cast<int>(at.size()) != input.axes)
        throw RequestError(fmt::format("--about: {} numbers given; expected {}", at.size(),
                                       input.axes == 2 ? "X,Y" : "X,Y,Z"));
    Vec3 sample = centre_of(input.extent);
    for (int k = 0; k < input.axes; ++k) sample[k] = at[k];
    return (sample - centre_of(input.extent)).cwiseProduct(input.spacing);
}

/// Centred object space -> centred screen space, without a turntable.
Mat4 chosen_map(const GeometryWords& words, const InputGrid& input, Job job) {
    const bool front = job == Job::render && input.anatomical;
    const std::string name = words.view.value_or(front ? "front" : "z");
    if (input.axes == 2 && name != "z")
        throw RequestError(fmt::format("--view {}: an image has only the view z", name));
    const Mat4 view = linear(view_of(name, input.direction));
    Mat4 steps = Mat4::Identity();
    for (const auto& [option, value] : words.steps) steps = step_of(option, value, input) * steps;
    const Vec3 held = view.topLeftCorner<3, 3>() * held_point(words, input);
    if (!held.isZero(0)) steps = shift_by(held) * steps * shift_by(-held);
    return steps * view;
}

/// Entries within rounding of a whole number become it: a quarter turn or a shift by whole samples
/// that was composed of several maps is a copy of samples, and edges look for exactly that.
void snap(Mat4& map) {
    for (int row = 0; row < 3; ++row) {
        const double most = std::max(1.0, map.row(row).head<3>().cwiseAbs().maxCoeff());
        for (int column = 0; column < 3; ++column) {
            double& entry = map(row, column);
            if (std::abs(entry - std::round(entry)) <= 1e-14 * most) entry = std::round(entry);
            if (entry == 0) entry = 0;  // no -0
        }
    }
}

/// Centred screen space -> input samples' screen indices, around a centred map.
///
/// Shifts are worked out from the finished linear part: (n-1)/2 is exact in binary, so identities
/// and quarter turns stay exact, which a product of three matrices would not promise.
Mat4 on_grid(const Mat4& map, const InputGrid& input, const ScreenGrid& grid) {
    const Vec3 from = centre_of(input.extent), to = centre_of(grid.extent);
    if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
        const Mat4 object = linear(input.spacing.asDiagonal()) * shift_by(-from);
        const Mat4 screen = shift_by(to) * linear(grid.spacing.cwiseInverse().asDiagonal()) *
                            shift_by(-grid.centre);
        return screen * map * object;
    }
    Mat4 result = Mat4::Identity();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            result(row, column) = map(row, column) * input.spacing[column] / grid.spacing[row];
    snap(result);
    for (int row = 0; row < 3; ++row) {
        const double moved = (map(row, 3) - grid.centre[row]) / grid.spacing[row];
        double at = to[row] + moved - result.row(row).head<3>().dot(from);
        const double most = std::max({1.0, to[row], from.maxCoeff()});
        if (std::abs(at - std::round(at)) <= 1e-13 * most) at = std::round(at);
        result(row, 3) = at == 0 ? 0 : at;
    }
    return result;
}

std::vector<Mat4> turned(const Mat4& map, const GeometryWords& words, Job job) {
    if (!words.turntable) return {map};
    if (job == Job::warp) throw RequestError("--turntable: only render makes several views");
    const std::int64_t views = whole_of("--turntable", *words.turntable, 1, 100000);
    std::vector<Mat4> maps;
    for (std::int64_t i = 0; i < views; ++i)
        maps.push_back(linear(rotation_of(0, 360.0 * static_cast<double>(i) / views, 0)) * map);
    return maps;
}

/// How much more an affine map stretches one direction than another. Steps that are fine one by one
/// may flatten the input together, which the determinant of none of them shows.
/// @throws RequestError where no f64 inverse of it would hold
double condition_of(const Mat4& map, int axes) {
    if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return 1;
    constexpr double kFlat = 1e12;  // places of 4096 samples would be off by 2^-53 kFlat 4096 = 0.5
    const Eigen::MatrixXd linear = map.topLeftCorner(axes, axes);
    const Eigen::VectorXd stretch = Eigen::JacobiSVD<Eigen::MatrixXd>(linear).singularValues();
    const double condition = stretch[0] / stretch[axes - 1];
    if (!(condition <= kFlat))
        throw RequestError(
            fmt::format("the geometry options make a map of condition {:.3g}, which flattens the "
                        "{}; at most {:.0g}",
                        condition, axes == 2 ? "image" : "volume", kFlat));
    return condition;
}

}  // namespace

std::vector<Vec3> corners_of(const InputGrid& input) {
    std::vector<Vec3> corners;
    for (int i = 0; i < (input.axes == 2 ? 4 : 8); ++i)
        corners.emplace_back(i & 1 ? input.extent.x - 0.5 : -0.5,
                             i & 2 ? input.extent.y - 0.5 : -0.5,
                             input.axes == 2 ? 0.0
                             : i & 4         ? input.extent.z - 0.5
                                             : -0.5);
    return corners;
}

std::optional<Vec3> sent(const Mat4& map, const Vec3& point) {
    const Eigen::Vector4d to = map * point.homogeneous();
    if (!(to[3] > 0)) return std::nullopt;
    return Vec3(to.head<3>() / to[3]);
}

Geometry geometry_of(const GeometryWords& words, const InputGrid& input, Job job) {
    const std::vector<Mat4> maps = turned(chosen_map(words, input, job), words, job);
    std::vector<Vec3> corners = corners_of(input);
    for (Vec3& corner : corners)
        corner = (corner - centre_of(input.extent)).cwiseProduct(input.spacing);

    Geometry geometry;
    geometry.condition = condition_of(maps[0], input.axes);
    geometry.grid = job == Job::warp ? warp_grid(words, input, maps[0], corners)
                                     : picture_grid(words, input, maps, corners);
    if (job == Job::render) geometry.unit = geometry.grid.spacing.z();
    for (const Mat4& map : maps) geometry.views.push_back(on_grid(map, input, geometry.grid));
    for (const Mat4& map : geometry.views)
        if (!map.allFinite()) throw RequestError("the geometry options overflow when combined");
    if (words.perspective) {
        if (job == Job::warp) throw RequestError("--perspective: only render has an eye");
        geometry.eye = eye_of(*words.perspective, geometry.grid, maps, corners);
    }
    return geometry;
}

}  // namespace edgewise::cli
