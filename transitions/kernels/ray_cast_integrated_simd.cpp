// Ray casting: compositing of pieces between samples, whose transfer function is integrated.
#include "transitions/kernels/ray_cast_tiles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_integrated_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"
#include "transitions/kernels/transfer_integrals.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// A piece from each sample to the next one, and from where a ray enters and leaves to its first
/// and last sample.
template <bool kNumbers>
class PieceSum {
 public:
    static constexpr bool kFinite = kNumbers;
    static constexpr int kChannels = 4;
    static constexpr bool kSkips = true, kAnyOrder = false, kPieces = true;

    explicit PieceSum(const RayCast& cast)
        : cast_(cast),
          integrals_(*cast.integrals),
          left_(hn::Set(DF(), 1.0f)),
          bound_(hn::Set(DF(), static_cast<float>(cast.bound))),
          step_(hn::Set(DF(), static_cast<float>(cast.step))),
          before_at_(hn::Zero(DF())) {
        for (VF& light : light_) light = hn::Zero(DF());
        before_.number = hn::Set(DF(), std::numeric_limits<float>::quiet_NaN());
        for (VF& sum : before_.sums) sum = hn::Zero(DF());
        first_ = last_ = hn::FirstN(DF(), 0);
    }
    void aim(const Packet& packet, double, double) { next_ = packet.begin; }
    void ends(MF first, MF last) {
        first_ = first;
        last_ = last;
    }
    const RayCast& cast() const { return cast_; }

    template <class At>
    HWY_INLINE void add(VF value, int cell, const At& spot) {
        const MF none = hn::FirstN(DF(), 0);
        if (cell != next_) begin_anew(none, spot);
        take(value, spot.offset, none);
        next_ = cell + 1;
    }
    template <class At>
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int cell, const At& spot) {
        const VF half = hn::Mul(hn::Set(DF(), 0.5f), weight);
        if (cell != next_) begin_anew(hn::Or(first_, outside), spot);
        if (!hn::AllFalse(DF(), first_)) {
            const VF enters = hn::Sub(spot.offset, half);
            begin_at(first_, spot.value_at(enters), enters);
        }
        take(value, spot.offset, outside);
        if (!hn::AllFalse(DF(), last_)) {
            const VF leaves = hn::Add(spot.offset, half);
            take(spot.value_at(leaves), leaves, hn::Not(last_));
        }
        next_ = cell + 1;
    }
    HWY_INLINE bool alive() const { return !hn::AllFalse(DF(), hn::Gt(left_, hn::Zero(DF()))); }
    HWY_INLINE bool needs(VF opacity) const {
        return !hn::AllFalse(DF(), hn::Gt(hn::Min(opacity, left_), hn::Zero(DF())));
    }

    struct Lanewise {
        HWY_ALIGN float light[3][kLanes], left[kLanes];

        explicit Lanewise(const PieceSum& sum) {
            for (int c = 0; c < 3; ++c) hn::Store(sum.light_[c], DF(), light[c]);
            hn::Store(sum.left_, DF(), left);
        }
        void write(const RayCast&, int lane, bool hit, double, float* out) const {
            for (int c = 0; c < 3; ++c) out[c] = hit ? light[c][lane] : 0.0f;
            out[3] = hit ? 1.0f - left[lane] : 0.0f;
        }
    };

 private:
    /// A stored number and the integrals up to it.
    struct Reached {
        VF number, sums[4];
    };

    HWY_INLINE Reached reach(VF number) const {
        const DF d;
        const DI di;
        const VF at = hn::Mul(hn::Sub(number, hn::Set(d, integrals_.first)),
                              hn::Set(d, integrals_.per_number));
        const VF last = hn::Set(d, static_cast<float>(TransferIntegrals::kCells - 1));
        const VI cell = truncated(hn::Min(hn::Max(at, hn::Zero(d)), last));
        const VF share = hn::Sub(at, hn::ConvertTo(d, cell));
        const float* const knots = integrals_.knots[0].data();
        const VI place = hn::ShiftLeft<2>(cell);
        Reached reached;
        reached.number = number;
        for (int c = 0; c < 4; ++c) {
            const VF a = hn::GatherIndex(d, knots, hn::Add(place, hn::Set(di, c))),
                     b = hn::GatherIndex(d, knots, hn::Add(place, hn::Set(di, 4 + c)));
            reached.sums[c] = between(a, b, share);
        }
        return reached;
    }
    static HWY_INLINE void choose(MF mask, const Reached& from, Reached& to) {
        to.number = hn::IfThenElse(mask, from.number, to.number);
        for (int c = 0; c < 4; ++c) to.sums[c] = hn::IfThenElse(mask, from.sums[c], to.sums[c]);
    }
    HWY_INLINE void begin_at(MF mask, VF value, VF at) {
        choose(mask, reach(value), before_);
        before_at_ = hn::IfThenElse(mask, at, before_at_);
    }
    /// After a stretch that was left out: the sample before this one.
    template <class At>
    HWY_NOINLINE void begin_anew(MF kept, const At& spot) {
        const VF at = hn::Sub(spot.offset, hn::Set(DF(), 1.0f));
        begin_at(hn::Not(kept), spot.value_at(at), at);
    }

    HWY_INLINE void take(VF value, VF at, MF outside) {
        const DF d;
        const VF zero = hn::Zero(d);
        const Reached now = reach(value);
        // Of numbers so close the difference of the integrals is mostly rounding: there the
        // function is taken as it is between them.
        const VF apart = hn::Sub(now.number, before_.number);
        const MF close = hn::Lt(hn::Abs(apart), hn::Set(d, 2 * integrals_.width));
        VF depth = hn::Sub(now.sums[0], before_.sums[0]);
        const VF inverse =
            hn::Div(hn::Set(d, 1.0f), hn::IfThenElse(hn::Eq(depth, zero), hn::Set(d, 1.0f), depth));
        VF color[3];
        for (int c = 0; c < 3; ++c)
            color[c] = hn::Mul(hn::Sub(now.sums[c + 1], before_.sums[c + 1]), inverse);
        depth = hn::Div(depth, hn::IfThenElse(close, hn::Set(d, 1.0f), apart));
        VF middle[3];
        const VF between_them = hn::MulAdd(hn::Set(d, 0.5f), apart, before_.number);
        const VF opacity = look_up<3>(*cast_.optics, between_them, middle);
        const VF length = hn::Mul(step_, hn::Sub(at, before_at_));
        // 1 - exp(-depth length), or of an opacity that of its length.
        const VF whole = hn::Max(zero, hn::Mul(depth, length));
        const VF by_depth = hn::Neg(hn::Expm1(d, hn::Max(hn::Neg(whole), hn::Set(d, -80.0f))));
        const VF by_opacity =
            corrected(opacity, hn::Div(length, hn::Set(d, static_cast<float>(cast_.optics->unit))));
        VF caught = hn::IfThenElse(close, by_opacity, by_depth);
        caught = hn::IfThenZeroElse(outside, caught);
        const MF good = hn::And(is_finite(now.number), is_finite(before_.number));
        caught = hn::Mul(left_, hn::IfThenElseZero(good, caught));
        for (int c = 0; c < 3; ++c) {
            const VF mean = hn::Min(hn::Max(hn::IfThenElse(close, middle[c], color[c]), zero),
                                    hn::Set(d, 1.0f));
            light_[c] = hn::MulAdd(caught, mean, light_[c]);
        }
        left_ = hn::Sub(left_, caught);
        left_ = hn::IfThenElseZero(hn::Ge(left_, bound_), left_);
        choose(hn::Not(outside), now, before_);
        before_at_ = hn::IfThenElse(outside, before_at_, at);
    }

    const RayCast& cast_;
    const TransferIntegrals& integrals_;
    VF light_[3], left_, bound_, step_, before_at_;
    Reached before_;
    MF first_, last_;
    int next_ = 0;
};

void cast_tile_integrated(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                          std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<PieceSum>({cast, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_integrated);

void ray_cast_integrated(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_integrated)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
