#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "graph/representation.hpp"

namespace edgewise {

/// A batch of places in the input [input index], by axis.
struct Places {
    static constexpr std::size_t kMost = 128;

    std::size_t count = 0;
    std::array<std::array<double, kMost>, 3> at;

    void add(const Vec3& p) noexcept {
        for (std::size_t axis = 0; axis < 3; ++axis)
            at[axis][count] = p[static_cast<Eigen::Index>(axis)];
        ++count;
    }
    Vec3 operator[](std::size_t i) const noexcept { return {at[0][i], at[1][i], at[2][i]}; }
};

/// A box of numbers around the places of a batch.
template <class Real>
struct HeldBox {
    const Real* first = nullptr;  // the sample at `begin`; of a cubic the tap before it
    std::array<std::int64_t, 3> begin{}, size{}, stride{};  // [sample], [sample], [number]
    std::array<double, 3> last{};  // of the input; places are clamped to 0 ... last
};

// Interpolated values at places in f32. No value depends on the other places of the batch.

void nearest_at(const HeldBox<float>& box, const Places& places, double* values);
void linear_at(const HeldBox<float>& box, const Places& places, double* values);
/// Cubic B-spline of coefficients; stride 0 along axes without neighbours.
void cubic_at(const HeldBox<float>& box, const Places& places, double* values);

}  // namespace edgewise
