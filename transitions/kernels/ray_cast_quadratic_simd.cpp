// Ray casting: compositing of pieces along which the value is a quadratic.
#include "transitions/kernels/ray_cast_quadratures.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_quadratic_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// A cast with the table that its pieces read: rules are made of a cast alone.
struct QuadraticCast : RayCast {
    const TransferSums& sums;
};

template <bool kNumbers>
class QuadraticSum : public OverState<3>, public InOrder<QuadraticSum<kNumbers>> {
 public:
    static constexpr bool kFinite = kNumbers;
    static constexpr bool kPieces = true;

    explicit QuadraticSum(const RayCast& cast)
        : OverState<3>(cast),
          cast_(cast),
          sums_(static_cast<const QuadraticCast&>(cast).sums),
          before_(reach(hn::Zero(DF()))),
          before_at_(hn::Zero(DF())) {
        before_.known = hn::Zero(DF());
    }
    void aim(const Packet& packet, double, double) { this->begin(packet); }
    const RayCast& cast() const { return cast_; }

 private:
    friend class InOrder<QuadraticSum>;

    /// A stored number and the integrals up to it: a knot, and what lies beyond it.
    struct Reached {
        VF known;  // 1, or 0 where a value is not finite
        VF number;
        VI knots[4];
        VF beyond[4];
    };
    /// Optical depth per t, and the same times red, green and blue.
    struct Rates {
        VF of[4];
    };
    /// A half of a piece.
    struct Half {
        VF depth, color[3];
    };

    HWY_INLINE Reached reach(VF value) const {
        const DF d;
        const DI di;
        Reached reached;
        const MF good = is_finite(value);
        reached.known = hn::IfThenElseZero(good, hn::Set(d, 1.0f));
        reached.number = hn::IfThenElseZero(good, value);
        // What lies beyond all knots goes on evenly, however far.
        const VF far = hn::Set(d, 1e25f);
        const VF knot =
            hn::Mul(hn::Sub(reached.number, hn::Set(d, sums_.first)), hn::Set(d, sums_.per_number));
        const VF at = hn::Min(hn::Max(knot, hn::Neg(far)), far);
        const VF last = hn::Set(d, static_cast<float>(TransferSums::kCells - 1));
        const VI cell = truncated(hn::Min(hn::Max(at, hn::Zero(d)), last));
        const VF share = hn::Sub(at, hn::ConvertTo(d, cell));
        const std::int32_t* const knots = sums_.knots[0].data();
        const float* const slopes = sums_.slopes[0].data();
        const VI first = hn::ShiftLeft<2>(cell);
        for (int c = 0; c < 4; ++c) {
            const VI place = hn::Add(first, hn::Set(di, c));
            reached.knots[c] = hn::GatherIndex(di, knots, place);
            reached.beyond[c] = hn::Mul(share, hn::GatherIndex(d, slopes, place));
        }
        return reached;
    }
    static HWY_INLINE void choose(MF mask, const Reached& from, Reached& to) {
        to.known = hn::IfThenElse(mask, from.known, to.known);
        to.number = hn::IfThenElse(mask, from.number, to.number);
        for (int c = 0; c < 4; ++c) {
            to.knots[c] = hn::IfThenElse(hn::RebindMask(DI(), mask), from.knots[c], to.knots[c]);
            to.beyond[c] = hn::IfThenElse(mask, from.beyond[c], to.beyond[c]);
        }
    }
    HWY_INLINE void begin_at(MF mask, VF value, VF at) {
        choose(mask, reach(value), before_);
        before_at_ = hn::IfThenElse(mask, at, before_at_);
    }

    /// At a number itself.
    HWY_NOINLINE Rates rates_at(VF number) const {
        constexpr float kOpaque = 1e6f;  // nothing is left of any length
        const DF d;
        const VF one = hn::Set(d, 1.0f);
        VF color[3];
        const VF opacity = look_up<3>(*cast_.optics, number, color);
        const MF opaque = hn::Ge(opacity, one);
        const VF depth = hn::Neg(hn::Log1p(d, hn::IfThenZeroElse(opaque, hn::Neg(opacity))));
        Rates rates;
        rates.of[0] = hn::Mul(hn::IfThenElse(opaque, hn::Set(d, kOpaque), depth),
                              hn::Set(d, static_cast<float>(1 / cast_.optics->unit)));
        for (int c = 0; c < 3; ++c) rates.of[c + 1] = hn::Mul(rates.of[0], color[c]);
        return rates;
    }
    /// Means along a chord from one number to another.
    HWY_INLINE Rates along(const Reached& from, const Reached& to) const {
        const DF d;
        const VF apart = hn::Sub(to.number, from.number);
        // Of numbers so close the middle one stands for all.
        const MF close = hn::Lt(hn::Abs(apart), hn::Set(d, 2 * sums_.width));
        const VF inverse =
            hn::Div(hn::Set(d, sums_.scale), hn::IfThenElse(close, hn::Set(d, 1.0f), apart));
        Rates means;
        for (int c = 0; c < 4; ++c) {
            const VF knots = hn::ConvertTo(d, hn::Sub(to.knots[c], from.knots[c]));
            const VF all = hn::Add(knots, hn::Sub(to.beyond[c], from.beyond[c]));
            means.of[c] = hn::Max(hn::Zero(d), hn::Mul(all, inverse));
        }
        if (hn::AllFalse(d, close)) return means;
        const Rates middle = rates_at(hn::MulAdd(hn::Set(d, 0.5f), apart, from.number));
        for (int c = 0; c < 4; ++c) means.of[c] = hn::IfThenElse(close, middle.of[c], means.of[c]);
        return means;
    }
    /// @param between  the quadratic's value in the middle of the half
    HWY_NOINLINE Half half_of(const Reached& from, VF between, const Reached& to, VF length) const {
        const DF d;
        const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
        const Reached middle = reach(between);
        const Rates whole = along(from, to), first = along(from, middle), last = along(middle, to);
        Rates mean, change;
        for (int c = 0; c < 4; ++c) {
            mean.of[c] = hn::Mul(half, hn::Add(first.of[c], last.of[c]));
            change.of[c] = hn::Sub(mean.of[c], whole.of[c]);
        }
        // Where chords are far from the quadratic, both means may have little in common.
        const VF twice = hn::Max(hn::Mul(hn::Set(d, 2.0f), hn::Abs(change.of[0])),
                                 hn::Set(d, std::numeric_limits<float>::min()));
        const VF third = hn::Min(hn::Set(d, 1.0f / 3), hn::Div(mean.of[0], twice));
        for (int c = 0; c < 4; ++c)
            mean.of[c] = hn::Max(zero, hn::MulAdd(third, change.of[c], mean.of[c]));
        const MF some = hn::Gt(mean.of[0], zero);
        const VF inverse = hn::Div(one, hn::IfThenElse(some, mean.of[0], one));
        Half made;
        made.depth = hn::Max(zero, hn::Mul(mean.of[0], length));
        for (int c = 0; c < 3; ++c) made.color[c] = hn::Min(hn::Mul(mean.of[c + 1], inverse), one);
        return made;
    }

    /// How much nearer to its front than to its middle what is seen of a medium lies, as a share of
    /// the way: coth(depth / 2) - 2 / depth, where `caught` is 1 - exp(-depth).
    static HWY_INLINE VF nearer(VF depth, VF caught) {
        const DF d;
        const VF one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
        const VF square = hn::Mul(depth, depth);
        VF series = hn::Set(d, -1.0f / 604800);  // of depth below 1: to 2^-24
        for (const float term : {1.0f / 15120, -1.0f / 360, 1.0f / 6})
            series = hn::MulAdd(series, square, hn::Set(d, term));
        const MF small = hn::Lt(depth, one);
        const VF closed = hn::Sub(hn::Div(two, hn::IfThenElse(small, one, caught)),
                                  hn::Add(one, hn::Div(two, hn::IfThenElse(small, one, depth))));
        return hn::IfThenElse(small, hn::Mul(series, depth), closed);
    }

    template <class At>
    HWY_NOINLINE void take(VF value, VF at, MF outside, const At& spot) {
        const DF d;
        const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f),
                 quarter = hn::Set(d, 0.25f);
        const Reached now = reach(value);
        const VF cells = hn::Sub(at, before_at_);
        const Reached middle = reach(spot.value_at(hn::MulAdd(half, cells, before_at_)));
        // How far the quadratic goes beyond chords of half a piece, in their middles.
        const VF a = before_.number, m = middle.number, b = now.number;
        const VF bow = hn::Mul(quarter, hn::Sub(m, hn::Mul(half, hn::Add(a, b))));
        const VF length = hn::Mul(cells, hn::Set(d, static_cast<float>(0.5 * cast_.step)));
        Half halves[2] = {half_of(before_, hn::MulAdd(half, hn::Add(a, m), bow), middle, length),
                          half_of(middle, hn::MulAdd(half, hn::Add(m, b), bow), now, length)};

        // The colour's slope over the optical depth, which two even halves tell: less where not.
        const VF depth = hn::Add(halves[0].depth, halves[1].depth);
        const VF inverse = hn::Div(one, hn::IfThenElse(hn::Gt(depth, zero), depth, one));
        const VF shares[2] = {hn::Mul(halves[0].depth, inverse), hn::Mul(halves[1].depth, inverse)};
        const VF even = hn::Mul(hn::Set(d, 4.0f), hn::Mul(shares[0], shares[1]));
        VF slope[3];
        for (int c = 0; c < 3; ++c)
            slope[c] = hn::Mul(even, hn::Sub(halves[1].color[c], halves[0].color[c]));
        const VF known = hn::Mul(before_.known, hn::Mul(middle.known, now.known));
        for (int h = 0; h < 2; ++h) {
            const VF most = hn::Max(hn::Neg(halves[h].depth), hn::Set(d, -80.0f));
            const VF caught = hn::Neg(hn::Expm1(d, most));
            const VF way = hn::Mul(shares[h], nearer(halves[h].depth, caught));
            VF light[3];
            for (int c = 0; c < 3; ++c) {
                const VF seen = hn::NegMulAdd(way, slope[c], halves[h].color[c]);
                light[c] = hn::Min(hn::Max(seen, zero), one);
            }
            composite(light, hn::IfThenZeroElse(outside, hn::Mul(known, caught)));
        }
        choose(hn::Not(outside), now, before_);
        before_at_ = hn::IfThenElse(outside, before_at_, at);
    }

    const RayCast& cast_;
    const TransferSums& sums_;
    Reached before_;
    VF before_at_;
};

void cast_tile_quadratic(const RayCast& cast, const TransferSums& sums, std::int64_t x,
                         std::int64_t y, std::int64_t width, std::int64_t height, float* out,
                         std::ptrdiff_t row_floats) {
    const QuadraticCast both{cast, sums};
    cast_tile<QuadraticSum>({both, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_quadratic);

void ray_cast_quadratic(const RayCast& cast, const TransferSums& sums, std::int64_t x,
                        std::int64_t y, std::int64_t width, std::int64_t height, float* out,
                        std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_quadratic)(cast, sums, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
