#include <algorithm>
#include <cmath>

#include "reference/preview_holds.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reference/preview_holds_simd.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway demands.
#include <hwy/highway.h>

// Most are plain loops over places, which compilers turn into vectors of each target.

HWY_BEFORE_NAMESPACE();
namespace edgewise {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Indices = std::array<std::int32_t, Places::kMost>;
using Numbers = std::array<float, Places::kMost>;

HWY_INLINE double clamped(double p, double last) {
    p = p < 0 ? 0 : p;
    return p > last ? last : p;
}

/// The samples below places, and the places' fractions, in [0, 1).
struct Cells {
    Indices offset;  // from the box's first number
    std::array<Numbers, 3> f;
};

HWY_INLINE void find_cells(const HeldBox<float>& box, const Places& places, Cells& cells) {
    std::fill_n(cells.offset.begin(), places.count, 0);
    for (int axis = 0; axis < 3; ++axis) {
        const double last = box.last[axis];
        const auto begin = static_cast<std::int32_t>(box.begin[axis]);
        const auto stride = static_cast<std::int32_t>(box.stride[axis]);
        for (std::size_t i = 0; i < places.count; ++i) {
            const double q = clamped(places.at[axis][i], last);
            const auto cell = static_cast<std::int32_t>(q);  // the floor: not negative
            cells.f[axis][i] = static_cast<float>(q - static_cast<double>(cell));
            cells.offset[i] += (cell - begin) * stride;
        }
    }
}

void NearestAt(const HeldBox<float>& box, const Places& places, double* values) {
    Indices offset;
    std::fill_n(offset.begin(), places.count, 0);
    for (int axis = 0; axis < 3; ++axis) {
        const double last = box.last[axis];
        const auto begin = static_cast<std::int32_t>(box.begin[axis]);
        const auto end = static_cast<std::int32_t>(box.size[axis] - 1);
        const auto stride = static_cast<std::int32_t>(box.stride[axis]);
        for (std::size_t i = 0; i < places.count; ++i) {
            const double q = clamped(places.at[axis][i], last);
            auto at = static_cast<std::int32_t>(q + 0.5) - begin;
            at = at < 0 ? 0 : at;
            offset[i] += (at > end ? end : at) * stride;
        }
    }
    for (std::size_t i = 0; i < places.count; ++i)
        values[i] = static_cast<double>(box.first[offset[i]]);
}

/// Interpolation beside samples that are not finite: absent where the nearest one is not finite,
/// else the finite ones with weights that add up to 1.
float linear_near_gap(const float* near, const std::array<std::int32_t, 3>& stride,
                      const std::array<float, 3>& f) {
    const float* nearest = near;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (f[axis] >= 0.5F) nearest += stride[axis];
    if (!std::isfinite(*nearest)) return *nearest;
    float sum = 0, share = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        float weight = 1;
        const float* at = near;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const bool is_upper = corner >> axis & 1;
            weight *= is_upper ? f[axis] : 1 - f[axis];
            // On a sample the next one weighs nothing and may lie beyond the box.
            if (is_upper && f[axis] > 0) at += stride[axis];
        }
        if (!std::isfinite(*at)) continue;
        sum += weight * *at;
        share += weight;
    }
    return sum / share;
}

void LinearAt(const HeldBox<float>& box, const Places& places, double* values) {
    Cells cells;
    find_cells(box, places, cells);
    std::array<std::int32_t, 3> stride;
    for (int axis = 0; axis < 3; ++axis) stride[axis] = static_cast<std::int32_t>(box.stride[axis]);
    for (std::size_t i = 0; i < places.count; ++i) {
        const float fx = cells.f[0][i], fy = cells.f[1][i], fz = cells.f[2][i];
        // On a sample the next one weighs nothing and may lie beyond the box.
        const float* near = box.first + cells.offset[i];
        const float* below = near + (fy > 0 ? stride[1] : 0);
        const std::int32_t right = fx > 0 ? stride[0] : 0, behind = fz > 0 ? stride[2] : 0;
        const auto along = [fx, right](const float* at) {
            return at[0] + fx * (at[right] - at[0]);
        };
        const float a = along(near), b = along(below);
        const float c = along(near + behind), d = along(below + behind);
        const float front = a + fy * (b - a), back = c + fy * (d - c);
        float value = front + fz * (back - front);
        if (!std::isfinite(value)) value = linear_near_gap(near, stride, {fx, fy, fz});
        values[i] = static_cast<double>(value);
    }
}

/// Weights of the four taps along one axis.
HWY_INLINE void weigh(const Numbers& beyond, std::size_t count, bool constant,
                      std::array<Numbers, 4>& weight) {
    if (constant) {
        weight = {};
        weight[0].fill(1);
        return;
    }
    const float sixth = static_cast<float>(1.0 / 6);
    for (std::size_t i = 0; i < count; ++i) {
        const float f = beyond[i], g = 1 - f;
        weight[0][i] = sixth * g * g * g;
        weight[1][i] = sixth * (4 - f * f * (6 - 3 * f));
        weight[2][i] = sixth * (4 - g * g * (6 - 3 * g));
        weight[3][i] = sixth * f * f * f;
    }
}

void CubicAt(const HeldBox<float>& box, const Places& places, double* values) {
    const std::size_t count = places.count;
    Cells cells;
    find_cells(box, places, cells);
    std::array<std::array<Numbers, 4>, 3> weight;
    for (int axis = 0; axis < 3; ++axis)
        weigh(cells.f[axis], count, box.stride[axis] == 0, weight[axis]);
    std::array<Numbers, 16> across;  // by k and j
    for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t j = 0; j < 4; ++j)
            for (std::size_t i = 0; i < count; ++i)
                across[4 * k + j][i] = weight[2][k][i] * weight[1][j][i];
    const std::int64_t row = box.stride[1], plane = box.stride[2];
    std::array<float, 4 * Places::kMost> columns;
    const hn::CappedTag<float, 4> four;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t x = 0; x < 4; x += hn::Lanes(four)) {
            const float* corner = box.first + cells.offset[i] + x;
            auto sum = hn::Zero(four);
            for (std::size_t tap = 0; tap < 16; ++tap) {
                const float* line = corner + static_cast<std::int64_t>(tap / 4) * plane +
                                    static_cast<std::int64_t>(tap % 4) * row;
                sum = hn::Add(sum, hn::Mul(hn::Set(four, across[tap][i]), hn::LoadU(four, line)));
            }
            hn::StoreU(sum, four, columns.data() + 4 * i + x);
        }
    for (std::size_t i = 0; i < count; ++i) {
        const float* sum = columns.data() + 4 * i;
        values[i] = static_cast<double>(weight[0][0][i] * sum[0] + weight[0][1][i] * sum[1] +
                                        weight[0][2][i] * sum[2] + weight[0][3][i] * sum[3]);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace edgewise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise {

HWY_EXPORT(NearestAt);
HWY_EXPORT(LinearAt);
HWY_EXPORT(CubicAt);

void nearest_at(const HeldBox<float>& box, const Places& places, double* values) {
    HWY_DYNAMIC_DISPATCH(NearestAt)(box, places, values);
}

void linear_at(const HeldBox<float>& box, const Places& places, double* values) {
    HWY_DYNAMIC_DISPATCH(LinearAt)(box, places, values);
}

void cubic_at(const HeldBox<float>& box, const Places& places, double* values) {
    HWY_DYNAMIC_DISPATCH(CubicAt)(box, places, values);
}

}  // namespace edgewise
#endif
