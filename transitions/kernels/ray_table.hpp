#pragma once

#include <array>

#include "graph/samples.hpp"
#include "graph/small_objects.hpp"
#include "graph/transfer_table.hpp"

namespace edgewise::kernels {

/// A TransferTable in f32, of stored numbers.
struct RayTable {
    /// Ascending places, at least two. `knots` has 2 x `first_step`, of which the last are
    /// infinite: so a place is found by steps of halved lengths, as many for every lane.
    struct Axis {
        SmallVector<float> knots;
        int count = 0;
        int first_step = 1;

        float low() const noexcept { return knots.front(); }
        float high() const noexcept { return knots[static_cast<std::size_t>(count) - 1]; }
    };
    Axis values, gradients;
    SmallVector<float> cells;  // red, green, blue, opacity: of each value, gradient by gradient
    SmallVector<float> most;   // of each value, the largest opacity over all gradients
    std::array<float, 3> per_length{1, 1, 1};  // of a gradient of stored numbers by input index

    /// The largest opacity that numbers from `low` to `high` have, whatever their gradients; 0 only
    /// where the kernels find 0 for all of them.
    float largest(float low, float high) const noexcept;
    double bytes() const noexcept;
};

/// @param table       with colours
/// @param per_length  samples in a file unit, along each axis
RayTable ray_table_of(const TransferTable& table, const Vec3& per_length, const ValueMap& values);

/// Bytes of the same, without making it.
double bytes_of_ray_table(const TransferTable& table) noexcept;

}  // namespace edgewise::kernels
