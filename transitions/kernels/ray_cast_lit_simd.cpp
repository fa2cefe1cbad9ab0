// Ray casting: front-to-back compositing of samples that light falls on.
#include "transitions/kernels/ray_cast_tiles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_lit_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"
#include "transitions/kernels/ray_table-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// As OverSum, with the light of each sample that is seen, or with less of it by depth.
template <bool kNumbers>
class LitSum : public OverState<3> {
 public:
    static constexpr bool kFinite = kNumbers;

    explicit LitSum(const RayCast& cast)
        : OverState<3>(cast), cast_(cast), optics_(*cast.optics), by_(cast.light), cells_(cast) {
        for (VF& axis : eye_) axis = hn::Zero(DF());
    }
    void aim(const Packet& packet, double x, double y) {
        aim_at_eye(cast_, x, y, eye_);
        if (cast_.cue) fading_ = fading_of(cast_, packet, x, y);
    }

    const RayCast& cast() const { return cast_; }

    template <class At>
    HWY_INLINE void add(VF value, int, const At& spot) {
        if (cast_.table) return add_tabled(value, hn::FirstN(DF(), 0), nullptr, spot);
        VF color[3], opacity = look_up<3>(optics_, value, color);
        if (!needs(opacity)) return;
        add_lit(value, color, opacity, nullptr, spot);
    }
    template <class At>
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int, const At& spot) {
        if (cast_.table) return add_tabled(value, outside, &weight, spot);
        VF color[3], opacity = look_up<3>(optics_, value, color);
        if (!needs(opacity)) return;
        add_lit(value, color, hn::IfThenZeroElse(outside, opacity), &weight, spot);
    }

 private:
    /// @param weight  shares of the cell that count; null: all
    template <class At>
    HWY_INLINE void add_lit(VF value, const VF (&color)[3], VF opacity, const VF* weight,
                            const At& spot) {
        if constexpr (!kFinite) opacity = hn::IfThenElseZero(is_finite(value), opacity);
        VF slope[3] = {hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};
        if (cast_.edges || (by_ && by_->by != Shade::particles))
            spot.gradient_at(spot.offset, value, slope);
        if (cast_.edges) opacity = hn::Mul(opacity, edge_of(*cast_.edges, slope));
        shine(color, opacity, weight, slope, spot);
    }
    /// The same by a table of values and lengths of gradients.
    template <class At>
    HWY_NOINLINE void add_tabled(VF value, MF outside, const VF* weight, const At& spot) {
        const RayTable& table = *cast_.table;
        const TablePlace place = place_in(table.values, value);
        VF most = hn::IfThenZeroElse(outside, most_at(table, place));
        if constexpr (!kFinite) most = hn::IfThenElseZero(is_finite(value), most);
        if (!needs(most)) return;
        VF slope[3], color[3];
        spot.gradient_at(spot.offset, value, slope);
        const VF found = table_at(table, place, slope, color);
        // A ray's light must not hang on whether one beside it needs this sample.
        const VF opacity = hn::IfThenElseZero(hn::Gt(most, hn::Zero(DF())), found);
        shine(color, opacity, weight, slope, spot);
    }
    /// @param slope  the gradient, where light or opacities need one
    template <class At>
    HWY_INLINE void shine(const VF (&color)[3], VF opacity, const VF* weight, const VF3& slope,
                          const At& spot) {
        opacity = weight ? cells_(opacity, *weight) : cells_(opacity);
        VF diffuse = hn::Set(DF(), 1.0f), specular = hn::Zero(DF());
        if (by_) {
            ArrivingLanes arriving;
            if (cast_.arriving)
                arriving.find(*cast_.arriving, {spot.place(0), spot.place(1), spot.place(2)});
            light_on(*by_, slope, eye_, arriving, diffuse, specular);
        }
        if (cast_.cue) {
            const VF left = fading_.at(spot.offset);
            diffuse = hn::Mul(diffuse, left);
            specular = hn::Mul(specular, left);
        }
        VF light[3];
        for (int c = 0; c < 3; ++c) light[c] = hn::MulAdd(color[c], diffuse, specular);
        composite(light, opacity);
    }

    const RayCast& cast_;
    const Optics& optics_;
    const RayLight* by_;
    WholeCells cells_;
    VF eye_[3];
    Fading fading_ = {};
};

void cast_tile_lit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                   std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<LitSum>({cast, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_lit);

void ray_cast_lit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_lit)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
