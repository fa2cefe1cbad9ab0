#pragma once

// What ray casting means, in f64 and one sample at a time: shares no code with the kernel.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Samples with what a kernel may fetch behind them.
template <class T>
struct Volume {
    Extent extent;
    std::vector<T> samples;

    explicit Volume(const Extent& n) : extent(n), samples(n.samples() + kSlack) {}
    T& at(std::int64_t x, std::int64_t y, std::int64_t z) {
        return samples[(z * extent.y + y) * extent.x + x];
    }
    Grid grid(Type type, ValueMap values = {}) const {
        return {samples.data(), type, extent, 1, values};
    }
};

template <class T>
Volume<T> random_volume(const Extent& n, double low, double high, unsigned seed) {
    Volume<T> volume(n);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(low, high);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        volume.samples[i] = static_cast<T>(value(random));
    return volume;
}

using Vector = std::array<double, 3>;
inline Vector operator+(Vector a, const Vector& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vector operator*(double f, const Vector& a) { return {f * a[0], f * a[1], f * a[2]}; }

/// Rays along z turned by two angles about the middle of a volume, as many units as samples.
inline Rays turned(const Extent& n, double about_x, double about_y, double pixels) {
    const double cx = std::cos(about_x), sx = std::sin(about_x);
    const double cy = std::cos(about_y), sy = std::sin(about_y);
    const Vector right{cy, sy * sx, sy * cx}, down{0, cx, -sx}, away{-sy, cy * sx, cy * cx};
    const Vector middle{0.5 * (n.x - 1), 0.5 * (n.y - 1), 0.5 * (n.z - 1)};
    Rays rays;
    rays.origin.x = right;
    rays.origin.y = down;
    rays.direction.base = away;
    rays.origin.base = middle + (-0.5 * (pixels - 1)) * (right + down) + (-40.3) * away;
    return rays;
}

/// Rays from an eye before the volume, through pixels of a plane in its middle.
inline Rays from_eye(const Extent& n, double pixels, double distance) {
    const Rays parallel = turned(n, 0.3, -0.2, pixels);
    const Vector away = parallel.direction.base;
    const Vector middle{0.5 * (n.x - 1), 0.5 * (n.y - 1), 0.5 * (n.z - 1)};
    Rays rays;
    rays.start = 0;
    rays.origin.base = middle + (-distance) * away;
    rays.direction.x = parallel.origin.x;
    rays.direction.y = parallel.origin.y;
    rays.direction.base =
        distance * away + (-0.5 * (pixels - 1)) * (rays.direction.x + rays.direction.y);
    const double corner = -0.5 * (pixels - 1);
    rays.measure = {.base = {corner, corner, distance}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    return rays;
}

// ---- the reference: one ray, one sample after the other, in f64 ----

inline double stored(const Grid& g, std::int64_t x, std::int64_t y, std::int64_t z) {
    const std::int64_t i = (z * g.extent.y + y) * g.extent.x + x;
    switch (g.type) {
        case Type::u8:
            return g.as<std::uint8_t>()[i];
        case Type::i8:
            return g.as<std::int8_t>()[i];
        case Type::u16:
            return g.as<std::uint16_t>()[i];
        case Type::i16:
            return g.as<std::int16_t>()[i];
        case Type::i32:
            return g.as<std::int32_t>()[i];
        case Type::f64:
            return g.as<double>()[i];
        default:
            return g.as<float>()[i];
    }
}

inline std::int64_t mirrored(std::int64_t i, std::int64_t n) {
    if (n == 1) return 0;
    const std::int64_t period = 2 * (n - 1);
    i = ((i % period) + period) % period;
    return i < n ? i : period - i;
}

inline double weight(Hold hold, double distance) {
    const double a = std::abs(distance);
    if (hold == Hold::foh) return a < 1 ? 1 - a : 0;
    if (a < 1) return 2.0 / 3 - a * a + 0.5 * a * a * a;
    return a < 2 ? (2 - a) * (2 - a) * (2 - a) / 6 : 0;
}

inline double sampled(const Grid& g, Hold hold, Vector p) {
    for (int axis = 0; axis < 3; ++axis)
        p[axis] = std::clamp(p[axis], 0.0, static_cast<double>(g.extent[axis] - 1));
    if (hold == Hold::zoh)
        return stored(g, static_cast<std::int64_t>(std::floor(p[0] + 0.5)),
                      static_cast<std::int64_t>(std::floor(p[1] + 0.5)),
                      static_cast<std::int64_t>(std::floor(p[2] + 0.5)));
    std::array<std::array<double, 4>, 3> weights;
    std::array<std::array<std::int64_t, 4>, 3> indices;
    for (int axis = 0; axis < 3; ++axis)
        for (int k = 0; k < 4; ++k) {
            const auto i = static_cast<std::int64_t>(std::floor(p[axis])) - 1 + k;
            weights[axis][k] = weight(hold, p[axis] - static_cast<double>(i));
            indices[axis][k] = mirrored(i, g.extent[axis]);
        }
    double sum = 0, share = 0;
    for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < 4; ++i) {
                const double w = weights[0][i] * weights[1][j] * weights[2][k];
                if (w == 0) continue;
                const double value = stored(g, indices[0][i], indices[1][j], indices[2][k]);
                // Coefficients that are not finite spoil all around; samples leave the others.
                if (hold == Hold::foh && !std::isfinite(value)) continue;
                sum += w * value;
                share += w;
            }
    if (hold != Hold::foh || share > 1 - 1e-9) return sum;
    return std::isfinite(sampled(g, Hold::zoh, p)) ? sum / share : std::nan("");
}

struct Interval {
    double low = -kInfinity, high = kInfinity;
};

inline Interval chord(const RayCast& cast, const Vector& origin, const Vector& direction) {
    Interval in{cast.rays.start, kInfinity};
    for (int axis = 0; axis < 3; ++axis) {
        const double face = static_cast<double>(cast.volume.extent[axis]) - 0.5;
        const double from = (cast.kept ? cast.kept->low[axis] : -0.5) - origin[axis];
        const double to = (cast.kept ? cast.kept->high[axis] : face) - origin[axis];
        if (direction[axis] == 0) {
            if (from > 0 || to < 0) in.high = -kInfinity;
            continue;
        }
        in.low = std::max(in.low, std::min(from / direction[axis], to / direction[axis]));
        in.high = std::min(in.high, std::max(from / direction[axis], to / direction[axis]));
    }
    if (!cast.kept) return in;
    for (const Kept::Plane& plane : cast.kept->planes) {
        double at = plane.offset, slope = 0;
        for (int axis = 0; axis < 3; ++axis) {
            at += plane.normal[axis] * origin[axis];
            slope += plane.normal[axis] * direction[axis];
        }
        if (slope > 0) in.low = std::max(in.low, -at / slope);
        if (slope < 0) in.high = std::min(in.high, -at / slope);
        if (slope == 0 && at < 0) in.high = -kInfinity;
    }
    for (const Kept::Ball& ball : cast.kept->balls) {
        // The roots of |M (o + t d - centre)|^2 = 1.
        double a = 0, b = 0, c = -1;
        for (int row = 0; row < 3; ++row) {
            double at = 0, slope = 0;
            for (int axis = 0; axis < 3; ++axis) {
                at += ball.to_unit[3 * row + axis] * (origin[axis] - ball.centre[axis]);
                slope += ball.to_unit[3 * row + axis] * direction[axis];
            }
            a += slope * slope, b += at * slope, c += at * at;
        }
        const double root = b * b - a * c;
        if (root <= 0) return {1, 0};
        in.low = std::max(in.low, (-b - std::sqrt(root)) / a);
        in.high = std::min(in.high, (-b + std::sqrt(root)) / a);
    }
    return in;
}

inline std::array<double, 4> transfer(const std::vector<OpticsPoint>& points, double value) {
    const auto mixed = [](const OpticsPoint& a, const OpticsPoint& b, double f) {
        std::array<double, 4> v;
        for (int c = 0; c < 3; ++c) v[c] = a.color[c] + f * (b.color[c] - a.color[c]);
        v[3] = a.opacity + f * (b.opacity - a.opacity);
        return v;
    };
    if (value <= points.front().value) return mixed(points.front(), points.front(), 0);
    for (std::size_t i = 1; i < points.size(); ++i)
        if (value <= points[i].value)
            return mixed(points[i - 1], points[i],
                         (value - points[i - 1].value) / (points[i].value - points[i - 1].value));
    return mixed(points.back(), points.back(), 0);
}

/// What light makes of a sample: its colour's share and white, from the place and the way to the
/// eye (screen space).
using LitAt = std::function<std::array<double, 2>(const Vector& p, const Vector& to_eye)>;

inline std::array<double, 4> reference(const RayCast& cast, const std::vector<OpticsPoint>& points,
                                       double unit, double px, double py, const LitAt& lit = {}) {
    const Vector measure = cast.rays.measure.at(px, py);
    const Vector origin = cast.rays.origin.at(px, py);
    const double norm =
        std::sqrt(measure[0] * measure[0] + measure[1] * measure[1] + measure[2] * measure[2]);
    const Vector direction = 1 / norm * cast.rays.direction.at(px, py);
    const Interval in = chord(cast, origin, direction);
    double largest = -kInfinity, sum = 0, length = 0, left = 1;
    std::array<double, 4> light{};
    if (in.low < in.high)
        for (double k = std::floor(in.low / cast.step); k * cast.step < in.high; ++k) {
            const double from = std::max(in.low, k * cast.step);
            const double to = std::min(in.high, (k + 1) * cast.step);
            if (!(from < to)) continue;
            const double value = cast.volume.values(
                sampled(cast.volume, cast.hold, origin + 0.5 * (from + to) * direction));
            if (!std::isfinite(value)) continue;
            largest = std::max(largest, value);
            sum += (to - from) * value;
            length += to - from;
            if (points.empty()) continue;
            const auto at = transfer(points, value);
            const double opacity = 1 - std::pow(1 - at[3], (to - from) / unit);
            std::array<double, 2> shares{1, 0};
            if (lit && at[3] > 0)
                shares = lit(origin + 0.5 * (from + to) * direction, -1 / norm * measure);
            for (int c = 0; c < 3; ++c)
                light[c] += left * opacity * (shares[0] * at[c] + shares[1]);
            left *= 1 - opacity;
        }
    switch (cast.rule) {
        case Combine::max:
            return {length > 0 ? largest : cast.miss};
        case Combine::sum:
            return {(sum - cast.zero * length) * cast.unit};
        case Combine::mean:
            return {length > 0 ? sum / length : cast.miss};
        case Combine::over:
        case Combine::hit:
        case Combine::other:  // of a mode: tests/graph/modes_test.cpp
            break;
    }
    light[3] = 1 - left;
    return light;
}

}  // namespace edgewise::kernels
