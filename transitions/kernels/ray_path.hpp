#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "graph/clip.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// Where one ray's sample cells lie. Positions are those of cell `first`'s middle, in input
/// indices; offsets count cells from there.
struct RayPath {
    std::array<double, 3> position{}, stride{};     // of the middle of cell `first`; of one cell
    std::int64_t first = 0, last = -1;              // cells that overlap the box; none: a miss
    double first_offset = 0, last_offset = 0;       // where the end cells are sampled
    double first_weight = 0, last_weight = 0;       // their length, 1 for a whole cell
    std::int64_t inner_first = 0, inner_last = -1;  // whole cells whose taps need no clamping
    double length = 0;                              // inside the box [cells]

    bool hit() const noexcept { return first <= last; }
};

/// 1 / d of a ray's stride d; 0 for a ray along a slab (also -0): so small a stride leaves no
/// trace within any volume, and its inverse times 0 would be no number.
inline double inverse_stride(double d) noexcept { return std::abs(d) < 1e-280 ? 0 : 1 / d; }

/// The faces of the box that rays see: the volume's, or those of the cropped box.
inline double low_face(const RayCast& cast, std::size_t axis) noexcept {
    return cast.kept ? cast.kept->low[axis] : -0.5;
}
inline double high_face(const RayCast& cast, std::size_t axis) noexcept {
    return cast.kept ? cast.kept->high[axis]
                     : static_cast<double>(cast.volume.extent[static_cast<int>(axis)]) - 0.5;
}

/// What all rays of a cast share, if they are parallel.
struct ParallelRays {
    bool parallel = false;
    double cell = 0;  // of the direction [1]
    std::array<double, 3> along{}, inverse{};

    explicit ParallelRays(const RayCast& cast) noexcept {
        const auto same = [](const Rays::Field& field) {
            return field.x == std::array<double, 3>{} && field.y == field.x;
        };
        parallel = same(cast.rays.measure) && same(cast.rays.direction);
        const auto& m = cast.rays.measure.base;
        cell = cast.step / std::hypot(m[0], m[1], m[2]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            along[axis] = cast.rays.direction.base[axis] * cell;
            inverse[axis] = inverse_stride(along[axis]);
        }
    }
};

/// The pixels whose parallel rays meet the box: a convex polygon. Intervals of a line have a point
/// in common where each two of them have, so each slab has to begin before any other ends, which is
/// a half-plane of pixels. Half spaces are slabs with one end. What balls leave of the box is
/// within it, so that they need no side.
class Shadow {
 public:
    /// Of pixels [x, x + width) x [y, y + height); elsewhere it may be too small. Of rays from an
    /// eye it is everywhere.
    Shadow(const RayCast& cast, const ParallelRays& shared, double x, double y, double width,
           double height) noexcept {
        if (!shared.parallel) return;
        const Rays::Field& origin = cast.rays.origin;
        std::array<HalfPlane, kSlabs> begins, ends;  // of slabs, as t that is after all pixels'
        for (std::size_t a = 0; a < 3; ++a) {
            const double inverse = shared.inverse[a], scale = inverse == 0 ? 1 : inverse;
            const double from = low_face(cast, a), to = high_face(cast, a);
            // Far more than the error of either rounding.
            const double slack = 1e-12 * (std::abs(origin.base[a]) + to +
                                          std::abs(origin.x[a]) * (std::abs(x) + width) +
                                          std::abs(origin.y[a]) * (std::abs(y) + height));
            const auto reached = [&](double face, double sign) {
                return HalfPlane{(face - origin.base[a]) * scale + sign * slack * std::abs(scale),
                                 -origin.x[a] * scale, -origin.y[a] * scale};
            };
            begins[a] = reached(scale > 0 ? from : to, -1);
            ends[a] = reached(scale > 0 ? to : from, 1);
        }
        for (std::size_t a = 0; a < 3; ++a) {
            if (shared.inverse[a] == 0) {
                sides_[count_++] = ends[a];
                sides_[count_++] = HalfPlane{} - begins[a];
                continue;
            }
            for (std::size_t b = 0; b < 3; ++b)
                if (b != a && shared.inverse[b] != 0) sides_[count_++] = ends[b] - begins[a];
        }
        if (cast.kept)
            add_planes(cast, shared, begins, ends, std::abs(x) + width, std::abs(y) + height);
    }

    struct Columns {
        double first, last;
    };
    /// Outside of which no ray of rows [top, bottom] meets the box.
    Columns columns(double top, double bottom) const noexcept {
        constexpr double kAny = std::numeric_limits<double>::infinity();
        Columns in{-kAny, kAny};
        for (int i = 0; i < count_; ++i) {
            const HalfPlane& side = sides_[i];
            const double most = side.base + std::max(side.y * top, side.y * bottom);
            if (side.x == 0 && most < 0) in.last = -kAny;
            // In this order a bound that is no number changes nothing.
            if (side.x > 0) in.first = std::max(in.first, -most / side.x);
            if (side.x < 0) in.last = std::min(in.last, -most / side.x);
        }
        return in;
    }

 private:
    struct HalfPlane {  // pixels where base + x px + y py >= 0
        double base = 0, x = 0, y = 0;

        HalfPlane operator-(const HalfPlane& other) const noexcept {
            return {base - other.base, x - other.x, y - other.y};
        }
    };
    /// Of more planes the first so many: the polygon may be larger than needed, never smaller.
    static constexpr std::size_t kPlanes = 6, kSlabs = 3 + kPlanes;

    /// @param begins,ends  of the box's slabs; those of planes are added
    /// @param right,down   the largest |x| and |y| of pixels
    void add_planes(const RayCast& cast, const ParallelRays& shared,
                    std::array<HalfPlane, kSlabs>& begins, std::array<HalfPlane, kSlabs>& ends,
                    double right, double down) noexcept {
        std::array<bool, kSlabs> has_begin{}, has_end{};
        for (std::size_t a = 0; a < 3; ++a) has_begin[a] = has_end[a] = shared.inverse[a] != 0;
        std::size_t slabs = 3;
        for (const Kept::Plane& plane : cast.kept->planes) {
            if (slabs == kSlabs) break;
            const Rays::Field& origin = cast.rays.origin;
            HalfPlane at{plane.offset, 0, 0};
            double slope = 0, slack = std::abs(plane.offset);
            for (std::size_t a = 0; a < 3; ++a) {
                const double n = plane.normal[a];
                at.base += n * origin.base[a];
                at.x += n * origin.x[a];
                at.y += n * origin.y[a];
                slope += n * shared.along[a];
                slack += std::abs(n) * (std::abs(origin.base[a]) + std::abs(origin.x[a]) * right +
                                        std::abs(origin.y[a]) * down);
            }
            at.base += 1e-12 * slack;
            if (std::abs(slope) < kAlongPlane) {
                at.base += kInPlane;
                sides_[count_++] = at;
                continue;
            }
            const HalfPlane reached{-at.base / slope, -at.x / slope, -at.y / slope};
            (slope > 0 ? begins : ends)[slabs] = reached;
            (slope > 0 ? has_begin : has_end)[slabs++] = true;
        }
        for (std::size_t a = 0; a < slabs; ++a)
            for (std::size_t b = 0; b < slabs; ++b)
                if (a != b && (a > 2 || b > 2) && has_begin[a] && has_end[b])
                    sides_[count_++] = ends[b] - begins[a];
    }

    std::array<HalfPlane, kSlabs * kSlabs + kPlanes> sides_;
    int count_ = 0;
};

/// Whether samples of parallel rays lie so far apart that 32 neighbours take a cache line or more
/// of a volume that caches do not hold. Casts then ask for lines before they read them, which takes
/// 0.5 to 0.9 of the time with 14 to 32 MB; elsewhere it would take up to 1.5 times as long.
inline bool is_sparse(const RayCast& cast) noexcept {
    constexpr double kCached = 12 << 20, kLine = 64, kNeighbours = 32;
    const Grid& volume = cast.volume;
    const auto bytes = static_cast<double>(bytes_of(volume.type));
    const ParallelRays shared(cast);
    if (!shared.parallel || bytes * static_cast<double>(volume.extent.samples()) < kCached)
        return false;
    const auto &right = cast.rays.origin.x, &down = cast.rays.origin.y, &along = shared.along;
    double voxels = 0;  // between neighbouring samples: the volume that a sample stands for
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
        voxels += right[a] * (down[b] * along[c] - down[c] * along[b]);
    }
    constexpr double kRounding = 1e-6;
    return std::abs(voxels) * kNeighbours * bytes >= kLine * (1 - kRounding);
}

/// Clips [low, high] to where o + t d lies within [from, to]. A ray in a face counts as inside.
/// @param inverse  inverse_stride(d)
inline void clip(double o, double inverse, double from, double to, double& low,
                 double& high) noexcept {
    if (from > to || inverse == 0) {
        if (from > to || o < from || o > to) high = low;
        return;
    }
    const double a = (from - o) * inverse, b = (to - o) * inverse;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
}

/// What a ray has of a cell counts with the next cell where it is shorter [cell]. Rounding decides
/// whether there is such a piece, and a maximum would take a sample of it.
inline constexpr double kSliver = 1e-9;

/// The ray of a pixel. All lengths in cells: one cell is one step.
inline RayPath ray_path(const RayCast& cast, double px, double py) noexcept {
    const auto origin = cast.rays.origin.at(px, py);
    const auto direction = cast.rays.direction.at(px, py);
    const auto measure = cast.rays.measure.at(px, py);
    const double cell = cast.step / std::hypot(measure[0], measure[1], measure[2]);
    const Extent& n = cast.volume.extent;
    // The tap of a hold that lies farthest out must be a sample; a margin absorbs f32 rounding.
    const double below = taps_below(cast);

    RayPath path;
    double low = cast.rays.start / cast.step, high = cast.rays.end / cast.step;
    double inner_low = low, inner_high = high;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = direction[axis] * cell, top = static_cast<double>(n[axis]) - 0.5;
        const double margin = 1e-3 + 1e-6 * top, inverse = inverse_stride(d);
        const auto a = static_cast<std::size_t>(axis);
        path.stride[axis] = d;
        clip(origin[axis], inverse, low_face(cast, a), high_face(cast, a), low, high);
        clip(origin[axis], inverse, below + margin, top - 0.5 - below - margin, inner_low,
             inner_high);
    }
    if (cast.kept)
        for (const auto& [normal, offset] : cast.kept->planes) {
            double at = offset, slope = 0;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                at += normal[axis] * origin[axis];
                slope += normal[axis] * path.stride[axis];
            }
            cut_by_plane(at, slope, low, high);
        }
    if (cast.kept)
        for (const Kept::Ball& ball : cast.kept->balls)
            cut_by_ball(ball.from_centre(origin), ball.turned(path.stride), low, high);
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high)) return path;
    path.first = static_cast<std::int64_t>(std::floor(low + kSliver));
    path.last = std::max(path.first, static_cast<std::int64_t>(std::ceil(high - kSliver)) - 1);
    path.length = high - low;
    const double base = static_cast<double>(path.first) + 0.5;
    for (int axis = 0; axis < 3; ++axis)
        path.position[axis] = origin[axis] + base * path.stride[axis];
    const double first_end = std::min(high, base + 0.5);
    const double last_begin = std::max(low, static_cast<double>(path.last));
    path.first_weight = first_end - low;
    path.first_offset = 0.5 * (low + first_end) - base;
    path.last_weight = high - last_begin;
    path.last_offset = 0.5 * (last_begin + high) - base;
    if (inner_low < inner_high) {
        path.inner_first =
            std::max(path.first + 1, static_cast<std::int64_t>(std::ceil(inner_low - 0.5)));
        path.inner_last =
            std::min(path.last - 1, static_cast<std::int64_t>(std::floor(inner_high - 0.5)));
    }
    return path;
}

}  // namespace edgewise::kernels
