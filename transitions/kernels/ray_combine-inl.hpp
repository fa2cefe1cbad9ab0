// What becomes of the samples along rays, a vector of rays at a time. Compiled once a target.
#if defined(EDGEWISE_RAY_COMBINE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_COMBINE_INL
#undef EDGEWISE_RAY_COMBINE_INL
#else
#define EDGEWISE_RAY_COMBINE_INL
#endif

#include <cmath>
#include <limits>

#include "hwy/highway.h"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_samplers-inl.hpp"

// Every rule has: add (a whole cell), add_part (a weighted cell, some lanes outside), alive
// (whether any lane still needs samples), needs (given the largest level ahead), Lanewise (the
// results). kFinite: stored numbers of integer types, which need no test for NaN and infinity.

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

/// The largest value: of stored numbers, the smallest where the slope is negative.
template <bool kFinite>
class MaxSum {
 public:
    static constexpr int kChannels = 1;
    static constexpr bool kSkips = true, kAnyOrder = true;

    explicit MaxSum(const RayCast& cast)
        : best_(hn::Set(DF(), -std::numeric_limits<float>::infinity())),
          sign_(hn::Set(DF(), cast.volume.values.slope < 0 ? -0.0f : 0.0f)) {}

    HWY_INLINE void add(VF value, int) {
        const VF larger = hn::Max(best_, hn::Xor(value, sign_));
        best_ = kFinite ? larger : hn::IfThenElse(is_finite(value), larger, best_);
    }
    HWY_INLINE void add_part(VF value, VF, MF outside, int cell) {
        const VF before = best_;
        add(value, cell);
        best_ = hn::IfThenElse(outside, before, best_);
    }
    HWY_INLINE bool alive() const { return true; }
    HWY_INLINE bool needs(VF level) const { return !hn::AllFalse(DF(), hn::Gt(level, best_)); }

    struct Lanewise {
        HWY_ALIGN float best[kLanes];

        explicit Lanewise(const MaxSum& sum) { hn::Store(sum.best_, DF(), best); }
        void write(const RayCast& cast, int lane, bool hit, double, float* out) const {
            const ValueMap& values = cast.volume.values;
            const bool any = hit && std::isfinite(best[lane]);
            const double stored = values.slope < 0 ? -best[lane] : best[lane];
            *out = static_cast<float>(any ? values(stored) : cast.miss);
        }
    };

 private:
    VF best_, sign_;
};

/// Integral and mean: the sum of weighted stored numbers, and where some may not be finite, the sum
/// of the weights of those that are.
template <bool kFinite>
class LineSum {
 public:
    static constexpr int kChannels = 1;
    static constexpr bool kSkips = false, kAnyOrder = false;
    static constexpr int kBlock = 32;  // cells summed before they join the total: rounding then
                                       // grows with the number of blocks, not of cells

    explicit LineSum(const RayCast& cast)
        : total_(hn::Zero(DF())),
          block_(total_),
          length_(total_),
          origin_(hn::Set(DF(), origin_of(cast))) {}

    HWY_INLINE void add(VF value, int cell) {
        close_block(cell);
        if constexpr (kFinite) {
            block_ = hn::Add(block_, value);
        } else {
            const MF finite = is_finite(value);
            block_ = hn::Add(block_, hn::IfThenElseZero(finite, hn::Sub(value, origin_)));
            length_ = hn::Add(length_, hn::IfThenElseZero(finite, hn::Set(DF(), 1.0f)));
        }
    }
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int cell) {
        close_block(cell);
        weight = hn::IfThenZeroElse(outside, weight);
        const MF finite = is_finite(value);
        if constexpr (!kFinite) value = hn::Sub(value, origin_);
        block_ = hn::MulAdd(weight, hn::IfThenElseZero(finite, value), block_);
        length_ = hn::Add(length_, hn::IfThenElseZero(finite, weight));
    }
    HWY_INLINE bool alive() const { return true; }
    HWY_INLINE bool needs(VF) const { return true; }

    struct Lanewise {
        HWY_ALIGN float total[kLanes], block[kLanes], length[kLanes];

        explicit Lanewise(const LineSum& sum) {
            hn::Store(sum.total_, DF(), total);
            hn::Store(sum.block_, DF(), block);
            hn::Store(sum.length_, DF(), length);
        }
        void write(const RayCast& cast, int lane, bool hit, double inside, float* out) const {
            const bool mean = cast.rule == Combine::mean;
            const double weight = kFinite ? inside : length[lane];
            if (!hit || weight <= 0) {
                *out = mean ? static_cast<float>(cast.miss) : 0.0f;
                return;
            }
            const ValueMap& values = cast.volume.values;
            // In f32, as if the block had been closed: its end may lie beyond this ray's cells.
            const float sum = total[lane] + block[lane];
            const double average = values(sum / weight + origin_of(cast));
            *out = static_cast<float>(
                mean ? average : (average - cast.zero) * weight * cast.step * cast.unit);
        }
    };

 private:
    /// Integers of up to 16 bits sum up without such a loss.
    static float origin_of(const RayCast& cast) {
        return kFinite ? 0 : origin_of_sums(cast.rule, cast.volume.values, cast.zero);
    }
    /// Blocks end at the same cells for every ray, whoever its neighbours in the packet are.
    HWY_INLINE void close_block(int cell) {
        if ((cell & (kBlock - 1)) != 0) return;
        total_ = hn::Add(total_, block_);
        block_ = hn::Zero(DF());
    }
    VF total_, block_, length_, origin_;
};

/// What front-to-back compositing keeps of rays; kColors = 1 where red, green and blue are one.
template <int kColors>
class OverState {
 public:
    static constexpr int kChannels = 4;
    static constexpr bool kSkips = true, kAnyOrder = false;

    explicit OverState(const RayCast& cast)
        : left_(hn::Set(DF(), 1.0f)), bound_(hn::Set(DF(), static_cast<float>(cast.bound))) {
        for (VF& light : light_) light = hn::Zero(DF());
    }
    HWY_INLINE bool alive() const { return !hn::AllFalse(DF(), hn::Gt(left_, hn::Zero(DF()))); }
    HWY_INLINE bool needs(VF opacity) const {
        return !hn::AllFalse(DF(), hn::Gt(hn::Min(opacity, left_), hn::Zero(DF())));
    }

    struct Lanewise {
        HWY_ALIGN float light[kColors][kLanes], left[kLanes];

        explicit Lanewise(const OverState& state) {
            for (int c = 0; c < kColors; ++c) hn::Store(state.light_[c], DF(), light[c]);
            hn::Store(state.left_, DF(), left);
        }
        void write(const RayCast&, int lane, bool hit, double, float* out) const {
            for (int c = 0; c < 3; ++c) out[c] = hit ? light[c % kColors][lane] : 0.0f;
            out[3] = hit ? 1.0f - left[lane] : 0.0f;
        }
    };

 protected:
    /// @param light  that a sample sends, not premultiplied
    HWY_INLINE void composite(const VF (&light)[kColors], VF opacity) {
        const VF caught = hn::Mul(left_, opacity);
        for (int c = 0; c < kColors; ++c) light_[c] = hn::MulAdd(caught, light[c], light_[c]);
        left_ = hn::Sub(left_, caught);
        // A ray ends by itself, never because its packet does: tiles must not show.
        left_ = hn::IfThenElseZero(hn::Ge(left_, bound_), left_);
    }

 private:
    VF light_[kColors], left_, bound_;
};

/// What opacities become in whole cells, all of one length: 1 - (1 - a)^power. Steps are mostly
/// powers of two: then each doubling is a (2 - a), and each halving a / (1 + sqrt(1 - a)), without
/// cancellation.
class WholeCells {
 public:
    explicit WholeCells(const RayCast& cast)
        : power_(static_cast<float>(cast.step / cast.optics->unit)) {
        constexpr int kMost = 4;  // beyond, it takes no less than any other power
        int exponent = 0;
        const bool is_power_of_two = std::frexp(power_, &exponent) == 0.5f;
        doublings_ = exponent - 1;
        are_few_ = is_power_of_two && std::abs(doublings_) <= kMost;
    }

    /// Opacities stay as they are.
    bool are_units() const { return power_ == 1; }
    HWY_INLINE VF operator()(VF opacity) const {
        const DF d;
        if (!are_few_) return corrected(opacity, hn::Set(d, power_));
        const VF one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
        for (int i = 0; i < doublings_; ++i) opacity = hn::Mul(opacity, hn::Sub(two, opacity));
        for (int i = doublings_; i < 0; ++i)
            opacity = hn::Div(opacity, hn::Add(one, hn::Sqrt(hn::Sub(one, opacity))));
        return opacity;
    }
    /// In parts of cells; a part that is all of a cell gives what a whole one does, to the last
    /// bit: which of them it is hangs on the rays beside it.
    HWY_INLINE VF operator()(VF opacity, VF weight) const {
        const DF d;
        const VF part = corrected(opacity, hn::Mul(weight, hn::Set(d, power_)));
        return hn::IfThenElse(hn::Eq(weight, hn::Set(d, 1.0f)), (*this)(opacity), part);
    }

 private:
    float power_;
    int doublings_ = 0;
    bool are_few_ = false;
};

/// Front-to-back compositing.
template <bool kFinite, int kColors>
class OverSum : public OverState<kColors> {
 public:
    explicit OverSum(const RayCast& cast)
        : OverState<kColors>(cast), optics_(*cast.optics), cells_(cast), taken_(cast.taken) {}

    HWY_INLINE void add(VF value, int) {
        VF color[kColors], opacity = look_up<kColors>(optics_, value, color);
        if (!cells_.are_units()) {
            if (!this->needs(opacity)) return;
            if (taken_) taken_->corrected += kLanes;
            opacity = cells_(opacity);
        }
        this->composite(color, finite(value, opacity));
    }
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int) {
        VF color[kColors], opacity = look_up<kColors>(optics_, value, color);
        if (taken_) taken_->ends += kLanes;
        if (!this->needs(opacity)) return;
        if (taken_) taken_->corrected_ends += kLanes;
        opacity = cells_(opacity, weight);
        this->composite(color, finite(value, hn::IfThenZeroElse(outside, opacity)));
    }

 private:
    HWY_INLINE VF finite(VF value, VF opacity) const {
        if constexpr (kFinite) return opacity;
        return hn::IfThenElseZero(is_finite(value), opacity);
    }

    const Optics& optics_;
    WholeCells cells_;
    Taken* taken_;
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
