// Ray casting: the first place where the field passes a level, and integrals whose light falls off.
#include "transitions/kernels/ray_cast_tiles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_hit_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// The first crossing of the level, found between samples and lit there.
template <bool kNumbers>
class HitSum : public InOrder<HitSum<kNumbers>> {
 public:
    static constexpr bool kFinite = kNumbers;
    static constexpr int kChannels = 4;
    static constexpr bool kSkips = true, kAnyOrder = false;

    explicit HitSum(const RayCast& cast)
        : cast_(cast),
          sign_(hn::Set(DF(), cast.volume.values.slope < 0 ? -0.0f : 0.0f)),
          level_(hn::Set(DF(), stored_level(cast))),
          open_(hn::Set(DF(), 1.0f)),
          light_(hn::Zero(DF())),
          before_(hn::Set(DF(), std::numeric_limits<float>::quiet_NaN())),
          before_at_(hn::Zero(DF())) {
        for (VF& axis : eye_) axis = hn::Zero(DF());
    }
    void aim(const Packet& packet, double x, double y) {
        aim_at_eye(cast_, x, y, eye_);
        if (cast_.cue) fading_ = fading_of(cast_, packet, x, y);
        this->begin(packet);
    }
    const RayCast& cast() const { return cast_; }

    HWY_INLINE bool alive() const { return !hn::AllFalse(DF(), is_open()); }
    /// Where all that lies ahead is below the level, only rays that are above it may cross it.
    HWY_INLINE bool needs(VF level) const {
        const VF zero = hn::Zero(DF());
        const MF reaches = hn::Ge(hn::Sub(level, hn::Xor(level_, sign_)), zero);
        return !hn::AllFalse(DF(), hn::And(is_open(), hn::Or(reaches, hn::Ge(before_, zero))));
    }

    struct Lanewise {
        HWY_ALIGN float light[kLanes], open[kLanes];

        explicit Lanewise(const HitSum& sum) {
            hn::Store(sum.light_, DF(), light);
            hn::Store(sum.open_, DF(), open);
        }
        void write(const RayCast&, int lane, bool hit, double, float* out) const {
            for (int c = 0; c < 3; ++c) out[c] = hit ? light[lane] : 0.0f;
            out[3] = hit ? 1.0f - open[lane] : 0.0f;
        }
    };

 private:
    friend class InOrder<HitSum>;

    static float stored_level(const RayCast& cast) {
        return RayRule::Setting{.values = cast.volume.values, .level = cast.level}.stored_level();
    }
    HWY_INLINE MF is_open() const { return hn::Gt(open_, hn::Zero(DF())); }
    /// Stored numbers, less the level's; turned round where the slope is negative.
    HWY_INLINE VF above(VF stored) const { return hn::Xor(hn::Sub(stored, level_), sign_); }

    HWY_INLINE void begin_at(MF mask, VF value, VF at) {
        before_ = hn::IfThenElse(mask, above(value), before_);
        before_at_ = hn::IfThenElse(mask, at, before_at_);
    }
    HWY_INLINE MF is_passed(VF a, VF b) const {
        const VF zero = hn::Zero(DF());
        const MF both = hn::Or(hn::And(hn::Lt(a, zero), hn::Ge(b, zero)),
                               hn::And(hn::Ge(a, zero), hn::Lt(b, zero)));
        if constexpr (kFinite) return both;  // no number before: none of these
        return hn::And(both, hn::And(is_finite(a), is_finite(b)));
    }
    template <class At>
    HWY_INLINE void take(VF value, VF at, MF outside, const At& spot) {
        const VF now = above(value);
        const MF hits = hn::AndNot(outside, hn::And(is_open(), is_passed(before_, now)));
        if (!hn::AllFalse(DF(), hits)) hit(hits, now, at, spot);
        before_ = hn::IfThenElse(outside, before_, now);
        before_at_ = hn::IfThenElse(outside, before_at_, at);
    }
    /// Between two places on either side of the level: inverse quadratic interpolation where three
    /// values are nearly those of a parabola, else bisection. It also ends where a ray hardly
    /// touches the surface, where false position takes more steps than bisection. Where the field
    /// jumps, that is the first place behind the jump. Source: Chandrupatla, Advances in
    /// Engineering Software 28, 1997
    template <class At>
    HWY_NOINLINE VF root_between(MF hits, VF a, VF above_a, VF b, VF above_b,
                                 const At& spot) const {
        constexpr int kMost = 48;  // bisection of half a sample to the last place of f32 takes 24
        const DF d;
        const VF zero = hn::Zero(d), half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f);
        const MF behind = hn::Ge(above_b, zero);
        // b is the last place, a lies across the level, c is the one before.
        VF c = a, above_c = above_a, share = hn::Div(above_b, hn::Sub(above_b, above_a));
        MF open = hits;
        for (int i = 0; i < kMost && !hn::AllFalse(d, open); ++i) {
            // Other lanes read where they have read: nothing else is known to lie in the volume.
            const VF between = hn::MulAdd(share, hn::Sub(a, b), b);
            const VF tried = hn::IfThenElse(hn::And(open, is_finite(between)), between, b);
            const VF there = above(spot.value_at(tried));
            open = hn::And(open, is_finite(there));
            const MF stays = hn::Xor(hn::Ge(there, zero), hn::Lt(above_b, zero));
            const MF turns = hn::AndNot(stays, open);
            c = hn::IfThenElse(open, hn::IfThenElse(stays, b, a), c);
            above_c = hn::IfThenElse(open, hn::IfThenElse(stays, above_b, above_a), above_c);
            a = hn::IfThenElse(turns, b, a);
            above_a = hn::IfThenElse(turns, above_b, above_a);
            b = hn::IfThenElse(open, tried, b);
            above_b = hn::IfThenElse(open, there, above_b);
            // Two units in the last place of f32, and no less than a shift that changes no light.
            const VF within = hn::MulAdd(hn::Abs(b), hn::Set(d, 0x1p-22f), hn::Set(d, 0x1p-20f));
            const VF width = hn::Abs(hn::Sub(a, b)), least = hn::Div(within, width);
            open = hn::And(open, hn::And(hn::Ne(above_b, zero), hn::Lt(least, half)));
            const VF xi = hn::Div(hn::Sub(b, a), hn::Sub(c, a));
            const VF phi = hn::Div(hn::Sub(above_b, above_a), hn::Sub(above_c, above_a));
            const VF rest = hn::Sub(one, phi);
            const MF smooth = hn::And(hn::Lt(hn::Mul(phi, phi), xi),
                                      hn::Lt(hn::Mul(rest, rest), hn::Sub(one, xi)));
            const VF by_a = hn::Mul(hn::Div(above_b, hn::Sub(above_a, above_b)),
                                    hn::Div(above_c, hn::Sub(above_a, above_c)));
            const VF by_c = hn::Mul(hn::Mul(hn::Div(hn::Sub(c, b), hn::Sub(a, b)),
                                            hn::Div(above_b, hn::Sub(above_c, above_b))),
                                    hn::Div(above_a, hn::Sub(above_c, above_a)));
            share = hn::IfThenElse(smooth, hn::Add(by_a, by_c), half);
            share = hn::Min(hn::Max(share, least), hn::Sub(one, least));
        }
        const MF before = hn::Xor(hn::Ge(above_b, zero), behind);
        return hn::IfThenElse(hn::And(before, hn::Ne(above_b, zero)), a, b);
    }
    template <class At>
    HWY_NOINLINE void hit(MF hits, VF above_b, VF b, const At& spot) {
        const DF d;
        const VF zero = hn::Zero(d);
        const VF where = root_between(hits, before_at_, before_, b, above_b, spot);
        VF diffuse = hn::Set(d, 1.0f), specular = zero;
        if (cast_.light) {
            VF slope[3] = {zero, zero, zero};
            if (cast_.light->by != Shade::particles)
                spot.gradient_at(where, spot.value_at(where), slope);
            light_on(*cast_.light, slope, eye_, ArrivingLanes(), diffuse, specular);
        }
        VF light = hn::Add(diffuse, specular);
        if (cast_.cue) light = hn::Mul(light, fading_.at(where));
        light_ = hn::IfThenElse(hits, light, light_);
        open_ = hn::IfThenZeroElse(hits, open_);
    }

    const RayCast& cast_;
    VF sign_, level_, open_, light_, before_, before_at_, eye_[3];
    Fading fading_ = {};
};

/// Integral and mean of samples under light, or faded by depth.
template <bool>
class LitLine : public LineSum<false> {
 public:
    static constexpr bool kFinite = false;

    explicit LitLine(const RayCast& cast)
        : LineSum<false>(cast), cast_(cast), none_(hn::Set(DF(), stored_none(cast))) {
        const double slope = cast.volume.values.slope;
        if (cast.light) ambient_ = hn::Set(DF(), cast.light->ambient);
        per_value_ = hn::Set(DF(), slope == 0 ? 0.0f : static_cast<float>(1 / slope));
    }
    void aim(const Packet& packet, double x, double y) {
        if (cast_.cue) fading_ = fading_of(cast_, packet, x, y);
    }
    const RayCast& cast() const { return cast_; }

    template <class At>
    HWY_INLINE void add(VF value, int cell, const At& spot) {
        LineSum<false>::add(lit(value, spot), cell);
    }
    template <class At>
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int cell, const At& spot) {
        LineSum<false>::add_part(lit(value, spot), weight, outside, cell);
    }

 private:
    /// The stored number of no light: the one that adds nothing, or of a mean 0.
    static float stored_none(const RayCast& cast) {
        const ValueMap& values = cast.volume.values;
        if (values.slope == 0) return 0;
        const double none = cast.rule == Combine::sum ? cast.zero : 0;
        return static_cast<float>((none - values.offset) / values.slope);
    }
    template <class At>
    HWY_INLINE VF lit(VF value, const At& spot) const {
        VF above = hn::Sub(value, none_);
        if (cast_.light) {
            VF slope[3];
            spot.gradient_at(spot.offset, value, slope);
            above = hn::MulAdd(ambient_, above, hn::Mul(added_by(*cast_.light, slope), per_value_));
        }
        if (cast_.cue) above = hn::Mul(above, fading_.at(spot.offset));
        return hn::Add(above, none_);
    }

    const RayCast& cast_;
    VF none_, ambient_ = hn::Set(DF(), 1.0f), per_value_;
    Fading fading_ = {};
};

void cast_tile_hit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                   std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<HitSum>({cast, x, y, width, height, out, row_floats});
}
void cast_tile_lit_line(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                        std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<LitLine>({cast, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_hit);
HWY_EXPORT(cast_tile_lit_line);

void ray_cast_hit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_hit)(cast, x, y, width, height, out, row_floats);
}
void ray_cast_lit_line(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                       std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_lit_line)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
