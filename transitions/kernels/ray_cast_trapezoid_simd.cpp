// Ray casting: compositing by the trapezoidal rule.
#include "transitions/kernels/ray_cast_quadratures.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_trapezoid_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

template <bool kNumbers>
class TrapezoidSum : public OverState<3>, public InOrder<TrapezoidSum<kNumbers>> {
 public:
    static constexpr bool kFinite = kNumbers;
    static constexpr bool kPieces = true;

    explicit TrapezoidSum(const RayCast& cast)
        : OverState<3>(cast),
          cast_(cast),
          half_cell_(hn::Set(DF(), static_cast<float>(0.5 * cast.step / cast.optics->unit))),
          before_(reach(hn::Zero(DF()))),
          before_at_(hn::Zero(DF())) {
        before_.known = hn::Zero(DF());
    }
    void aim(const Packet& packet, double, double) { this->begin(packet); }
    const RayCast& cast() const { return cast_; }

 private:
    friend class InOrder<TrapezoidSum>;

    /// The function at one end of a piece.
    struct Reached {
        VF known;  // 1, or 0 where a value is not finite
        VF depth;  // optical, per unit of the opacities
        VF color[3];
    };

    HWY_INLINE Reached reach(VF value) const {
        constexpr float kOpaque = 1e6f;  // nothing is left of any length, and no colour beside it
        const DF d;
        const VF one = hn::Set(d, 1.0f);
        const MF good = is_finite(value);
        Reached reached;
        reached.known = hn::IfThenElseZero(good, one);
        const VF opacity =
            look_up<3>(*cast_.optics, hn::IfThenElseZero(good, value), reached.color);
        const MF opaque = hn::Ge(opacity, one);
        const VF depth = hn::Neg(hn::Log1p(d, hn::IfThenZeroElse(opaque, hn::Neg(opacity))));
        reached.depth = hn::IfThenElse(opaque, hn::Set(d, kOpaque), depth);
        return reached;
    }
    static HWY_INLINE void choose(MF mask, const Reached& from, Reached& to) {
        to.known = hn::IfThenElse(mask, from.known, to.known);
        to.depth = hn::IfThenElse(mask, from.depth, to.depth);
        for (int c = 0; c < 3; ++c) to.color[c] = hn::IfThenElse(mask, from.color[c], to.color[c]);
    }
    HWY_INLINE void begin_at(MF mask, VF value, VF at) {
        choose(mask, reach(value), before_);
        before_at_ = hn::IfThenElse(mask, at, before_at_);
    }
    template <class At>
    HWY_NOINLINE void take(VF value, VF at, MF outside, const At&) {
        const DF d;
        const VF zero = hn::Zero(d);
        const Reached now = reach(value);
        const VF half = hn::Mul(half_cell_, hn::Sub(at, before_at_));
        const VF both = hn::Add(before_.depth, now.depth);
        const VF some = hn::IfThenElse(hn::Gt(both, zero), both, hn::Set(d, 1.0f));
        const VF share = hn::Div(now.depth, some);
        const VF whole = hn::Max(zero, hn::Mul(both, half));
        const VF caught = hn::Neg(hn::Expm1(d, hn::Max(hn::Neg(whole), hn::Set(d, -80.0f))));
        VF light[3];
        for (int c = 0; c < 3; ++c) light[c] = between(before_.color[c], now.color[c], share);
        const VF known = hn::Mul(before_.known, now.known);
        composite(light, hn::IfThenZeroElse(outside, hn::Mul(known, caught)));
        choose(hn::Not(outside), now, before_);
        before_at_ = hn::IfThenElse(outside, before_at_, at);
    }

    const RayCast& cast_;
    VF half_cell_;
    Reached before_;
    VF before_at_;
};

void cast_tile_trapezoid(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<TrapezoidSum>({cast, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_trapezoid);

void ray_cast_trapezoid(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                        std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_trapezoid)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
