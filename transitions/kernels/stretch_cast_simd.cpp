// Ray casting by stretches: what a map passes by or crosses at once, and samples elsewhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/stretch_cast.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/stretch_cast_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/ray_samplers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

// A single float, with the roundings of a lane.
using OneF = hn::CappedTag<float, 1>;

HWY_INLINE float mul_add(float a, float b, float c) {
    const OneF d;
    return hn::GetLane(hn::MulAdd(hn::Set(d, a), hn::Set(d, b), hn::Set(d, c)));
}

/// Cells of one ray, one behind the other in a vector.
struct CellsOfRay {
    VF weight;   // 1 of a whole cell
    int count;   // the first so many lanes
    bool parts;  // an end of the ray is among them

    HWY_INLINE MF mask(MF also) const {
        return hn::And(also, hn::FirstN(DF(), static_cast<std::size_t>(count)));
    }
};

template <bool kFinite>
HWY_INLINE MF finite_lanes(VF value) {
    if constexpr (kFinite)
        return hn::FirstN(DF(), kLanes);
    else
        return is_finite(value);
}

// Every rule has: needs (given a level ahead), alive, take (samples), cross (one value over a
// number of cells), write.

template <bool kFinite>
class LargestOfRay {
 public:
    static constexpr int kChannels = 1;
    static constexpr bool kSkips = true;

    explicit LargestOfRay(const RayCast& cast) : falls_(cast.volume.values.slope < 0) {}

    bool needs(float level) const { return level > best_; }
    bool alive() const { return true; }
    HWY_INLINE void take(VF value, const CellsOfRay& cells) {
        const VF sign = hn::Set(DF(), falls_ ? -0.0f : 0.0f);
        const VF none = hn::Set(DF(), -std::numeric_limits<float>::infinity());
        const VF lanes =
            hn::IfThenElse(cells.mask(finite_lanes<kFinite>(value)), hn::Xor(value, sign), none);
        best_ = std::max(best_, hn::GetLane(hn::MaxOfLanes(DF(), lanes)));
    }
    void cross(float value, double) { best_ = std::max(best_, falls_ ? -value : value); }
    void write(const RayCast& cast, const RayPath* path, float* out) const {
        const bool any = path && std::isfinite(best_);
        const double stored = falls_ ? -best_ : best_;
        *out = static_cast<float>(any ? cast.volume.values(stored) : cast.miss);
    }

 private:
    bool falls_;
    float best_ = -std::numeric_limits<float>::infinity();
};

/// Integral and mean, in f64 but for the vectors.
template <bool kFinite>
class LineOfRay {
 public:
    static constexpr int kChannels = 1;
    static constexpr bool kSkips = false;

    explicit LineOfRay(const RayCast& cast)
        : origin_(kFinite ? 0 : origin_of_sums(cast.rule, cast.volume.values, cast.zero)) {}

    bool needs(float level) const { return level >= 0; }
    bool alive() const { return true; }
    HWY_INLINE void take(VF value, const CellsOfRay& cells) {
        const MF kept = cells.mask(finite_lanes<kFinite>(value));
        const VF off = hn::IfThenElseZero(kept, hn::Sub(value, hn::Set(DF(), origin_)));
        sum_ += hn::GetLane(hn::SumOfLanes(DF(), hn::Mul(cells.weight, off)));
        length_ += hn::GetLane(hn::SumOfLanes(DF(), hn::IfThenElseZero(kept, cells.weight)));
    }
    void cross(float value, double cells) {
        sum_ += cells * (static_cast<double>(value) - origin_);
        length_ += cells;
    }
    void write(const RayCast& cast, const RayPath* path, float* out) const {
        const bool mean = cast.rule == Combine::mean;
        const double weight = kFinite && path ? path->length : length_;
        if (!path || weight <= 0) {
            *out = mean ? static_cast<float>(cast.miss) : 0.0f;
            return;
        }
        const double average = cast.volume.values(sum_ / weight + origin_);
        *out = static_cast<float>(mean ? average
                                       : (average - cast.zero) * weight * cast.step * cast.unit);
    }

 private:
    float origin_;
    double sum_ = 0, length_ = 0;
};

/// Front-to-back compositing, operation for operation as OverSum.
template <bool kFinite, int kColors>
class OverOfRay {
 public:
    static constexpr int kChannels = 4;
    static constexpr bool kSkips = true;

    explicit OverOfRay(const RayCast& cast)
        : optics_(*cast.optics),
          power_(static_cast<float>(cast.step / cast.optics->unit)),
          bound_(static_cast<float>(cast.bound)),
          exact_(cast.step == cast.optics->unit) {}

    bool needs(float opacity) const { return opacity > 0; }
    bool alive() const { return left_ > 0; }
    HWY_INLINE void take(VF value, const CellsOfRay& cells) {
        const DF d;
        VF color[kColors], opacity = look_up<kColors>(optics_, value, color);
        opacity = hn::IfThenElseZero(cells.mask(finite_lanes<kFinite>(value)), opacity);
        const MF seen = hn::Gt(opacity, hn::Zero(d));
        if (hn::AllFalse(d, seen)) return;
        if (cells.parts || !exact_)
            opacity = corrected(opacity, hn::Mul(cells.weight, hn::Set(d, power_)));
        HWY_ALIGN float opacities[kLanes], colors[kColors][kLanes];
        hn::Store(opacity, d, opacities);
        for (int c = 0; c < kColors; ++c) hn::Store(color[c], d, colors[c]);
        for (int lane = 0; lane < cells.count && left_ > 0; ++lane) {
            if (!(opacities[lane] > 0)) continue;
            float own[kColors];
            for (int c = 0; c < kColors; ++c) own[c] = colors[c][lane];
            composite(own, opacities[lane]);
        }
    }
    /// EQ 53: the transparency of a length is that of the unit length to its power.
    HWY_INLINE void cross(float value, double cells) {
        const DF d;
        VF color[kColors], opacity = look_up<kColors>(optics_, hn::Set(d, value), color);
        opacity = corrected(opacity, hn::Set(d, static_cast<float>(cells) * power_));
        float own[kColors];
        for (int c = 0; c < kColors; ++c) own[c] = hn::GetLane(color[c]);
        composite(own, hn::GetLane(opacity));
    }
    void write(const RayCast&, const RayPath* path, float* out) const {
        for (int c = 0; c < 3; ++c) out[c] = path ? light_[c % kColors] : 0.0f;
        out[3] = path ? 1.0f - left_ : 0.0f;
    }

 private:
    HWY_INLINE void composite(const float (&light)[kColors], float opacity) {
        const float caught = left_ * opacity;
        for (int c = 0; c < kColors; ++c) light_[c] = mul_add(caught, light[c], light_[c]);
        left_ -= caught;
        if (!(left_ >= bound_)) left_ = 0;
    }

    const Optics& optics_;
    float power_, bound_;
    bool exact_;
    float light_[kColors] = {}, left_ = 1;
};

/// One ray through a map.
template <class Map, class Sampler, class Rule>
class RayByStretches {
 public:
    RayByStretches(const StretchCast& by, const Map& map, const Sampler& sampler)
        : by_(by), map_(map), sampler_(sampler) {
        for (int axis = 0; axis < 3; ++axis)
            size_[axis] = static_cast<int>(by.cast.volume.extent[axis]);
    }

    void walk(const RayPath& path, Rule& rule) {
        take(path);
        map_.begin_ray();
        const auto needs = [&rule](float level) { return rule.needs(level); };
        int waiting = 0;  // the first of the cells before `cell` that wait to be sampled
        bool waits = false;
        int cell = 0;
        while (cell < count_ && rule.alive()) {
            const Place here = place(cell);
            std::array<int, 3> sample;
            for (std::size_t axis = 0; axis < 3; ++axis)
                sample[axis] = std::clamp(static_cast<int>(here[axis]), 0, size_[axis] - 1);
            const BoxAhead box = map_.at(sample, needs);
            const int next = behind(box, cell, here);
            count(box.holds, next - cell);
            if (box.holds == BoxAhead::samples) {
                if (!waits) waiting = cell;
                waits = next - waiting < kFull;
                if (!waits) sample_cells(waiting, next, rule);
            } else {
                if (waits) sample_cells(waiting, cell, rule);
                waits = false;
                if (box.holds == BoxAhead::one_value && rule.alive())
                    rule.cross(box.value, length(cell, next));
            }
            cell = next;
        }
        if (waits) sample_cells(waiting, cell, rule);
    }

 private:
    using Place = std::array<float, 3>;
    /// So many cells are sampled before the map is asked again: what they hold may tell more of
    /// what is ahead.
    static constexpr int kFull = 2 * static_cast<int>(kLanes);

    void take(const RayPath& path) {
        count_ = static_cast<int>(path.last - path.first) + 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            position_[axis] = static_cast<float>(path.position[axis]);
            stride_[axis] = static_cast<float>(path.stride[axis]);
            inverse_[axis] = stride_[axis] == 0 ? 0 : 1 / stride_[axis];
        }
        offsets_ = {static_cast<float>(path.first_offset), static_cast<float>(path.last_offset)};
        weights_ = {static_cast<float>(path.first_weight), static_cast<float>(path.last_weight)};
        inner_first_ = static_cast<int>(path.inner_first - path.first);
        inner_last_ = static_cast<int>(path.inner_last - path.first);
    }
    float offset(int cell) const {
        if (cell == count_ - 1) return offsets_[1];
        return cell == 0 ? offsets_[0] : static_cast<float>(cell);
    }
    Place place(int cell) const {
        Place p;
        const float along = offset(cell);
        for (std::size_t axis = 0; axis < 3; ++axis)
            p[axis] = mul_add(along, stride_[axis], position_[axis]);
        return p;
    }
    /// Whether a place behind another one in the box is in it too.
    bool is_in(const BoxAhead& box, const Place& p) const {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // Beyond the outermost samples their nodes go on.
            if (box.high[axis] < size_[axis] && p[axis] >= static_cast<float>(box.high[axis]))
                return false;
            if (box.low[axis] > 0 && p[axis] < static_cast<float>(box.low[axis])) return false;
        }
        return true;
    }
    /// The first cell that is not sampled in the box. Places go one way along each axis, rounded or
    /// not, so that the last one tells of all.
    int behind(const BoxAhead& box, int cell, const Place& here) const {
        float cells = static_cast<float>(count_);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const bool up = stride_[axis] > 0;
            const int face = up ? box.high[axis] : box.low[axis];
            if (stride_[axis] == 0 || (up ? face >= size_[axis] : face <= 0)) continue;
            cells = std::min(cells, (static_cast<float>(face) - here[axis]) * inverse_[axis]);
        }
        const float last = std::clamp(offset(cell) + cells, 0.0f, static_cast<float>(count_ - 1));
        int to = std::max(cell, static_cast<int>(last));
        while (to > cell && !is_in(box, place(to))) --to;
        return to + 1;
    }
    double length(int cell, int next) const {
        if (count_ == 1) return static_cast<double>(weights_[1]);
        double cells = next - cell;
        if (cell == 0) cells += static_cast<double>(weights_[0]) - 1;
        if (next == count_) cells += static_cast<double>(weights_[1]) - 1;
        return cells;
    }
    void count(BoxAhead::Holds holds, int cells) const {
        if (!by_.taken) return;
        ++by_.taken->looks;
        by_.taken->passed += holds == BoxAhead::nothing;
        by_.taken->crossed += holds == BoxAhead::one_value;
        (holds == BoxAhead::samples ? by_.taken->samples : by_.taken->unsampled) += cells;
    }
    HWY_INLINE void sample_cells(int begin, int end, Rule& rule) const {
        const DF d;
        const DI di;
        constexpr int kCells = static_cast<int>(kLanes);
        for (int first = begin; first < end && rule.alive(); first += kCells) {
            const int last = std::min(first + kCells, end) - 1;
            // Lanes behind the last cell stay in it.
            const VI cell =
                hn::Min(hn::Add(hn::Set(di, first), hn::Iota(di, 0)), hn::Set(di, last));
            VF along = hn::ConvertTo(d, cell);
            CellsOfRay cells{hn::Set(d, 1.0f), last + 1 - first, first == 0 || last == count_ - 1};
            if (cells.parts) {
                const MF is_first = hn::RebindMask(d, hn::Eq(cell, hn::Zero(di)));
                const MF is_last = hn::RebindMask(d, hn::Eq(cell, hn::Set(di, count_ - 1)));
                along = hn::IfThenElse(is_first, hn::Set(d, offsets_[0]), along);
                along = hn::IfThenElse(is_last, hn::Set(d, offsets_[1]), along);
                cells.weight = hn::IfThenElse(is_first, hn::Set(d, weights_[0]), cells.weight);
                cells.weight = hn::IfThenElse(is_last, hn::Set(d, weights_[1]), cells.weight);
            }
            const auto at = [&](std::size_t axis) HWY_ATTR {
                return hn::MulAdd(along, hn::Set(d, stride_[axis]), hn::Set(d, position_[axis]));
            };
            const bool inner = first >= inner_first_ && last <= inner_last_;
            rule.take(inner ? sampler_.template at<true>(at(0), at(1), at(2))
                            : sampler_.template at<false>(at(0), at(1), at(2)),
                      cells);
        }
    }

    const StretchCast& by_;
    Map map_;
    const Sampler& sampler_;
    std::array<int, 3> size_;
    Place position_{}, stride_{}, inverse_{};
    std::array<float, 2> offsets_{}, weights_{};  // of the first and the last cell
    int count_ = 0, inner_first_ = 0, inner_last_ = -1;
};

/// A picture and the part of it that is filled.
struct StretchTile {
    const StretchCast& by;
    std::int64_t x, y, width, height;
    float* out;
    std::ptrdiff_t row_floats;

    template <class Rule, class Map, class Sampler>
    void filled(const Map& map, const Sampler& sampler) const {
        const RayCast& cast = by.cast;
        const Shadow shadow(cast, ParallelRays(cast), static_cast<double>(x),
                            static_cast<double>(y), static_cast<double>(width),
                            static_cast<double>(height));
        RayByStretches<Map, Sampler, Rule> ray(by, map, sampler);
        for (std::int64_t row = 0; row < height; ++row) {
            const auto py = static_cast<double>(y + row);
            const Shadow::Columns seen = shadow.columns(py, py);
            float* to = out + row * row_floats;
            for (std::int64_t column = 0; column < width; ++column, to += Rule::kChannels) {
                const auto px = static_cast<double>(x + column);
                Rule rule(cast);
                RayPath path;
                if (px >= seen.first && px <= seen.last) path = ray_path(cast, px, py);
                const bool hit = path.length > 0;
                if (hit) ray.walk(path, rule);
                rule.write(cast, hit ? &path : nullptr, to);
            }
        }
    }
    template <class Rule, class Read>
    void mapped() const {
        const LinearSampler<Read> sampler(by.cast.volume);
        if (by.octree) return filled<Rule>(OctreeWay(*by.octree), sampler);
        if constexpr (Rule::kSkips)
            filled<Rule>(BricksAhead(*by.bricks, by.cast.rule, by.cast.volume.values.slope < 0),
                         sampler);
    }
    template <bool kFinite, class Read>
    void ruled() const {
        const RayCast& cast = by.cast;
        if (cast.rule == Combine::max) return mapped<LargestOfRay<kFinite>, Read>();
        if (cast.rule != Combine::over) return mapped<LineOfRay<kFinite>, Read>();
        if (cast.optics->grey) return mapped<OverOfRay<kFinite, 1>, Read>();
        mapped<OverOfRay<kFinite, 3>, Read>();
    }
};

void stretch_cast_on(const StretchCast& by, std::int64_t x, std::int64_t y, std::int64_t width,
                     std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    // As cast_tile() has it: the same reads, so the same values.
    constexpr bool kPlainLoops = HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR;
    const StretchTile tile{by, x, y, width, height, out, row_floats};
    const Grid& volume = by.cast.volume;
    const double bytes =
        static_cast<double>(volume.extent.samples()) * static_cast<double>(bytes_of(volume.type));
    if (kPlainLoops || !(bytes < 2147483648.0) || !in_lanes(volume.type))
        return tile.ruled<false, Walked>();
    if constexpr (!kPlainLoops)
        gathers::HWY_NAMESPACE::with_reads(volume.type, [&](auto reads) {
            using Reads = decltype(reads);
            tile.ruled<std::is_integral_v<typename Reads::Sample>, Gathered<Reads>>();
        });
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(stretch_cast_on);

void stretch_cast(const StretchCast& by, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(stretch_cast_on)(by, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
