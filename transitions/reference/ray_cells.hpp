#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "transitions/reference/preview_holds.hpp"
#include "transitions/reference/view_geometry.hpp"

namespace edgewise {

/// Where the first cell of cast rays begins: in front of the first layer of the screen, or in the
/// eye, as in project.ray_cast.
inline double front_of(const Request& want) { return want.eye ? 0 : -0.5; }

/// Some cells of a ray, one after another.
struct RayCells {
    std::size_t count = 0;
    std::array<std::int64_t, Places::kMost> index;
    std::array<double, Places::kMost> middle, length;  // [t]

    /// The next cells of one step whose middles lie before `end`; none: count 0. Of a ray that is
    /// longer, pieces of cells so short that rounding decides about them are left out.
    void take(double end, double front, double step, const RaySpan& ray, std::int64_t& next) {
        constexpr double kSliver = 1e-9;  // [cell]
        const double least = ray.high - ray.low > 2 * kSliver * step ? kSliver * step : 0;
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
