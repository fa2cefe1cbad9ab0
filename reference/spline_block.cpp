#include "reference/spline_block.hpp"

#include <algorithm>
#include <cmath>

#include "reference/spline_lines.hpp"

namespace edgewise {
namespace {

constexpr int kLead = 1, kTrail = 2;  // taps of a cubic before and behind its cell

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
                               std::pmr::memory_resource* memory, bool finite)
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
    allocate(memory);
    load(data, finite, memory);
    finish(data.what.extent);
    if (shares_) shares_->finish(data.what.extent);
}

template <class Real>
SplineBlock<Real>::SplineBlock(const SplineBlock& like, Shape, std::pmr::memory_resource* memory)
    : held_(like.held_), padded_(like.padded_), pad_(like.pad_), channels_(like.channels_) {
    allocate(memory);
}

template <class Real>
void SplineBlock<Real>::allocate(std::pmr::memory_resource* memory) {
    coefficients_ =
        Array(static_cast<std::size_t>(padded_.samples() * channels_) * sizeof(Real), memory);
    first_ = static_cast<Real*>(coefficients_.data());
}

template <class Real>
void SplineBlock<Real>::finish(const Extent& n) {
    for (int c = 0; c < channels_; ++c) prefilter(box_of(c));
    mirror_pads(n);
}

/// @param whole  share of a value that is finite, times the gain of the prefilter
template <class Real>
void SplineBlock<Real>::pass_over(const Box<Real>& to, const Box<Real>& shares, Real whole) {
    for (std::int64_t z = 0; z < to.n.z; ++z)
        for (std::int64_t y = 0; y < to.n.y; ++y) {
            Real* row = to.first + z * to.plane + y * to.row;
            Real* share = shares.first + z * shares.plane + y * shares.row;
            for (std::int64_t x = 0; x < to.n.x; ++x) {
                share[x] = std::isfinite(row[x]) ? whole : 0;
                if (share[x] == 0) row[x] = 0;
            }
        }
}

template <class Real>
void SplineBlock<Real>::load(const Data& data, bool finite, std::pmr::memory_resource* memory) {
    const bool checked = finite || is_integer(data.what.type);
    finite = true;
    const Extent held = held_.extent();
    double gain = 1;
    for (int axis = 0; axis < 3; ++axis) gain *= held[axis] > 1 ? kGain : 1;
    const Real slope = static_cast<Real>(gain * data.what.values.slope);
    const Real offset = static_cast<Real>(gain * data.what.values.offset);
    for (int c = 0; c < channels_; ++c) {
        const Box<Real> to = box_of(c);
        map_box(stored_box(data, held_.begin, c, channels_), slope, offset, to);
        finite = finite && (checked || all_finite(to));
    }
    if (finite) return;
    shares_.reset(new SplineBlock(*this, Shape{}, memory));
    for (int c = 0; c < channels_; ++c)
        pass_over(box_of(c), shares_->box_of(c), static_cast<Real>(gain));
}

template <class Real>
Box<Real> SplineBlock<Real>::box_of(int channel) const {
    const std::int64_t row = padded_.x, plane = padded_.x * padded_.y;
    return {first_ + pad_[0] + pad_[1] * row + (pad_[2] + padded_.z * channel) * plane,
            held_.extent(), row, plane};
}

/// Copies mirrored coefficients into the pads at faces of the data. At a cut nobody reads them.
template <class Real>
void SplineBlock<Real>::mirror_pads(const Extent& n) {
    const Extent held = held_.extent();
    const std::int64_t row = padded_.x, plane = padded_.x * padded_.y;
    const auto each_pad = [&](int axis, auto&& copy) {
        const std::int64_t end = pad_[axis] + held[axis];
        const auto mirror = [&](std::int64_t i) {
            copy(i, pad_[axis] + mirrored_index(i - pad_[axis], held[axis]));
        };
        if (held_.begin[axis] == 0)
            for (std::int64_t i = 0; i < pad_[axis]; ++i) mirror(i);
        if (held_.end[axis] == n[axis])
            for (std::int64_t i = end; i < padded_[axis]; ++i) mirror(i);
    };
    for (int c = 0; c < channels_; ++c) {
        Real* origin = first_ + padded_.z * plane * c;
        for (std::int64_t z = pad_[2]; z < pad_[2] + held.z; ++z) {
            Real* slice = origin + z * plane;
            each_pad(0, [&](std::int64_t x, std::int64_t from) {
                for (std::int64_t y = pad_[1]; y < pad_[1] + held.y; ++y)
                    slice[y * row + x] = slice[y * row + from];
            });
            each_pad(1, [&](std::int64_t y, std::int64_t from) {
                std::copy_n(slice + from * row, row, slice + y * row);
            });
        }
        each_pad(2, [&](std::int64_t z, std::int64_t from) {
            std::copy_n(origin + from * plane, plane, origin + z * plane);
        });
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
    const auto sum_at = [&](const Real* first, int c) {
        const Real* corner =
            first + start[0] + padded_.x * (start[1] + padded_.y * (start[2] + padded_.z * c));
        std::array<Real, 4> columns{};
        for (int k = 0; k < planes; ++k, corner += padded_.x * padded_.y)
            for (int j = 0; j < rows; ++j) {
                const Real w = weight[2][k] * weight[1][j];
                const Real* line = corner + padded_.x * j;
                for (int i = 0; i < 4; ++i) columns[i] += w * line[i];
            }
        Real value = 0;
        for (int i = 0; i < 4; ++i) value += weight[0][i] * columns[i];
        return value;
    };
    for (int c = 0; c < channels_; ++c) {
        values[c] = sum_at(first_, c);
        if (shares_) values[c] /= sum_at(shares_->first_, c);
    }
}

template <class Real>
Vec3 SplineBlock<Real>::gradient(const Vec3& p) const noexcept {
    std::array<std::array<double, 4>, 3> weight, slope;
    std::array<std::int64_t, 3> start;
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(p[axis]);
        const double f = p[axis] - static_cast<double>(cell), g = 1 - f;
        start[axis] = cell - held_.begin[axis];
        weight[axis] = {g * g * g / 6, (4 - f * f * (6 - 3 * f)) / 6, (4 - g * g * (6 - 3 * g)) / 6,
                        f * f * f / 6};
        slope[axis] = {-g * g / 2, f * (1.5 * f - 2), -g * (1.5 * g - 2), f * f / 2};
        if (!pad_[axis]) weight[axis] = {1, 0, 0, 0}, slope[axis] = {};
    }
    const int rows = pad_[1] ? 4 : 1, planes = pad_[2] ? 4 : 1;
    const Real* corner = first_ + start[0] + padded_.x * (start[1] + padded_.y * start[2]);
    Vec3 gradient = Vec3::Zero();
    for (int k = 0; k < planes; ++k, corner += padded_.x * padded_.y)
        for (int j = 0; j < rows; ++j) {
            const Real* line = corner + padded_.x * j;
            double value = 0, along = 0;
            for (std::size_t i = 0; i < 4; ++i) {
                value += weight[0][i] * static_cast<double>(line[i]);
                along += slope[0][i] * static_cast<double>(line[i]);
            }
            gradient[0] += weight[2][k] * weight[1][j] * along;
            gradient[1] += weight[2][k] * slope[1][j] * value;
            gradient[2] += slope[2][k] * weight[1][j] * value;
        }
    return gradient;
}

template <class Real>
HeldBox<Real> SplineBlock<Real>::box(const Extent& n, int channel) const noexcept {
    HeldBox<Real> box{.first = first_ + channel * padded_.samples(), .begin = held_.begin};
    const std::array<std::int64_t, 3> stride = {1, padded_.x, padded_.x * padded_.y};
    for (int axis = 0; axis < 3; ++axis) {
        box.size[axis] = held_.extent()[axis];
        box.stride[axis] = pad_[axis] > 0 ? stride[axis] : 0;
        box.last[axis] = static_cast<double>(n[axis] - 1);
    }
    return box;
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
