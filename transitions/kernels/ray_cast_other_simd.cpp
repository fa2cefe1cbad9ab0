// Ray casting: rules of modes that have no vectors of their own.
#include "transitions/kernels/ray_cast_tiles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_other_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// Each sample of a packet goes through the rule's function.
template <int kNumbers>
class OtherSum {
 public:
    static constexpr int kChannels = kNumbers;
    static constexpr bool kSkips = false, kAnyOrder = false;

    explicit OtherSum(const RayCast& cast) : rule_(*cast.other), setting_(setting_of(cast)) {
        rule_.clear(state_, kLanes, static_cast<int>(kLanes));
        std::fill_n(ones_, kLanes, 1.0f);
    }

    HWY_INLINE void add(VF value, int) {
        HWY_ALIGN float stored[kLanes];
        hn::Store(value, DF(), stored);
        rule_.add(setting_, stored, ones_, state_, kLanes, static_cast<int>(kLanes));
    }
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int) {
        HWY_ALIGN float stored[kLanes], weights[kLanes];
        hn::Store(value, DF(), stored);
        hn::Store(hn::IfThenZeroElse(outside, weight), DF(), weights);
        rule_.add(setting_, stored, weights, state_, kLanes, static_cast<int>(kLanes));
    }
    HWY_INLINE bool alive() const { return true; }
    HWY_INLINE bool needs(VF) const { return true; }

    struct Lanewise {
        HWY_ALIGN float state[RayRule::kMostPlanes * kLanes];

        explicit Lanewise(const OtherSum& sum) {
            std::copy_n(sum.state_, RayRule::kMostPlanes * kLanes, state);
        }
        void write(const RayCast& cast, int lane, bool hit, double, float* out) const {
            if (hit) return cast.other->finish(setting_of(cast), state + lane, kLanes, out);
            float nothing[RayRule::kMostPlanes];
            cast.other->clear(nothing, 1, 1);
            cast.other->finish(setting_of(cast), nothing, 1, out);
        }
    };

 private:
    static RayRule::Setting setting_of(const RayCast& cast) {
        return {cast.volume.values, cast.step * cast.unit, cast.zero, cast.miss, cast.level};
    }

    const RayRule& rule_;
    RayRule::Setting setting_;
    HWY_ALIGN float state_[RayRule::kMostPlanes * kLanes] = {}, ones_[kLanes];
};

/// Samples of all types, but for those of weights, are gathered; finite or not is the rule's to
/// ask.
void cast_tile_other(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                     std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    const Tile tile{cast, x, y, width, height, out, row_floats};
    const double bytes = static_cast<double>(cast.volume.extent.samples()) *
                         static_cast<double>(bytes_of(cast.volume.type));
    const auto by = [&](auto channels) {
        using Sum = OtherSum<decltype(channels)::value>;
        if (kPlainLoops || !(bytes < 2147483648.0) || !in_lanes(cast.volume.type))
            return tile.held<Sum, Walked>();
        if constexpr (!kPlainLoops)
            gathers::HWY_NAMESPACE::with_reads(
                cast.volume.type, [&](auto reads) { tile.held<Sum, Gathered<decltype(reads)>>(); });
    };
    if (cast.other->channels == 4)
        by(std::integral_constant<int, 4>());
    else
        by(std::integral_constant<int, 1>());
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_other);

void ray_cast_other(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                    std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_other)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
