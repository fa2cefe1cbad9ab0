#include "request/geometry.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "request/screen.hpp"

namespace edgewise {
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

/// The sample of `about`, from the centre [file unit].
Vec3 held_point(const GeometrySpec& spec, const InputGrid& input) {
    if (!spec.about) return Vec3::Zero();
    const std::vector<double>& at = *spec.about;
    if (static_cast<int>(at.size()) != input.axes)
        throw RequestError(message("@about: {} numbers given; expected {}", at.size(),
                                   input.axes == 2 ? "X,Y" : "X,Y,Z"));
    Vec3 sample = centre_of(input.extent);
    for (int k = 0; k < input.axes; ++k) sample[k] = at[k];
    return input.lean * (sample - centre_of(input.extent)).cwiseProduct(input.spacing);
}

/// What `eye` and `look_at` need, and where they may be.
void expect_eye(const GeometrySpec& spec, const InputGrid& input, Job job) {
    if (spec.look_at && !spec.eye)
        throw RequestError(message("@look_at: from where? Add @eye X,Y,Z"));
    if (!spec.eye) return;
    if (job == Job::warp) throw RequestError(message("@eye: only render has an eye; leave it out"));
    if (!spec.perspective)
        throw RequestError(message(
            "@eye: how much does it see? Add @perspective FOV, the vertical angle in degrees"));
    // Farther away, rounding would decide about rays.
    constexpr double kFar = 1e6;  // samples from the centre
    const auto expect_near = [&](SettingName option, const std::array<double, 3>& at) {
        for (int k = 0; k < 3; ++k)
            if (!(std::abs(at[static_cast<std::size_t>(k)] - centre_of(input.extent)[k]) <= kFar))
                throw RequestError(
                    message("{}: expected three finite numbers within {:g} samples of the volume's "
                            "centre",
                            setting(option, fmt::format("{}", fmt::join(at, ","))), kFar));
    };
    expect_near("eye", *spec.eye);
    if (!spec.look_at) return;
    expect_near("look_at", *spec.look_at);
    constexpr double kSame = 1e-9;  // samples
    if ((Vec3(spec.look_at->data()) - Vec3(spec.eye->data())).cwiseAbs().maxCoeff() <= kSame)
        throw RequestError(
            message("@look_at({}): is where @eye is, so there is no direction; give another "
                    "sample, or leave it out for the direction of @view",
                    fmt::join(*spec.look_at, ",")));
}

/// Where the eye is, centred object space [file unit]. In a face of the volume it is just before
/// it: else rounding would say whether rays that leave there meet anything.
Vec3 place_of_eye(const std::array<double, 3>& eye, const InputGrid& input) {
    constexpr double kBefore = 1e-6;  // sample
    Vec3 at(eye.data());
    for (int k = 0; k < 3; ++k) {
        const double low = -0.5, high = static_cast<double>(input.extent[k]) - 0.5;
        if (std::abs(at[k] - low) < kBefore) at[k] = low - kBefore;
        if (std::abs(at[k] - high) < kBefore) at[k] = high + kBefore;
    }
    return (at - centre_of(input.extent)).cwiseProduct(input.spacing);
}

/// Views as the eye has them: its sample is their origin, whatever moved it.
void move_to_eye(std::vector<Mat4>& maps, const Vec3& eye) {
    for (Mat4& map : maps) map.topRightCorner<3, 1>() = -(map.topLeftCorner<3, 3>() * eye);
}

/// Centred object space -> centred screen space, without the steps.
Mat4 viewed(const GeometrySpec& spec, const InputGrid& input, Job job) {
    const bool front = job == Job::render && input.anatomical;
    const std::string name = spec.view.value_or(front ? "front" : "z");
    const Mat3 view = view_of(name, input.direction);
    if (input.axes == 2 && view != Mat3::Identity())
        throw RequestError(message("@view({}): an image has only the view z", name));
    return linear(view);
}

/// The view as `look_at` turns it: what the view shows upwards stays up.
Mat4 looking(const GeometrySpec& spec, const InputGrid& input, const Mat4& view) {
    if (!spec.look_at) return view;
    const Vec3 along = Vec3(spec.look_at->data()) - Vec3(spec.eye->data());
    const Vec3 seen = view.topLeftCorner<3, 3>() * input.lean * along.cwiseProduct(input.spacing);
    return linear(looking_along(seen)) * view;
}

/// The step that makes the views; null: there is one. @throws RequestError
const GeometryStep* step_of_views(const GeometrySpec& spec, Job job) {
    const GeometryStep* found = nullptr;
    for (const GeometryStep& step : spec.steps) {
        if (!makes_views(step.kind)) continue;
        const Message name = setting_of(step.kind);
        if (job == Job::warp)
            throw RequestError(message("{}: only render makes several views", name));
        if (found && found->kind == step.kind)
            throw RequestError(message("{}: given twice; one {} makes the views", name,
                                       step.kind == GeometryStep::Kind::path ? "path" : "turn"));
        if (found)
            throw RequestError(message("@turntable and @path: each makes the views; only one may"));
        found = &step;
    }
    return found;
}

/// Centred object space -> centred screen space, one map a view.
std::vector<Mat4> all_views(const GeometrySpec& spec, const InputGrid& input, const Mat4& view,
                            Job job) {
    const GeometryStep* views = step_of_views(spec, job);
    const Vec3 held = view.topLeftCorner<3, 3>() * held_point(spec, input);
    // What `about` holds is held by each step, so also by several after one another; a turntable
    // among them goes about the middle of its pictures.
    Mat4 before = Mat4::Identity(), after = Mat4::Identity();
    const auto held_fast = [&](const Mat4& steps) -> Mat4 {
        return held.isZero(0) ? steps : Mat4(shift_by(held) * steps * shift_by(-held));
    };
    bool behind = false;
    for (const GeometryStep& step : spec.steps) {
        if (&step == views) {
            behind = true;
            continue;
        }
        Mat4& side = behind ? after : before;
        side = map_of(step, input) * side;
    }
    before = held_fast(before) * view;
    if (!views) return {before};
    after = held_fast(after);
    std::vector<Mat4> maps = maps_of(*views, input);
    for (Mat4& map : maps) {
        if (views->kind == GeometryStep::Kind::path) map = held_fast(map);
        map = after * map * before;
    }
    return maps;
}

/// The input as `view` turns it: axes change places and ends.
InputGrid turned_grid(const InputGrid& input, const Mat4& view) {
    const Mat3 turn = view.topLeftCorner<3, 3>();
    InputGrid grid = input;
    for (int to = 0; to < 3; ++to)
        for (int from = 0; from < 3; ++from)
            if (turn(to, from) != 0) {
                grid.extent[to] = input.extent[from];
                grid.spacing[to] = input.spacing[from];
            }
    grid.lean = turn * input.lean * turn.transpose();
    return grid;
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

/// The largest and the least singular value, by one-sided Jacobi rotations (Demmel and Veselic
/// 1992), which keep small ones accurate. Eigen's own would be most of what this folder takes to
/// compile.
std::pair<double, double> stretches_of(Eigen::Matrix3d columns, int axes) {
    constexpr int kSweeps = 30;
    bool rotated = true;
    for (int sweep = 0; sweep < kSweeps && rotated; ++sweep) {
        rotated = false;
        for (int p = 0; p < axes; ++p)
            for (int q = p + 1; q < axes; ++q) {
                const Vec3 a = columns.col(p), b = columns.col(q);
                const double dot = a.dot(b), aa = a.squaredNorm(), bb = b.squaredNorm();
                if (!(std::abs(dot) > 0x1p-50 * std::sqrt(aa * bb))) continue;
                const double zeta = (bb - aa) / (2 * dot);
                const double t = std::copysign(1.0, zeta) / (std::abs(zeta) + std::hypot(1, zeta));
                const double c = 1 / std::hypot(1, t);
                columns.col(p) = c * (a - t * b);
                columns.col(q) = c * (b + t * a);
                rotated = true;
            }
    }
    double largest = 0, least = std::numeric_limits<double>::infinity();
    for (int p = 0; p < axes; ++p) {
        largest = std::max(largest, columns.col(p).norm());
        least = std::min(least, columns.col(p).norm());
    }
    return {largest, least};
}

/// How much more an affine map stretches one direction than another. Steps that are fine one by one
/// may flatten the input together, which the determinant of none of them shows.
/// @throws RequestError where no f64 inverse of it would hold
double condition_of(const Mat4& map, int axes) {
    if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return 1;
    constexpr double kFlat = 1e12;  // places of 4096 samples would be off by 2^-53 kFlat 4096 = 0.5
    Eigen::Matrix3d linear = Eigen::Matrix3d::Zero();
    linear.topLeftCorner(axes, axes) = map.topLeftCorner(axes, axes);
    const auto [largest, least] = stretches_of(linear, axes);
    const double condition = largest / least;
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

namespace {

/// Entries that are half a sample but for rounding: what a grid's samples lie at when its axes only
/// change places.
double tidy(double at) {
    const double near = std::round(2 * at) / 2;
    return std::abs(at - near) <= 1e-9 ? near + 0.0 : at;
}

/// Where the output's samples lie: by the views themselves where the grid is what they turn, else
/// by `view` alone. Output index -> input index.
Mat4 place_of(const Mat4& turning) {
    if (turning == Mat4::Identity()) return turning;
    Mat4 lies = turning.inverse();
    for (int row = 0; row < 3; ++row) lies(row, 3) = tidy(lies(row, 3));
    return lies;
}

/// How deep the moved volume is, and how much of that is not in the output.
void measure_depth(Geometry& geometry, const Mat4& map, const std::vector<Vec3>& corners) {
    double low = 1e300, high = -1e300;
    for (const Vec3& corner : corners) {
        const std::optional<Vec3> at = sent(map, corner);
        if (!at) return;
        low = std::min(low, at->z());
        high = std::max(high, at->z());
    }
    const ScreenGrid& grid = geometry.grid;
    const double half = double(grid.extent.z) * grid.spacing.z() / 2;
    const double beyond =
        std::max(grid.centre.z() - half - low, high - grid.centre.z() - half) / grid.spacing.z();
    geometry.depth = (high - low) / grid.spacing.z();
    geometry.cut = std::max(0.0, beyond);
}

/// The grid of a warp becomes that of the samples that `crop` keeps.
/// @param turned  the input's grid as `view` turns it
/// @return where its centre is, from that of the input, in the axes of `turned` [file unit]
/// @throws RequestError
Vec3 take_crop(const std::vector<double>& box, const InputGrid& input, const Mat4& view,
               InputGrid& turned) {
    const auto axes = static_cast<std::size_t>(input.axes);
    if (box.size() != 2 * axes)
        throw RequestError(
            message("@crop: {} numbers given; expected {}: first and last sample along each axis",
                    box.size(), axes == 2 ? "X0,Y0,X1,Y1 of an image" : "X0,Y0,Z0,X1,Y1,Z1"));
    Vec3 centre = Vec3::Zero();
    Extent kept = input.extent;
    for (std::size_t k = 0; k < axes; ++k) {
        const double first = box[k], last = box[axes + k];
        const int axis = static_cast<int>(k);
        const auto most = static_cast<double>(input.extent[axis] - 1);
        if (first != std::floor(first) || last != std::floor(last) || !(first >= 0) ||
            !(last <= most) || first > last)
            throw RequestError(
                message("@crop: {},{} along {}: expected whole numbers, the first at most the "
                        "last, from 0 to {}",
                        first, last, "xyz"[k], most));
        kept[axis] = static_cast<std::int64_t>(last - first) + 1;
        centre[axis] = ((first + last) / 2 - most / 2) * input.spacing[axis];
    }
    const Mat3 turn = view.topLeftCorner<3, 3>();
    for (int to = 0; to < 3; ++to)
        for (int from = 0; from < 3; ++from)
            if (turn(to, from) != 0) turned.extent[to] = kept[from];
    return turn * centre;
}

void expect_croppable(const GeometrySpec& spec, Job job) {
    if (!spec.crop) return;
    if (job != Job::warp) throw RequestError(message("@crop: a crop is of warp"));
    if (spec.grid_moves.value_or(false))
        throw RequestError(
            message("@crop: its box is of the grid of FILE, which @grid_moves(true) leaves"));
    if (spec.size && spec.size->fit)
        throw RequestError(
            message("@size(fit): nothing is cut off, and @crop cuts; leave out one"));
}

}  // namespace

void take_axes(InputGrid& grid, const Mat3& points) {
    constexpr double kUnseen = 0.1;  // sample
    grid.direction = points;
    grid.lean = Mat3::Identity();
    // Gram and Schmidt, in the order of the axes: slices stay as they were acquired.
    Mat3 own = points;
    for (int k = 0; k < grid.axes; ++k) {
        for (int j = 0; j < k; ++j) {
            const double along = own.col(j).dot(points.col(k));
            grid.lean(j, k) = along;
            own.col(k) -= along * own.col(j);
        }
        const double across = own.col(k).norm();
        grid.lean(k, k) = across;
        own.col(k) /= across;
    }
    bool seen = false;
    for (int k = 0; k < grid.axes; ++k)
        for (int j = 0; j < k; ++j)
            seen |= std::abs(grid.lean(j, k)) * double(grid.extent[k]) * grid.spacing[k] >
                    kUnseen * grid.spacing[j];
    if (seen)
        grid.direction = own;
    else
        grid.lean = Mat3::Identity();
}

Geometry geometry_of(const GeometrySpec& spec, const InputGrid& input, Job job) {
    expect_eye(spec, input, job);
    const Mat4 view = viewed(spec, input, job);
    std::vector<Mat4> maps = all_views(spec, input, looking(spec, input, view), job);
    expect_croppable(spec, job);
    InputGrid turned = turned_grid(input, view);
    Vec3 middle = Vec3::Zero();
    if (spec.crop) middle = take_crop(*spec.crop, input, view, turned);
    Mat4 turning = view;
    if (input.leans()) {
        // From along the axes of the grid to perpendicular ones and, in a warp, back.
        Mat4 back = Mat4::Identity();
        if (job == Job::warp && !spec.upright) back = linear(turned.lean.inverse());
        const Mat4 lean = linear(input.lean);
        for (Mat4& map : maps) map = back * map * lean;
        turning = back * turning * lean;
    }
    std::vector<Vec3> corners = corners_of(input);
    for (Vec3& corner : corners)
        corner = (corner - centre_of(input.extent)).cwiseProduct(input.spacing);

    Geometry geometry;
    // Turns are as good as one another.
    const GeometryStep* views = step_of_views(spec, job);
    const bool differ = views && views->kind == GeometryStep::Kind::path;
    for (std::size_t i = 0; i < (differ ? maps.size() : 1); ++i)
        geometry.condition = std::max(geometry.condition, condition_of(maps[i], input.axes));
    // Pictures are as large from anywhere.
    if (spec.eye) move_to_eye(maps, Vec3::Zero());
    geometry.grid = job == Job::warp ? warp_grid(spec, turned, maps[0], corners)
                                     : picture_grid(spec, input, maps, corners);
    if (spec.crop) geometry.grid.centre = middle;
    if (spec.perspective && job == Job::warp)
        throw RequestError(message("@perspective: only render has an eye"));
    if (spec.eye) {
        move_to_eye(maps, place_of_eye(*spec.eye, input));
        geometry.eye = eye_at_origin(*spec.perspective, geometry.grid, maps, corners);
        geometry.eye_placed = true;
    } else if (spec.perspective) {
        // The eye sees the whole scene, of which a zoom shows the middle.
        geometry.eye = eye_of(*spec.perspective, geometry.grid, maps, corners);
    }
    if (spec.zoom) {
        zoom(geometry.grid, *spec.zoom, job);
        if (geometry.eye) take_steps(*geometry.eye, geometry.grid);
    }
    if (job == Job::render) {
        // Beyond this rays of a picture are one ray, or all but one miss.
        constexpr double kMost = 1e9;
        const auto pixel = geometry.grid.spacing.head<2>() / input.spacing.minCoeff();
        if (!(pixel.minCoeff() >= 1 / kMost && pixel.maxCoeff() <= kMost))
            throw RequestError(message(
                "@spacing: pixels of {:g} x {:g} where samples are {:g} "
                "apart",
                geometry.grid.spacing.x(), geometry.grid.spacing.y(), input.spacing.minCoeff()));
        geometry.unit = geometry.grid.spacing.z();
    }
    for (const Mat4& map : maps) geometry.views.push_back(on_grid(map, input, geometry.grid));
    for (const Mat4& map : geometry.views)
        if (!map.allFinite()) throw RequestError("the geometry options overflow when combined");
    if (job == Job::render) {
        if (spec.grid_moves)
            throw RequestError(message("@grid_moves: of warp; a picture has no grid to turn"));
        return geometry;
    }
    const bool grid_moves = spec.grid_moves.value_or(false);
    if (grid_moves && maps[0].row(3) != Eigen::RowVector4d(0, 0, 0, 1))
        throw RequestError(
            message("@grid_moves(true): a homography leaves no grid of equal steps"));
    geometry.lies =
        place_of(grid_moves ? geometry.views[0] : on_grid(turning, input, geometry.grid));
    // Who crops has said what is cut off.
    if (input.axes == 3 && !spec.crop) measure_depth(geometry, maps[0], corners);
    return geometry;
}

void take_usual_size(GeometrySpec& spec, const InputGrid& input, Job job) {
    constexpr std::int64_t kLeastSide = 512;
    if (spec.size && spec.size->native) {
        if (job != Job::render)
            throw RequestError(
                message("@size(native): of render; a warp has the input's samples unasked"));
        if (spec.spacing)
            throw RequestError(message("@size(native): says the spacing; leave out @spacing"));
        spec.size.reset();
        return;
    }
    if (job != Job::render || spec.size || spec.spacing) return;
    const Extent size = geometry_of(spec, input, Job::render).grid.extent;
    if (std::max(size.x, size.y) < kLeastSide) spec.size = OutputSize{.sides = {kLeastSide}};
}

}  // namespace edgewise
