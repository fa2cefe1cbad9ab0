#include "transitions/reference/preview_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

constexpr int kMargin = 6;  // the prefilter is off by 4e-4 of what neighbours differ, at the ends

}  // namespace

double hashed(std::uint64_t n) noexcept {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
    n += 0x9e3779b97f4a7c15;
    n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9;
    n = (n ^ (n >> 27)) * 0x94d049bb133111eb;
    return static_cast<double>((n ^ (n >> 31)) >> 11) * 0x1p-53;
}

PreviewBlock::PreviewBlock(const ReferenceField& field, const Region& cells,
                           std::pmr::memory_resource* memory)
    : field_(field), channels_(field.samples().what.channels) {
    const Data& data = field.samples();
    for (int axis = 0; axis < 3; ++axis) {
        held_.begin[axis] = std::max<std::int64_t>(0, cells.begin[axis] - kMargin - 1);
        held_.end[axis] = std::min(data.what.extent[axis], cells.end[axis] + kMargin + 2);
    }
    copy_ = Array(static_cast<std::size_t>(held_.extent().samples() * channels_) * sizeof(float),
                  memory);
    samples_ = static_cast<const float*>(copy_.data());
    load();
    if (!constant_) spline_.emplace(data, cells, kMargin, memory);
}

void PreviewBlock::load() {
    const Data& data = field_.samples();
    const Extent n = data.what.extent, held = held_.extent();
    const double slope = data.what.values.slope, offset = data.what.values.offset;
    float* to = static_cast<float*>(copy_.data());
    float low = std::numeric_limits<float>::infinity(), high = -low;
    const std::int64_t row = held.x * channels_;
    with_stored_type(data.what.type, [&](auto zero) {
        for (std::int64_t z = 0; z < held.z; ++z)
            for (std::int64_t y = 0; y < held.y; ++y, to += row) {
                const auto* from =
                    data.as<decltype(zero)>() +
                    channels_ *
                        (held_.begin[0] + n.x * (held_.begin[1] + y + n.y * (held_.begin[2] + z)));
                for (std::int64_t i = 0; i < row; ++i) {
                    to[i] = static_cast<float>(slope * as_double(from[i]) + offset);
                    if constexpr (!std::is_integral_v<decltype(zero)>)
                        all_finite_ = all_finite_ && std::isfinite(to[i]);
                    low = to[i] < low ? to[i] : low;
                    high = to[i] > high ? to[i] : high;
                }
            }
    });
    constant_ = all_finite_ && low == high;
}

// Positions are clamped by now and not negative, so that a conversion to an integer is their floor:
// without SSE 4.1 std::floor is a call, and there are millions.

void PreviewBlock::zoh(const Vec3& p, double* values) const {
    std::int64_t at = 0;
    const Extent held = held_.extent();
    for (int axis = 2; axis >= 0; --axis) {
        const auto i = static_cast<std::int64_t>(p[axis] + 0.5) - held_.begin[axis];
        at = at * held[axis] + std::clamp<std::int64_t>(i, 0, held[axis] - 1);
    }
    for (int c = 0; c < channels_; ++c)
        values[c] = static_cast<double>(samples_[at * channels_ + c]);
}

void PreviewBlock::foh(const Vec3& p, double* values) const {
    const Extent held = held_.extent();
    std::array<std::int64_t, 3> low{}, step{};
    std::array<float, 3> f{};
    const std::array<std::int64_t, 3> stride = {1, held.x, held.x * held.y};
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(p[axis]);
        f[axis] = static_cast<float>(p[axis] - static_cast<double>(cell));
        low[axis] = (cell - held_.begin[axis]) * stride[axis] * channels_;
        step[axis] = f[axis] > 0 ? stride[axis] * channels_ : 0;
    }
    const float* corner = samples_ + low[0] + low[1] + low[2];
    for (int c = 0; c < channels_; ++c, ++corner) {
        const auto along = [&](std::int64_t at) {
            return corner[at] + f[0] * (corner[at + step[0]] - corner[at]);
        };
        const auto across = [&](std::int64_t at) {
            const float a = along(at), b = along(at + step[1]);
            return a + f[1] * (b - a);
        };
        const float a = across(0), b = across(step[2]);
        values[c] = static_cast<double>(a + f[2] * (b - a));
    }
}

std::int64_t PreviewBlock::stride(int axis) const {
    const Extent held = held_.extent();
    return channels_ * (axis == 0 ? 1 : axis == 1 ? held.x : held.x * held.y);
}

PreviewBlock::Line PreviewBlock::line(const Vec3& p, int axis) const {
    Line line;
    const auto last = static_cast<double>(field_.extent()[axis] - 1);
    const std::int64_t a_sample = stride(axis);
    line.begin = std::clamp(static_cast<int>(std::ceil(-0.5 - p[axis])), 0, kSquare);
    line.end = std::clamp(static_cast<int>(std::floor(last + 0.5 - p[axis])) + 1, 0, kSquare);
    for (int i = line.begin; i < line.end; ++i) {
        const double q = std::clamp(p[axis] + i, 0.0, last);
        const auto cell = static_cast<std::int64_t>(q);
        line.f[i] = static_cast<float>(q - static_cast<double>(cell));
        line.offset[i] = (cell - held_.begin[axis]) * a_sample;
        line.step[i] = line.f[i] > 0 ? a_sample : 0;
    }
    return line;
}

void PreviewBlock::hold(PreviewHold hold, const Vec3& p, double* values) const {
    const Vec3 q = field_.clamped(p);
    if (constant_)
        std::fill_n(values, channels_, static_cast<double>(samples_[0]));
    else if (hold == kZoh)
        zoh(q, values);
    else if (hold == kFoh)
        foh(q, values);
    else
        spline_->at(q, values);
}

void PreviewBlock::assigned(const Vec3& p, std::uint64_t seed, double* values) const {
    Vec3 moved = p;
    for (int axis = 0; axis < field_.axes(); ++axis)
        moved[axis] += hashed(3 * seed + static_cast<std::uint64_t>(axis)) - 0.5;
    zoh(field_.clamped(moved), values);
}

bool PreviewBlock::reference(const Vec3& p, double* values) const {
    if (field_.kind() == Field::formula) {
        values[0] = field_.formula()->at(p);
        return true;
    }
    if (!all_finite_) {
        zoh(field_.clamped(p), values);
        for (int c = 0; c < channels_; ++c)
            if (!std::isfinite(values[c])) return false;
    }
    hold(field_.kind() == Field::spline   ? kSpline
         : field_.kind() == Field::linear ? kFoh
                                          : kZoh,
         p, values);
    return true;
}

std::array<double, 2> PreviewBlock::sheared(const Vec3& p, std::uint64_t seed) const {
    constexpr int kReach = 5;       // nodes on either side, which lie in the margin of the block
    constexpr double kSlant = 0.5;  // shears of a turn by 30 degrees: 0.27 and 0.5
    const auto axis = static_cast<int>(seed % static_cast<std::uint64_t>(field_.axes()));
    Vec3 along = Vec3::Zero();
    along[axis] = 1;
    for (int other = 1; other < field_.axes(); ++other)
        along[(axis + other) % field_.axes()] =
            hashed(2 * seed + static_cast<std::uint64_t>(other)) < 0.5 ? kSlant : -kSlant;
    const double f = p[axis] - std::floor(p[axis]);
    std::array<double, 2 * kReach> value{};  // at floor + 1 - kReach ... floor + kReach
    std::vector<double> channels(static_cast<std::size_t>(channels_));
    for (int k = 0; k < 2 * kReach; ++k) {
        if (!reference(p + (k + 1 - kReach - f) * along, channels.data())) return {};
        value[k] = channels[0];
    }
    if (!reference(p, channels.data())) return {};
    // The natural spline: what it bends to at its ends fades by 0.27 a node.
    std::array<double, 2 * kReach> bend{}, upper{};  // second derivatives
    for (int k = 1; k < 2 * kReach - 1; ++k) {
        const double pivot = 1 / (4 - upper[k - 1]);
        upper[k] = pivot;
        bend[k] = pivot * (6 * (value[k - 1] - 2 * value[k] + value[k + 1]) - bend[k - 1]);
    }
    for (int k = 2 * kReach - 2; k > 0; --k) bend[k] -= upper[k] * bend[k + 1];
    const int low = kReach - 1;
    const double g = 1 - f, line = g * value[low] + f * value[low + 1];
    const double spline =
        line + ((g * g * g - g) * bend[low] + (f * f * f - f) * bend[low + 1]) / 6;
    return {line - channels[0], spline - channels[0]};
}

double PreviewBlock::noise(PreviewHold hold, const Vec3& p) const {
    const Vec3 q = field_.clamped(p);
    const Extent& n = field_.extent();
    std::array<std::array<std::int64_t, 2>, 3> index{};
    std::array<std::array<double, 2>, 3> weight{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::int64_t>(q[axis]);
        double f = q[axis] - static_cast<double>(i);
        if (hold == kZoh) f = f < 0.5 ? 0 : 1;
        index[axis] = {i, std::min(i + 1, n[axis] - 1)};
        weight[axis] = {1 - f, f};
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
        const std::int64_t at = index[0][i] + n.x * (index[1][j] + n.y * index[2][k]);
        sum += weight[0][i] * weight[1][j] * weight[2][k] *
               (hashed(static_cast<std::uint64_t>(at)) - 0.5);
    }
    return sum * std::sqrt(12.0);  // a uniform number of width 1 has RMS 1 / sqrt(12)
}

}  // namespace edgewise
