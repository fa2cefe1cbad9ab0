#include "transitions/reference/spline_block.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

constexpr int kLead = 1, kTrail = 2;  // taps of a cubic before and behind its cell

/// The causal filter's start on a line of n samples that is mirrored at its ends, `step` apart.
template <class Real>
double mirrored_start(const Real* line, std::int64_t n, std::int64_t step) {
    const int horizon = sizeof(Real) == 8 ? 30 : 16;  // |pole|^30 = 7e-18, |pole|^16 = 7e-10
    double power = kSplinePole, sum = line[0];
    if (n > horizon) {
        for (int k = 1; k < horizon; ++k, power *= kSplinePole) sum += power * line[k * step];
        return sum;
    }
    const double last = std::pow(kSplinePole, static_cast<double>(n - 1));
    double back = last * last / kSplinePole;  // pole^(2n - 2 - k) at k = 1
    sum += last * line[(n - 1) * step];
    for (std::int64_t k = 1; k < n - 1; ++k) {
        sum += (power + back) * line[k * step];
        power *= kSplinePole;
        back /= kSplinePole;
    }
    return sum / (1 - last * last);
}

/// Prefilters lines that lie side by side, in vectors. The gain is not applied.
template <class Real>
void prefilter_columns(Real* first, std::int64_t n, std::int64_t step, std::int64_t columns) {
    if (n == 1) return;
    const Real pole = static_cast<Real>(kSplinePole);
    const Real end = static_cast<Real>(kSplinePole / (kSplinePole * kSplinePole - 1));
    for (std::int64_t x = 0; x < columns; ++x)
        first[x] = static_cast<Real>(mirrored_start(first + x, n, step));
    for (std::int64_t i = 1; i < n; ++i) {
        Real* here = first + i * step;
        for (std::int64_t x = 0; x < columns; ++x) here[x] += pole * here[x - step];
    }
    Real* last = first + (n - 1) * step;
    for (std::int64_t x = 0; x < columns; ++x) last[x] = end * (last[x] + pole * last[x - step]);
    for (std::int64_t i = n - 2; i >= 0; --i) {
        Real* here = first + i * step;
        for (std::int64_t x = 0; x < columns; ++x) here[x] = pole * (here[x + step] - here[x]);
    }
}

/// Prefilters kRows lines of adjacent samples at once: each hides the others' latency.
template <int kRows, class Real>
void prefilter_rows(Real* first, std::int64_t n, std::int64_t row) {
    if (n == 1) return;
    const Real pole = static_cast<Real>(kSplinePole);
    const Real end = static_cast<Real>(kSplinePole / (kSplinePole * kSplinePole - 1));
    std::array<Real, kRows> carry;
    for (int r = 0; r < kRows; ++r)
        carry[r] = first[r * row] = static_cast<Real>(mirrored_start(first + r * row, n, 1));
    for (std::int64_t i = 1; i < n; ++i)
        for (int r = 0; r < kRows; ++r) {
            carry[r] = first[r * row + i] + pole * carry[r];
            first[r * row + i] = carry[r];
        }
    for (int r = 0; r < kRows; ++r) {
        Real* last = first + r * row + n - 1;
        carry[r] = *last = end * (*last + pole * last[-1]);
    }
    for (std::int64_t i = n - 2; i >= 0; --i)
        for (int r = 0; r < kRows; ++r) {
            carry[r] = pole * (carry[r] - first[r * row + i]);
            first[r * row + i] = carry[r];
        }
}

/// What every axis of more than one sample multiplies by.
constexpr double kGain = (1 - kSplinePole) * (1 - 1 / kSplinePole);

}  // namespace

std::int64_t mirrored_index(std::int64_t index, std::int64_t n) noexcept {
    if (n == 1) return 0;
    const std::int64_t period = 2 * (n - 1);
    index = ((index % period) + period) % period;
    return std::min(index, period - index);
}

template <class Real>
SplineBlock<Real>::SplineBlock(const Data& data, const Region& cells, int margin,
                               std::pmr::memory_resource* memory)
    : channels_(data.what.channels) {
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t n = data.what.extent[axis];
        // The taps reach one sample before a cell and two behind it; the margin lies outside these.
        held_.begin[axis] = std::max<std::int64_t>(0, cells.begin[axis] - kLead - margin);
        held_.end[axis] = std::min<std::int64_t>(n, cells.end[axis] + kTrail + margin);
        const bool padded = axis == 0 || n > 1;  // always along x, where four taps are one load
        pad_[axis] = padded ? kLead : 0;
        padded_[axis] = held_.extent()[axis] + (padded ? kLead + kTrail : 0);
    }
    coefficients_ =
        Array(static_cast<std::size_t>(padded_.samples() * channels_) * sizeof(Real), memory);
    first_ = static_cast<Real*>(coefficients_.data());
    load(data);
    prefilter();
    mirror_pads();
}

template <class Real>
void SplineBlock<Real>::load(const Data& data) {
    const Extent& n = data.what.extent;
    const Extent held = held_.extent();
    double gain = 1;
    for (int axis = 0; axis < 3; ++axis) gain *= held[axis] > 1 ? kGain : 1;
    const Real slope = static_cast<Real>(gain * data.what.values.slope);
    const Real offset = static_cast<Real>(gain * data.what.values.offset);
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* samples = data.as<decltype(zero)>();
        for (int c = 0; c < channels_; ++c)
            for (std::int64_t z = 0; z < held.z; ++z)
                for (std::int64_t y = 0; y < held.y; ++y) {
                    const auto* from =
                        samples + c +
                        channels_ * (held_.begin[0] +
                                     n.x * (held_.begin[1] + y + n.y * (held_.begin[2] + z)));
                    Real* to =
                        first_ + pad_[0] +
                        padded_.x * (pad_[1] + y + padded_.y * (pad_[2] + z + padded_.z * c));
                    for (std::int64_t x = 0; x < held.x; ++x)
                        to[x] = slope * static_cast<Real>(from[x * channels_]) + offset;
                    if constexpr (std::is_integral_v<decltype(zero)>) continue;
                    Real last = 0;
                    for (std::int64_t x = 0; x < held.x; ++x)
                        if (std::isfinite(to[x]))
                            last = to[x];
                        else
                            to[x] = last;
                }
    });
}

template <class Real>
void SplineBlock<Real>::prefilter() {
    const Extent held = held_.extent();
    const std::int64_t row = padded_.x, plane = padded_.x * padded_.y;
    constexpr int kTogether = 8;
    for (int c = 0; c < channels_; ++c) {
        Real* origin = first_ + pad_[0] + pad_[1] * row + (pad_[2] + padded_.z * c) * plane;
        for (std::int64_t z = 0; z < held.z; ++z) {
            Real* slice = origin + z * plane;
            std::int64_t y = 0;
            for (; y + kTogether <= held.y; y += kTogether)
                prefilter_rows<kTogether>(slice + y * row, held.x, row);
            for (; y < held.y; ++y) prefilter_rows<1>(slice + y * row, held.x, row);
            prefilter_columns(slice, held.y, row, held.x);
        }
        for (std::int64_t y = 0; y < held.y; ++y)
            prefilter_columns(origin + y * row, held.z, plane, held.x);
    }
}

/// Copies mirrored coefficients into the pads. At a cut nobody reads them.
template <class Real>
void SplineBlock<Real>::mirror_pads() {
    const Extent held = held_.extent();
    const std::int64_t row = padded_.x, plane = padded_.x * padded_.y;
    const auto source = [&](int axis, std::int64_t i) {
        return pad_[axis] + mirrored_index(i - pad_[axis], held[axis]);
    };
    const auto is_pad = [&](int axis, std::int64_t i) {
        return i < pad_[axis] || i >= pad_[axis] + held[axis];
    };
    for (int c = 0; c < channels_; ++c) {
        Real* origin = first_ + padded_.z * plane * c;
        for (std::int64_t z = pad_[2]; z < pad_[2] + held.z; ++z) {
            for (std::int64_t y = pad_[1]; y < pad_[1] + held.y; ++y) {
                Real* line = origin + z * plane + y * row;
                for (std::int64_t x = 0; x < padded_.x; ++x)
                    if (is_pad(0, x)) line[x] = line[source(0, x)];
            }
            for (std::int64_t y = 0; y < padded_.y; ++y)
                if (is_pad(1, y))
                    std::copy_n(origin + z * plane + source(1, y) * row, row,
                                origin + z * plane + y * row);
        }
        for (std::int64_t z = 0; z < padded_.z; ++z)
            if (is_pad(2, z)) std::copy_n(origin + source(2, z) * plane, plane, origin + z * plane);
    }
}

template <class Real>
void SplineBlock<Real>::at(const Vec3& p, double* values) const noexcept {
    std::array<std::array<Real, 4>, 3> weight;
    std::array<std::int64_t, 3> start;
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(p[axis]);  // floor, as p is not negative
        const Real f = static_cast<Real>(p[axis] - static_cast<double>(cell)), g = 1 - f;
        const Real sixth = static_cast<Real>(1.0 / 6);
        start[axis] = cell - held_.begin[axis];  // the tap before the cell, as kLead == pad_
        weight[axis] = {sixth * g * g * g, sixth * (4 - f * f * (6 - 3 * f)),
                        sixth * (4 - g * g * (6 - 3 * g)), sixth * f * f * f};
        if (!pad_[axis]) weight[axis] = {1, 0, 0, 0};
    }
    const int rows = pad_[1] ? 4 : 1, planes = pad_[2] ? 4 : 1;
    for (int c = 0; c < channels_; ++c) {
        const Real* corner =
            first_ + start[0] + padded_.x * (start[1] + padded_.y * (start[2] + padded_.z * c));
        std::array<Real, 4> columns{};
        for (int k = 0; k < planes; ++k, corner += padded_.x * padded_.y)
            for (int j = 0; j < rows; ++j) {
                const Real w = weight[2][k] * weight[1][j];
                const Real* line = corner + padded_.x * j;
                for (int i = 0; i < 4; ++i) columns[i] += w * line[i];
            }
        Real value = 0;
        for (int i = 0; i < 4; ++i) value += weight[0][i] * columns[i];
        values[c] = value;
    }
}

template <class Real>
double SplineBlock<Real>::bytes(const Extent& cells, const Extent& n, int margin,
                                int channels) noexcept {
    constexpr std::int64_t kPads = kLead + kTrail;
    double samples = channels;
    for (int axis = 0; axis < 3; ++axis)
        samples *= static_cast<double>(std::min(cells[axis] + kPads + 2 * margin, n[axis]) +
                                       (axis == 0 || n[axis] > 1 ? kPads : 0));
    return samples * sizeof(Real);
}

template class SplineBlock<float>;
template class SplineBlock<double>;

}  // namespace edgewise
