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

/// Prefilters `lanes` lines at once; samples of a line are `step` apart, lines `lane_step` apart.
/// Lines side by side (lane_step 1) run in vectors, others hide each other's latency.
template <class Real>
void prefilter_lines(Real* first, std::int64_t n, std::int64_t step, std::int64_t lanes,
                     std::int64_t lane_step) {
    if (n == 1) return;
    const Real pole = static_cast<Real>(kSplinePole);
    const Real gain = static_cast<Real>((1 - kSplinePole) * (1 - 1 / kSplinePole));
    for (std::int64_t l = 0; l < lanes; ++l)
        first[l * lane_step] =
            static_cast<Real>(gain * mirrored_start(first + l * lane_step, n, step));
    const auto forward = [&](auto stride) {
        for (std::int64_t i = 1; i < n; ++i) {
            Real* here = first + i * step;
            const Real* before = here - step;
            for (std::int64_t l = 0; l < lanes; ++l)
                here[l * stride] = gain * here[l * stride] + pole * before[l * stride];
        }
    };
    const auto backward = [&](auto stride) {
        const Real end = static_cast<Real>(kSplinePole / (kSplinePole * kSplinePole - 1));
        Real* last = first + (n - 1) * step;
        for (std::int64_t l = 0; l < lanes; ++l)
            last[l * stride] = end * (last[l * stride] + pole * last[l * stride - step]);
        for (std::int64_t i = n - 2; i >= 0; --i) {
            Real* here = first + i * step;
            const Real* behind = here + step;
            for (std::int64_t l = 0; l < lanes; ++l)
                here[l * stride] = pole * (behind[l * stride] - here[l * stride]);
        }
    };
    if (lane_step == 1) {
        forward(std::integral_constant<std::int64_t, 1>{});
        backward(std::integral_constant<std::int64_t, 1>{});
    } else {
        forward(lane_step);
        backward(lane_step);
    }
}

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
        pad_[axis] = n > 1 ? kLead : 0;
        padded_[axis] = held_.extent()[axis] + (n > 1 ? kLead + kTrail : 0);
    }
    coefficients_ = Array(
        static_cast<std::size_t>(padded_.samples() * channels_) * sizeof(Real), memory);
    first_ = static_cast<Real*>(coefficients_.data());
    load(data);
    prefilter();
    mirror_pads();
}

template <class Real>
void SplineBlock<Real>::load(const Data& data) {
    const Extent& n = data.what.extent;
    const Extent held = held_.extent();
    const double slope = data.what.values.slope, offset = data.what.values.offset;
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* samples = data.as<decltype(zero)>();
        for (int c = 0; c < channels_; ++c)
            for (std::int64_t z = 0; z < held.z; ++z)
                for (std::int64_t y = 0; y < held.y; ++y) {
                    const auto* from =
                        samples + c +
                        channels_ * (held_.begin[0] +
                                     n.x * (held_.begin[1] + y + n.y * (held_.begin[2] + z)));
                    Real* to = first_ + pad_[0] +
                               padded_.x * (pad_[1] + y + padded_.y * (pad_[2] + z + padded_.z * c));
                    for (std::int64_t x = 0; x < held.x; ++x)
                        to[x] = static_cast<Real>(slope * as_double(from[x * channels_]) + offset);
                    if constexpr (std::is_integral_v<decltype(zero)>) continue;
                    Real last = 0;
                    for (std::int64_t x = 0; x < held.x; ++x)
                        if (std::isfinite(to[x])) last = to[x];
                        else to[x] = last;
                }
    });
}

template <class Real>
void SplineBlock<Real>::prefilter() {
    const Extent held = held_.extent();
    const std::int64_t row = padded_.x, plane = padded_.x * padded_.y;
    for (int c = 0; c < channels_; ++c) {
        Real* origin = first_ + pad_[0] + pad_[1] * row + (pad_[2] + padded_.z * c) * plane;
        for (std::int64_t z = 0; z < held.z; ++z) {
            for (std::int64_t y = 0; y < held.y; y += 8)  // eight rows hide one recursion's latency
                prefilter_lines(origin + z * plane + y * row, held.x, 1,
                                std::min<std::int64_t>(8, held.y - y), row);
            prefilter_lines(origin + z * plane, held.y, row, held.x, 1);
        }
        for (std::int64_t y = 0; y < held.y; ++y)
            prefilter_lines(origin + y * row, held.z, plane, held.x, 1);
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
    std::array<std::int64_t, 3> start{};
    std::array<int, 3> taps{};
    for (int axis = 0; axis < 3; ++axis) {
        const double cell = std::floor(p[axis]);
        const Real f = static_cast<Real>(p[axis] - cell), g = 1 - f;
        start[axis] = static_cast<std::int64_t>(cell) - held_.begin[axis];  // kLead == pad_
        taps[axis] = pad_[axis] ? 4 : 1;
        const Real sixth = static_cast<Real>(1.0 / 6);
        weight[axis] = {sixth * g * g * g, sixth * (4 - f * f * (6 - 3 * f)),
                        sixth * (4 - g * g * (6 - 3 * g)), sixth * f * f * f};
        if (!pad_[axis]) weight[axis] = {1, 0, 0, 0};
    }
    for (int c = 0; c < channels_; ++c) {
        const Real* corner =
            first_ + start[0] + padded_.x * (start[1] + padded_.y * (start[2] + padded_.z * c));
        Real value = 0;
        if (taps[0] == 4) {
            std::array<Real, 4> columns{};
            for (int k = 0; k < taps[2]; ++k)
                for (int j = 0; j < taps[1]; ++j) {
                    const Real w = weight[2][k] * weight[1][j];
                    const Real* line = corner + padded_.x * (j + padded_.y * k);
                    for (int i = 0; i < 4; ++i) columns[i] += w * line[i];
                }
            for (int i = 0; i < 4; ++i) value += weight[0][i] * columns[i];
        } else {
            for (int k = 0; k < taps[2]; ++k)
                for (int j = 0; j < taps[1]; ++j)
                    value += weight[2][k] * weight[1][j] * corner[padded_.x * (j + padded_.y * k)];
        }
        values[c] = value;
    }
}

template <class Real>
double SplineBlock<Real>::bytes(const Extent& cells, int margin, int axes, int channels) noexcept {
    double samples = channels;
    for (int axis = 0; axis < axes; ++axis)
        samples *= static_cast<double>(cells[axis] + 2 * (kLead + kTrail + margin));
    return samples * sizeof(Real);
}

template class SplineBlock<float>;
template class SplineBlock<double>;

}  // namespace edgewise
