#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "reference/preview_holds.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// Where the first cell of cast rays begins: in front of the first layer of the screen, or in the
/// eye, as in project.ray_cast.
inline double front_of(const Request& want) { return want.eye ? 0 : -0.5; }

/// A piece of a cell that is shorter is none, where its ray is longer: rounding decides whether
/// there is one, and a mode that is made of samples would take one of it [cell].
inline constexpr double kSliver = 1e-9;

/// What counts as a piece of a ray's cells.
inline double least_piece(const RaySpan& ray, double step) {
    return ray.high - ray.low > 2 * kSliver * step ? kSliver * step : 0;
}

/// Some cells of a ray, one after another.
struct RayCells {
    std::size_t count = 0;
    std::array<std::int64_t, Places::kMost> index;
    std::array<double, Places::kMost> middle, length;  // [t]

    /// The next cells of one step whose middles lie before `end`; none: count 0.
    void take(double end, double front, double step, const RaySpan& ray, std::int64_t& next) {
        const double least = least_piece(ray, step);
        for (count = 0; count < Places::kMost; ++next) {
            const double begin = front + static_cast<double>(next) * step;
            const double low = std::max(ray.low, begin), high = std::min(ray.high, begin + step);
            const double at = 0.5 * (low + high);
            if (at >= end || begin >= ray.high) return;
            if (!(high - low > least)) continue;
            index[count] = next;
            middle[count] = at;
            length[count++] = high - low;
        }
    }
};

}  // namespace edgewise
