#include "transitions/radon/walk.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// The largest integer that is not above u, for u >= -8.
std::int64_t floor_of(double u) noexcept {
    constexpr std::int64_t kShift = 8;
    return static_cast<std::int64_t>(u + static_cast<double>(kShift)) - kShift;
}

/// Weights of a cell's corners in the integral of bilinear interpolation along a straight piece
/// from (u0, v0) to (u1, v1), over its height v1 - v0.
struct CellWeights {
    double u, v, both;  // means of u, v and u v along the piece
    double high;

    CellWeights(double u0, double v0, double u1, double v1) noexcept
        : u((u0 + u1) / 2),
          v((v0 + v1) / 2),
          both(u * v + (u1 - u0) * (v1 - v0) / 12),
          high(v1 - v0) {}
};

}  // namespace

LineWalk::LineWalk(const RadonLines& lines, const RadonPlane& plane, int k) noexcept
    : samples_(plane.samples()), finite_(plane.finite()) {
    const auto [a, b] = lines.slopes(k);
    const bool by_rows = std::abs(a) >= std::abs(b);
    const double across = by_rows ? a : b, along = by_rows ? b : a;
    const std::int64_t nx = lines.input.x, ny = lines.input.y;
    strips_ = by_rows ? ny : nx;
    cells_ = by_rows ? nx : ny;
    strip_step_ = by_rows ? plane.row_step() : 1;
    cell_step_ = by_rows ? 1 : plane.row_step();
    slope_ = -along / across;
    apart_ = 1 / across;
    const double strip_centre = 0.5 * static_cast<double>(strips_ - 1);
    const double cell_centre = 0.5 * static_cast<double>(cells_ - 1);
    zero_ = cell_centre - static_cast<double>(lines.middle()) * apart_ - strip_centre * slope_;
    weight_ = lines.spacing[0] * lines.spacing[1] / (lines.step * std::abs(across));
}

template <bool kFinite>
double LineWalk::summed(double first) const noexcept {
    // Strips in which the line is inside -1 < u < cells.
    double from = -1, to = static_cast<double>(strips_);
    const double end = static_cast<double>(cells_);
    if (slope_ != 0) {
        const double p = (-1 - first) / slope_, q = (end - first) / slope_;
        from = std::max(from, std::min(p, q));
        to = std::min(to, std::max(p, q));
    } else if (!(first > -1 && first < end)) {
        return 0;
    }
    if (!(from < to)) return 0;
    const std::int64_t begin = static_cast<std::int64_t>(std::floor(from));
    const std::int64_t stop = static_cast<std::int64_t>(std::ceil(to));

    double sum = 0;
    const auto add = [&](std::int64_t cell, const float* strip, const CellWeights& w) {
        if (cell < -1 || cell >= cells_) return;
        const float* at = strip + cell * cell_step_;
        const double s00 = at[0], s10 = at[cell_step_], s01 = at[strip_step_],
                     s11 = at[strip_step_ + cell_step_];
        const double w00 = 1 - w.u - w.v + w.both, w10 = w.u - w.both, w01 = w.v - w.both;
        if constexpr (kFinite) {
            sum += w.high * (w00 * s00 + w10 * s10 + w01 * s01 + w.both * s11);
        } else {
            if (w.high <= kTouched) return;
            const double values[] = {s00, s10, s01, s11}, weights[] = {w00, w10, w01, w.both};
            for (int i = 0; i < 4; ++i)
                if (weights[i] > kTouched) sum += w.high * weights[i] * values[i];
        }
    };
    for (std::int64_t strip = begin; strip < stop; ++strip) {
        const float* samples = samples_ + strip * strip_step_;
        const double u0 = first + slope_ * static_cast<double>(strip), u1 = u0 + slope_;
        // Rounding may put u1 a little beyond the next cell.
        const std::int64_t c0 = std::clamp<std::int64_t>(floor_of(u0), -2, cells_);
        const std::int64_t c1 = std::clamp(floor_of(u1), c0 - 1, c0 + 1);
        const auto left = static_cast<double>(c0);
        if (c1 == c0) {
            add(c0, samples, {u0 - left, 0, u1 - left, 1});
            continue;
        }
        const double edge = c1 > c0 ? 1 : 0;
        const double crossed = std::clamp((left + edge - u0) / slope_, 0.0, 1.0);
        add(c0, samples, {u0 - left, 0, edge, crossed});
        add(c1, samples, {1 - edge, crossed, u1 - static_cast<double>(c1), 1});
    }
    return weight_ * sum;
}

double LineWalk::along(std::int64_t m) const noexcept {
    const double first = zero_ + static_cast<double>(m) * apart_;
    return finite_ ? summed<true>(first) : summed<false>(first);
}

}  // namespace edgewise
