#include "transitions/project/picture.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/label_surface.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/no_rays.hpp"

namespace edgewise {
namespace {

std::array<double, 3> array_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace

std::string no_picture(const Representation& from, const Ask& ask) {
    if (shows_labels(ask.want)) return "surfaces of labels are asked for, which have no level";
    return no_rays(from, ask);
}

std::string no_rays(const Representation& from, const Ask& ask) {
    const Request& want = ask.want;
    if (!want.job->of_rays()) return "the result is a volume, not a picture";
    if (from.axes != 3) return "an image has no depth to look through";
    if (from.channels != 1) return fmt::format("{} channels; rays combine one", from.channels);
    if (from.type == Type::c64) return "complex samples have no largest value and no opacity";
    if (!is_whole(from) && !is_spread(from)) return "needs all samples in memory, row by row";
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const int view = want.views.first_view(variant);
        const Mat4& map = want.views.at(view).matrix();
        if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
            return fmt::format("view {}: a projective map of a volume", view);
        const double det = map.determinant();
        if (!(std::abs(det) > 1e-12) || !std::isfinite(det))
            return fmt::format("view {}: determinant {:.3g}, no inverse", view, det);
    }
    return {};
}

std::string no_slices(const Request& want) {
    if (!want.clips.empty()) return "the clip cuts slices, which are combined whole";
    if (want.mode->first_hit)
        return "the surface lies between slices, which are combined one by one";
    if (want.shading.on())
        return "light needs gradients across slices, which are combined one by one";
    if (want.cue) return "light falls off along rays, and slices are combined alike";
    if (want.transfer.needs_gradients())
        return "opacities need gradients across slices, which are combined one by one";
    return {};
}

kernels::Optics optics_of(const Request& want, const ValueMap& values) {
    if (!want.mode->takes_transfer) return {};
    SmallVector<kernels::OpticsPoint> points;
    for (const Transfer::Point& point : want.transfer.points)
        points.push_back({point.value, point.opacity, point.color});
    return kernels::optics_of(points, want.transfer.unit / want.unit, values);
}

namespace {

ValueMap turned(const Request& want, ValueMap values) {
    if (!want.mode->negated) return values;
    return {.slope = -values.slope, .offset = -values.offset};
}

}  // namespace

kernels::Grid rule_grid(const Data& in, const Request& want) {
    kernels::Grid grid = kernels::grid_of(in);
    grid.values = turned(want, grid.values);
    return grid;
}

kernels::Combining combining_of(const Request& want, const ValueMap& values,
                                const kernels::Optics& optics) {
    return {.rule = want.mode->combine,
            .other = want.mode->rule,
            .values = turned(want, values),
            .unit = want.unit,
            .zero = want.zero,
            .miss = rule_miss(want),
            .level = want.level(),
            .optics = &optics,
            .bound = kTerminated};
}

double rule_miss(const Request& want) noexcept {
    if (want.mode->miss != ModeTraits::Miss::zero)
        return want.mode->negated ? -want.miss : want.miss;
    // Mostly 0; behind no sample all light is left.
    double value = 0;
    if (want.mode->channels == 1) Stretch::empty(want.mode).result(want, &value);
    return value;
}

void give_sign(const Request& want, float* first, std::int64_t width, std::int64_t height,
               std::ptrdiff_t row) noexcept {
    if (!want.mode->negated) return;
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t i = 0; i < width * want.mode->channels; ++i)
            first[y * row + i] = 0 - first[y * row + i];
}

kernels::Rays rays_of(const Representation& from, const Request& want, int view, double front) {
    const Mat4 forward = residual(from, want, view);
    // An exact map stays exact.
    const Mat4 map = forward == Mat4::Identity() ? forward : Mat4(forward.inverse());
    const auto point = [&map](const Vec3& p) {
        return array_of(Vec3(map.topLeftCorner<3, 3>() * p + map.topRightCorner<3, 1>()));
    };
    const auto along = [&map](const Vec3& d) {
        return array_of(Vec3(map.topLeftCorner<3, 3>() * d));
    };
    kernels::Rays rays;
    if (!want.eye) {
        rays.origin = {point({0, 0, front}), along({1, 0, 0}), along({0, 1, 0})};
        rays.direction.base = along({0, 0, 1});
        return rays;
    }
    const Vec3 to_corner = Vec3(0, 0, want.eye->plane) - want.eye->at;
    const Vec3 steps(want.eye->width, want.eye->height, 1);
    rays.origin.base = point(want.eye->at);
    rays.direction = {along(to_corner), along({1, 0, 0}), along({0, 1, 0})};
    rays.measure = {array_of(to_corner.cwiseProduct(steps)), {steps[0], 0, 0}, {0, steps[1], 0}};
    rays.start = 0;
    return rays;
}

std::optional<kernels::Kept> kept_of(const Representation& from, const Request& want, int view) {
    const Clip* clip = want.clip(view);
    if (!clip) return {};
    const Mat4 placed = from.placed.at(view).matrix();
    kernels::Kept kept;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        kept.low[axis] = -0.5;
        kept.high[axis] = static_cast<double>(from.extent[static_cast<int>(axis)]) - 0.5;
    }
    // A plane is moved with what it cuts.
    const bool is_input = placed == Mat4::Identity();
    const Eigen::Matrix3d back =
        is_input ? Eigen::Matrix3d::Identity()
                 : Eigen::Matrix3d(placed.topLeftCorner<3, 3>().inverse().transpose());
    const auto keep = [&](const HalfSpace& plane) {
        const Vec3 normal = back * plane.normal;
        const double offset = plane.offset - normal.dot(placed.topRightCorner<3, 1>());
        bool is_face = false;
        for (std::size_t axis = 0; axis < 3 && !is_face; ++axis) {
            const double along = normal[static_cast<int>(axis)];
            is_face = std::abs(along) == normal.lpNorm<1>();
            if (is_face && along > 0) kept.low[axis] = std::max(kept.low[axis], -offset / along);
            if (is_face && along < 0) kept.high[axis] = std::min(kept.high[axis], -offset / along);
        }
        if (!is_face) kept.planes.push_back({array_of(normal), offset});
    };
    for_each_half_space(*clip, keep);
    for (const Ball& ball : clip->balls) {
        const Ball moved{placed.topLeftCorner<3, 3>() * ball.centre + placed.topRightCorner<3, 1>(),
                         ball.to_unit * back.transpose()};
        kernels::Kept::Ball ours{array_of(moved.centre), {}};
        for (std::size_t i = 0; i < 9; ++i)
            ours.to_unit[i] = moved.to_unit(static_cast<int>(i) / 3, static_cast<int>(i) % 3);
        kept.balls.push_back(ours);
        // Rays that miss the ball are told by its box, which is a little larger and cuts no other.
        constexpr double kBeyond = 1e-6;
        const Vec3 reach = moved.reach() * (1 + kBeyond) + Vec3::Constant(kBeyond);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<int>(axis);
            kept.low[axis] = std::max(kept.low[axis], moved.centre[a] - reach[a]);
            kept.high[axis] = std::min(kept.high[axis], moved.centre[a] + reach[a]);
        }
    }
    return kept;
}

std::optional<kernels::RayLight> light_of(const Representation& from, const Request& want,
                                          int view) {
    if (!want.shading.on()) return {};
    const Eigen::Matrix3d to_input = residual(from, want, view).topLeftCorner<3, 3>().inverse();
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    return kernels::ray_light_of(
        want.shading, steps.cwiseInverse().asDiagonal() * to_input.transpose(), from.values);
}

namespace {

/// Samples in a file unit, along each axis.
Vec3 per_length_of(const Representation& from, const Request& want, int view) {
    const Eigen::Matrix3d to_input = from.placed.at(view).inverse().matrix().topLeftCorner<3, 3>();
    const Vec3 steps = (want.spacing.asDiagonal() * to_input).colwise().norm().transpose();
    return steps.cwiseInverse();
}

}  // namespace

std::optional<kernels::RayEdges> edges_of(const Representation& from, const Request& want,
                                          int view) {
    if (want.transfer.edges.empty()) return {};
    return kernels::ray_edges_of(want.transfer.edges, per_length_of(from, want, view), from.values);
}

std::optional<kernels::RayTable> table_of(const Representation& from, const Request& want,
                                          int view) {
    if (!want.mode->takes_transfer || !want.transfer.table) return {};
    return kernels::ray_table_of(*want.transfer.table, per_length_of(from, want, view),
                                 from.values);
}

std::optional<kernels::RayCue> cue_of(const Request& want, int view, double front) {
    if (!want.cue) return {};
    const double first = want.eye ? want.eye->at.z() : front;
    return kernels::RayCue{*want.cue, first - nearest_corner(want, view), want.unit};
}

namespace {

/// A convex part of samples: the smallest box around it, and its volume.
struct Part {
    Vec3 low, high;  // index
    double volume;   // [sample]
};

/// What rays of a view meet of the samples.
Part part_of(const Representation& from, const Request& want, int view) {
    Part all{Vec3::Constant(-0.5), {}, static_cast<double>(from.extent.samples())};
    for (int axis = 0; axis < 3; ++axis)
        all.high[axis] = static_cast<double>(from.extent[axis]) - 0.5;
    const Clip* clip = want.clip(view);
    if (!clip) return all;
    const Mat4 placed = from.placed.at(view).matrix();
    Part part{all.high, all.low, 0};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1 ? clip->most : clip->least)[axis];
        p = placed.topLeftCorner<3, 3>() * p + placed.topRightCorner<3, 1>();
        p = p.cwiseMax(all.low).cwiseMin(all.high);
        part.low = part.low.cwiseMin(p);
        part.high = part.high.cwiseMax(p);
    }
    part.volume =
        std::min(all.volume, std::abs(placed.topLeftCorner<3, 3>().determinant()) * clip->volume);
    return part;
}

/// Whether parallel rays through all of the screen pass through all of the box, but for what maps
/// are rounded by.
bool sees_all(const Mat4& map, const Part& box, const Extent& screen) {
    constexpr double kRounding = 1e-6;  // pixels
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1 ? box.high : box.low)[axis];
        p = map.topLeftCorner<3, 3>() * p + map.topRightCorner<3, 1>();
        for (int axis = 0; axis < 2; ++axis)
            if (!(p[axis] >= -0.5 - kRounding &&
                  p[axis] <= static_cast<double>(screen[axis]) - 0.5 + kRounding))
                return false;
    }
    return true;
}

}  // namespace

double mean_length(const Representation& from, const Request& want, int view) {
    const Part part = part_of(from, want, view);
    if (const Mat4 map = residual(from, want, view);
        !want.eye && sees_all(map, part, want.screen)) {
        // Lengths over a whole shadow add up to the volume.
        const double volume = std::abs(map.topLeftCorner<3, 3>().determinant()) * part.volume;
        return volume / (static_cast<double>(want.screen.x) * static_cast<double>(want.screen.y));
    }
    constexpr int kSide = 24;
    kernels::RayCast cast;
    cast.volume.extent = from.extent;
    cast.rays = rays_of(from, want, view);
    const std::optional<kernels::Kept> kept = kept_of(from, want, view);
    if (kept) cast.kept = &*kept;
    double sum = 0;
    for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i) {
            const double x = (i + 0.5) / kSide * static_cast<double>(want.screen.x) - 0.5;
            const double y = (j + 0.5) / kSide * static_cast<double>(want.screen.y) - 0.5;
            sum += kernels::ray_path(cast, x, y).length;
        }
    return sum / (kSide * kSide);
}

RaysMet rays_met(const Representation& from, const Request& want, int view, int side) {
    const double pixels = static_cast<double>(want.screen.x) * static_cast<double>(want.screen.y);
    if (want.eye) return {.rays = pixels, .packets = pixels};
    Eigen::Matrix3d edges = residual(from, want, view).topLeftCorner<3, 3>();
    const Part part = part_of(from, want, view);
    for (int axis = 0; axis < 3; ++axis) edges.col(axis) *= part.high[axis] - part.low[axis];
    // A packet goes from the first to the last that one of its rays has of the data: what the sum
    // of data and packet (Minkowski's), over all places of the packet, has of one ray. Its volume
    // is that of all parallelepipeds that three of the edges of both span; those of one of the
    // data's faces and a packet's side belong to rays that begin or end there, but where the face
    // is seen from its side.
    const double s = side - 1;  // between a packet's outer rays
    const Eigen::Array3d width = edges.row(0).cwiseAbs(), height = edges.row(1).cwiseAbs(),
                         depth = edges.row(2).cwiseAbs();
    RaysMet all{.packets = s * (width.sum() + height.sum()) + s * s, .beyond = s * s * depth.sum()};
    for (int axis = 0; axis < 3; ++axis) {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        const Eigen::Array3d face = Vec3(edges.col(b)).cross(Vec3(edges.col(c))).cwiseAbs();
        const double swept = s * (face.x() + face.y());
        // Part of the packets that the face and its rim meet; a quarter of it fits casts counted
        // ray by ray.
        const double rim = s * (width[b] + width[c] + height[b] + height[c]) + s * s;
        all.rays += face.z();
        all.beyond += swept;
        all.ragged += swept * face.z() / std::max(face.z() + rim / 4, 1e-300);
    }
    all.packets += all.rays;
    const double shown = all.rays > pixels ? pixels / all.rays : 1;
    return {.rays = shown * all.rays,
            .packets = std::min(pixels, shown * all.packets),
            .beyond = shown * all.beyond,
            .ragged = shown * all.ragged};
}

void for_tiles(const Region& region, std::int64_t width, std::int64_t height,
               const Context& context, const std::function<void(const Region&)>& body) {
    const Extent size = region.extent();
    const std::int64_t across = (size.x + width - 1) / width;
    const std::int64_t down = (size.y + height - 1) / height;
    tbb::parallel_for(std::int64_t{0}, across * down, [&](std::int64_t i) {
        if (context.stopped()) return;
        Region tile = region;
        tile.begin[0] += i % across * width;
        tile.begin[1] += i / across * height;
        tile.end[0] = std::min(tile.begin[0] + width, region.end[0]);
        tile.end[1] = std::min(tile.begin[1] + height, region.end[1]);
        body(tile);
    });
    context.poll();
}

}  // namespace edgewise
