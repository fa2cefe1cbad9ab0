#include "reference/preview_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "reference/stored.hpp"
#include "transitions/filters/field_filter.hpp"

namespace edgewise {
namespace {

constexpr int kMargin = 6;  // the prefilter errs by 4e-4 of neighbours' difference at the ends

}  // namespace

double hashed(std::uint64_t n) noexcept {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
    n += 0x9e3779b97f4a7c15;
    n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9;
    n = (n ^ (n >> 27)) * 0x94d049bb133111eb;
    return static_cast<double>((n ^ (n >> 31)) >> 11) * 0x1p-53;
}

const Filter& filter_of(PreviewHold hold) {
    static const std::array<const Filter*, 3> all = {
        &field_filter(Field::nearest), &field_filter(Field::linear), &field_filter(Field::spline)};
    return *all[hold];
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

void PreviewBlock::read_exactly(std::pmr::memory_resource* memory) {
    if (field_.kind() == Field::spline && all_finite_ && !constant_)
        exact_.emplace(field_.samples(), Region::all(field_.extent()), 0, memory, true);
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

bool PreviewBlock::reaches(const Vec3& p) const noexcept {
    constexpr std::int64_t kAround = 4;  // three taps on one side, and a difference
    const Vec3 q = field_.clamped(p);
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(std::floor(q[axis]));
        const std::int64_t last = field_.extent()[axis] - 1;
        if (std::max<std::int64_t>(0, cell - kAround) < held_.begin[axis] ||
            std::min(last, cell + kAround) >= held_.end[axis])
            return false;
    }
    return true;
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
        spline_at(places, values, channel);
}

void PreviewBlock::read(const Filter& filter, const Places& places, double* values,
                        int channel) const {
    for (const PreviewHold known : {kZoh, kFoh, kSpline})
        if (&filter == &filter_of(known)) return hold(known, places, values, channel);
    weighted_at(filter, places, values, channel);
}

void PreviewBlock::weighted_at(const Filter& filter, const Places& places, double* values,
                               int channel) const {
    constexpr int kMost = 2 * kMargin;
    const Extent& n = field_.extent();
    for (std::size_t i = 0; i < places.count; ++i) {
        std::array<std::array<double, kMost>, 3> weights;
        std::array<std::array<std::int64_t, kMost>, 3> offsets;
        for (int axis = 0; axis < 3; ++axis) {
            const double last = static_cast<double>(n[axis] - 1);
            const double p = std::clamp(places.at[axis][i], 0.0, last), cell = std::floor(p);
            filter.weights(p - cell, weights[axis].data());
            for (int tap = 0; tap < filter.taps; ++tap) {
                const auto at = static_cast<std::int64_t>(cell) + tap + 1 - filter.taps / 2;
                offsets[axis][tap] = stride(axis) * (std::clamp<std::int64_t>(at, 0, n[axis] - 1) -
                                                     held_.begin[axis]);
            }
        }
        double sum = 0;
        for (int c = 0; c < filter.taps; ++c)
            for (int b = 0; b < filter.taps; ++b) {
                const float* row = samples_ + channel + offsets[2][c] + offsets[1][b];
                double along = 0;
                for (int a = 0; a < filter.taps; ++a)
                    along += weights[0][a] * static_cast<double>(row[offsets[0][a]]);
                sum += weights[2][c] * weights[1][b] * along;
            }
        values[i] = sum;
    }
}

void PreviewBlock::spline_at(const Places& places, double* values, int channel) const {
    cubic_at(spline_->box(field_.extent(), channel), places, values);
    if (!spline_->has_gaps()) return;
    std::array<double, Places::kMost> shares;
    cubic_at(spline_->shares().box(field_.extent(), channel), places, shares.data());
    for (std::size_t i = 0; i < places.count; ++i) values[i] /= shares[i];
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
    if (exact_) {
        std::vector<double> all(static_cast<std::size_t>(channels_));
        for (std::size_t i = 0; i < places.count; ++i) {
            exact_->at(field_.clamped(places[i]), all.data());
            values[i] = all[0];
        }
        return;
    }
    hold(own_hold(), places, values);
    if (all_finite_) return;
    std::vector<double> exact(static_cast<std::size_t>(channels_));
    for (std::size_t i = 0; i < places.count; ++i)
        if (field_.near_non_finite(places[i]))
            values[i] =
                field_.at(places[i], exact) ? exact[0] : std::numeric_limits<double>::quiet_NaN();
}

bool PreviewBlock::reference(const Vec3& p, double* values) const {
    if (field_.kind() == Field::formula) {
        values[0] = field_.formula()->at(p);
        return true;
    }
    if (!all_finite_ && field_.near_non_finite(p))
        return field_.at(p, {values, static_cast<std::size_t>(channels_)});
    if (exact_)
        exact_->at(field_.clamped(p), values);
    else
        hold(own_hold(), p, values);
    return true;
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
