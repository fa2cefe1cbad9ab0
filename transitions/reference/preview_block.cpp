#include "transitions/reference/preview_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
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
    if (!constant_) spline_.emplace(data, cells, kMargin, memory, all_finite_);
}

void PreviewBlock::load() {
    const Data& data = field_.samples();
    const Extent held = held_.extent();
    const std::int64_t row = held.x * channels_;
    auto* to = static_cast<float*>(copy_.data());
    const Box<float> box{to, {row, held.y, held.z}, row, row * held.y};
    map_box(stored_box(data, held_.begin, 0, 1), data.what.values.slope, data.what.values.offset,
            box);
    all_finite_ = is_integer(data.what.type) || all_finite(box);
    const std::span<const float> all(to, static_cast<std::size_t>(box.n.samples()));
    constant_ =
        all_finite_ && std::ranges::all_of(all, [&](float value) { return value == all.front(); });
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

HeldBox<float> PreviewBlock::box(int channel) const {
    const Extent held = held_.extent(), n = field_.extent();
    HeldBox<float> box{.first = samples_ + channel, .begin = held_.begin};
    for (int axis = 0; axis < 3; ++axis) {
        box.size[axis] = held[axis];
        box.stride[axis] = stride(axis);
        box.last[axis] = static_cast<double>(n[axis] - 1);
    }
    return box;
}

void PreviewBlock::hold(PreviewHold hold, const Places& places, double* values, int channel) const {
    if (constant_)
        std::fill_n(values, places.count, static_cast<double>(samples_[0]));
    else if (hold == kZoh)
        nearest_at(box(channel), places, values);
    else if (hold == kFoh)
        linear_at(box(channel), places, values);
    else
        cubic_at(spline_->box(field_.extent(), channel), places, values);
}

void PreviewBlock::hold(PreviewHold hold, const Vec3& p, double* values) const {
    Places place;
    place.add(p);
    for (int c = 0; c < channels_; ++c) this->hold(hold, place, values + c, c);
}

PreviewHold PreviewBlock::own_hold() const {
    return field_.kind() == Field::spline ? kSpline : field_.kind() == Field::linear ? kFoh : kZoh;
}

void PreviewBlock::reference(const Places& places, double* values) const {
    if (field_.kind() == Field::formula) {
        for (std::size_t i = 0; i < places.count; ++i) values[i] = field_.formula()->at(places[i]);
        return;
    }
    hold(own_hold(), places, values);
    for (int c = 0; c < channels_ && !all_finite_; ++c) {
        std::array<double, Places::kMost> nearest;
        hold(kZoh, places, nearest.data(), c);
        for (std::size_t i = 0; i < places.count; ++i)
            if (!std::isfinite(nearest[i])) values[i] = std::numeric_limits<double>::quiet_NaN();
    }
}

Vec3 PreviewBlock::assigned_to(const Vec3& p, std::uint64_t seed) const {
    Vec3 moved = p;
    for (int axis = 0; axis < field_.axes(); ++axis)
        moved[axis] += hashed(3 * seed + static_cast<std::uint64_t>(axis)) - 0.5;
    return moved;
}

void PreviewBlock::assigned(const Vec3& p, std::uint64_t seed, double* values) const {
    hold(kZoh, assigned_to(p, seed), values);
}

bool PreviewBlock::reference(const Vec3& p, double* values) const {
    if (field_.kind() == Field::formula) {
        values[0] = field_.formula()->at(p);
        return true;
    }
    if (!all_finite_) {
        hold(kZoh, p, values);
        for (int c = 0; c < channels_; ++c)
            if (!std::isfinite(values[c])) return false;
    }
    hold(own_hold(), p, values);
    return true;
}

std::array<double, 2> PreviewBlock::sheared(const Vec3& p, const Vec3& line, double f) const {
    // Nodes on either side. Lines reach 1.25 samples from node to node (kCoarsestLine), so that
    // four lie in the margin of the block.
    constexpr int kReach = 4;
    Places places;
    for (int k = 0; k < 2 * kReach; ++k) places.add(p + (k + 1 - kReach - f) * line);
    places.add(p);
    std::array<double, 2 * kReach + 1> value{};
    reference(places, value.data());
    if (!std::all_of(value.begin(), value.end(), [](double v) { return std::isfinite(v); }))
        return {};
    // The natural spline: what it bends to at its ends fades by 0.27 a node.
    std::array<double, 2 * kReach> bend{}, upper{};  // second derivatives
    for (int k = 1; k < 2 * kReach - 1; ++k) {
        const double pivot = 1 / (4 - upper[k - 1]);
        upper[k] = pivot;
        bend[k] = pivot * (6 * (value[k - 1] - 2 * value[k] + value[k + 1]) - bend[k - 1]);
    }
    for (int k = 2 * kReach - 2; k > 0; --k) bend[k] -= upper[k] * bend[k + 1];
    const int low = kReach - 1;
    const double g = 1 - f, linear = g * value[low] + f * value[low + 1];
    const double spline =
        linear + ((g * g * g - g) * bend[low] + (f * f * f - f) * bend[low + 1]) / 6;
    return {linear - value.back(), spline - value.back()};
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
        const double w = weight[0][i] * weight[1][j] * weight[2][k];
        if (w == 0) continue;
        const std::int64_t at = index[0][i] + n.x * (index[1][j] + n.y * index[2][k]);
        sum += w * (hashed(static_cast<std::uint64_t>(at)) - 0.5);
    }
    return sum * std::sqrt(12.0);  // a uniform number of width 1 has RMS 1 / sqrt(12)
}

}  // namespace edgewise
