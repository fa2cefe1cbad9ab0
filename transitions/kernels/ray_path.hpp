#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

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

/// The ray of a pixel. All lengths in cells: one cell is one step.
inline RayPath ray_path(const RayCast& cast, double px, double py) noexcept {
    const auto origin = cast.rays.origin.at(px, py);
    const auto direction = cast.rays.direction.at(px, py);
    const auto measure = cast.rays.measure.at(px, py);
    const double cell = cast.step / std::hypot(measure[0], measure[1], measure[2]);
    const Extent& n = cast.volume.extent;
    // The tap of a hold that lies farthest out must be a sample; a margin absorbs f32 rounding.
    const double below = cast.hold == Hold::zoh ? -0.5 : cast.hold == Hold::foh ? 0 : 1;

    RayPath path;
    double low = cast.rays.start / cast.step, high = std::numeric_limits<double>::infinity();
    double inner_low = low, inner_high = high;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = direction[axis] * cell, top = static_cast<double>(n[axis]) - 0.5;
        const double margin = 1e-3 + 1e-6 * top, inverse = inverse_stride(d);
        path.stride[axis] = d;
        clip(origin[axis], inverse, -0.5, top, low, high);
        clip(origin[axis], inverse, below + margin, top - 0.5 - below - margin, inner_low,
             inner_high);
    }
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high)) return path;
    path.first = static_cast<std::int64_t>(std::floor(low));
    path.last = static_cast<std::int64_t>(std::ceil(high)) - 1;
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
