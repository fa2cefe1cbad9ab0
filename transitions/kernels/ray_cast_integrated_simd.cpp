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
class PieceSum : public OverState<3>, public InOrder<PieceSum<kNumbers>> {
 public:
    static constexpr bool kFinite = kNumbers;
    static constexpr bool kPieces = true;

    explicit PieceSum(const RayCast& cast)
        : OverState<3>(cast),
          cast_(cast),
          integrals_(*cast.integrals),
          step_(hn::Set(DF(), static_cast<float>(cast.step))),
          before_at_(hn::Zero(DF())) {
        before_.number = hn::Set(DF(), std::numeric_limits<float>::quiet_NaN());
        for (VF& sum : before_.sums) sum = hn::Zero(DF());
    }
    void aim(const Packet& packet, double, double) { this->begin(packet); }
    const RayCast& cast() const { return cast_; }

 private:
    friend class InOrder<PieceSum>;

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
    template <class At>
    HWY_INLINE void take(VF value, VF at, MF outside, const At&) {
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
        VF light[3];
        for (int c = 0; c < 3; ++c)
            light[c] = hn::Min(hn::Max(hn::IfThenElse(close, middle[c], color[c]), zero),
                               hn::Set(d, 1.0f));
        composite(light, hn::IfThenElseZero(good, caught));
        choose(hn::Not(outside), now, before_);
        before_at_ = hn::IfThenElse(outside, before_at_, at);
    }

    const RayCast& cast_;
    const TransferIntegrals& integrals_;
    VF step_, before_at_;
    Reached before_;
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
