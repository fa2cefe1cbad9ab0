#pragma once

#include <cmath>

#include "graph/transform.hpp"

namespace edgewise {

/// The neighbours that Sobel's operator reads, and what each adds to the gradient.
struct SobelTap {
    Vec3 offset;  // [sample], each -1, 0 or 1
    Vec3 weight;  // by component
};

/// Calls each(tap) for the 26 of them.
template <class Each>
void for_sobel_taps(Each&& each) {
    for (int place = 0; place < 27; ++place) {
        const Vec3 offset(place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1);
        if (offset == Vec3::Zero()) continue;
        const Vec3 smooth = Vec3::Constant(2) - offset.cwiseAbs();  // 1 2 1
        each(SobelTap{offset,
                      Vec3(offset[0] * smooth[1] * smooth[2], offset[1] * smooth[2] * smooth[0],
                           offset[2] * smooth[0] * smooth[1]) /
                          32});
    }
}

/// Sobel's operator on a field around a place (GradientScheme::sobel) [value / sample]. Neighbours
/// that are not finite are taken for the place itself.
/// @param value  of the field at a place
template <class Value>
Vec3 sobel_gradient(const Vec3& p, double here, Value&& value) {
    Vec3 gradient = Vec3::Zero();
    for_sobel_taps([&](const SobelTap& tap) {
        const double there = value(Vec3(p + tap.offset));
        gradient += (std::isfinite(there) ? there : here) * tap.weight;
    });
    return gradient;
}

}  // namespace edgewise
