#pragma once

#include <algorithm>
#include <limits>

#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// Stored numbers from low to high; none: low > high.
struct StoredSpan {
    float low = std::numeric_limits<float>::infinity(),
          high = -std::numeric_limits<float>::infinity();

    bool empty() const noexcept { return low > high; }
    bool operator==(const StoredSpan&) const = default;
};

/// The largest opacity that a value between two stored numbers has.
inline float largest_opacity(const Optics& optics, const StoredSpan& span) noexcept {
    if (span.empty()) return 0;  // nothing finite
    const auto at = [&](float value) {
        float opacity = optics.opacity;
        for (const OpticsRamp& ramp : optics.ramps)
            opacity +=
                ramp.opacity * std::clamp((value - ramp.start) * ramp.inverse_width, 0.0f, 1.0f);
        return opacity;
    };
    float largest = std::max(at(span.low), at(span.high));
    for (const OpticsRamp& ramp : optics.ramps) {
        const float end = ramp.start + 1 / ramp.inverse_width;
        for (const float knot : {ramp.start, end})
            if (knot > span.low && knot < span.high) largest = std::max(largest, at(knot));
    }
    // Interpolated samples round: what is transparent by less than that is not skipped.
    return largest > 0 ? largest : 0;
}

}  // namespace edgewise::kernels
