#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/ray_path.hpp"

namespace edgewise::kernels {

/// Rays from an eye through slices, which they cross one by one. A pixel of the intermediate image
/// is a place in the slice nearest to the eye. In slice k, counted from there, its ray is at
///   place + k (place - eye) / distance
/// so that a slice lies on the image shrunk about the eye's foot, and a row of it stays a row.
/// Along a ray the samples are the slices themselves, and each weighs the length of the ray that
/// it stands for, which differs from ray to ray. [Lacroute, Levoy 1994]
struct PerspectiveSlices {
    /// One axis across the slices [voxel].
    struct Across {
        double first = 0, pitch = 1;  // place of pixel 0; from pixel to pixel
        double eye = 0;

        double at(double pixel) const noexcept { return first + pixel * pitch; }
    };

    Grid volume;            // x and y across, z along the slices; one channel, no coefficients
    Hold hold = Hold::foh;  // zoh or foh
    Combining with = {};    // step: 1
    std::array<Across, 2> across = {};
    double distance = 1;     // from the eye to the nearest slice [voxel]
    bool backwards = false;  // the last slice is nearest
    double front = -0.5;     // where rays may enter, in slices counted from the nearest
    /// A ray that goes (a, b) across from slice to slice has the squared length
    /// m0 a^2 + m1 b^2 + m2 + 2 (m3 a b + m4 a + m5 b) there [t^2].
    std::array<double, 6> metric{0, 0, 1, 0, 0, 0};
};

/// The ray of a place in the nearest slice.
struct SliceRay {
    std::array<double, 2> at{}, slope{};  // in slice 0; from slice to slice [voxel]
    double low = 0, high = 0;             // inside the volume [slice]; none: equal
    double step = 1;                      // its length from slice to slice [t]

    bool hits() const noexcept { return low < high; }
    double length() const noexcept { return (high - low) * step; }
};

inline SliceRay slice_ray(const PerspectiveSlices& of, double x, double y) noexcept {
    // A ray in a face of the volume must not be lost to the rounding of its place.
    constexpr double kSlip = 1e-9;
    const Extent& n = of.volume.extent;
    SliceRay ray{.at = {x, y}, .low = of.front, .high = static_cast<double>(n.z) - 0.5};
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        ray.slope[a] = (ray.at[a] - of.across[a].eye) / of.distance;
        clip(ray.at[a], inverse_stride(ray.slope[a]), -0.5 - kSlip,
             static_cast<double>(n[axis]) - 0.5 + kSlip, ray.low, ray.high);
    }
    // Chords so short may be nothing but the rounding of spans, which are f32.
    if (!(ray.high - ray.low > 1e-6 * static_cast<double>(n.z + 1))) ray.high = ray.low;
    const auto& m = of.metric;
    const double a = ray.slope[0], b = ray.slope[1];
    ray.step =
        std::sqrt(m[0] * a * a + m[1] * b * b + m[2] + 2 * (m[3] * a * b + m[4] * a + m[5] * b));
    return ray;
}

/// A tile of the image is at most so large: states and rows stay in the caches.
inline constexpr std::int64_t kPerspectiveWidth = 128, kPerspectiveHeight = 16;

/// What slices leave in a tile. Rows of lengths are as far apart as those of states.
struct PerspectiveTile {
    PixelStates states;
    const float* lengths = nullptr;  // of rays inside the volume [t]; 0: a ray misses
};

/// Floats of room for a tile.
std::size_t perspective_room(const PerspectiveSlices& of) noexcept;

/// Adds all slices to a tile of the intermediate image. Each pixel depends on nothing but its ray.
/// A ray that is inside between two slices only gets the sample of the nearest one.
/// Single-threaded, no allocation.
PerspectiveTile perspective_slices(const PerspectiveSlices& of, std::int64_t i, std::int64_t j,
                                   std::int64_t width, std::int64_t height, float* room);

}  // namespace edgewise::kernels
