// Elliptical Gaussian footprints added to a picture.
#include "transitions/kernels/splat_ewa.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_ewa_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/splat_ewa-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// Adds one footprint.
HWY_INLINE void add_footprint(const Footprint& seen, const SplatSums& sums) {
    const Floats d;
    each_height(seen, sums, [&](VF heights, float* to) {
        hn::StoreU(hn::Add(hn::LoadU(d, to), heights), d, to);
    });
}

/// Calls use(row, y, z) for the samples of each row, whatever their type.
template <class Use>
void each_typed_row(const Grid& volume, std::int64_t begin, std::int64_t end, const Use& use) {
    const auto by = [&](const auto& row_at) {
        for (std::int64_t z = begin; z < end; ++z)
            for (std::int64_t y = 0; y < volume.extent.y; ++y)
                use(row_at(z * volume.slice_step() + y * volume.row_step()), y, z);
    };
    const auto typed = [&](auto sample) {
        using T = decltype(sample);
        by([&](std::int64_t first) { return TypedRow<T>{volume.row_from<T>(first)}; });
    };
    switch (volume.type) {
        case Type::u8:
            return typed(std::uint8_t{});
        case Type::i8:
            return typed(std::int8_t{});
        case Type::u16:
            return typed(std::uint16_t{});
        case Type::i16:
            return typed(std::int16_t{});
        case Type::f32:
            return typed(float{});
        default: {
            const ScalarLoad load = scalar_load(volume.type);
            by([&](std::int64_t first) { return LoadedSamples{volume.samples, load, first}; });
        }
    }
}

void splat_ewa_on(const EwaSplat& splat, std::int64_t begin, std::int64_t end,
                  const SplatSums& sums, Splatted* list) {
    const OnScreen on_screen(splat);
    each_typed_row(splat.volume, begin, end, [&](const auto& row, std::int64_t y, std::int64_t z) {
        const SplatSpan& span = splat.spans[z * splat.volume.extent.y + y];
        if (span.begin >= span.end) return;
        const SplatSpan meets = on_screen.meeting(span, sums, {0, y, z}, 0);
        if (meets.begin >= meets.end) return;
        const std::int64_t count = splatted(row, splat.empty, meets.begin, meets.end, list);
        for (std::int64_t k = 0; k < count; ++k) {
            if (!(splat.depth.of(list[k].x, double(y), double(z)) > 0)) continue;
            add_footprint(on_screen.of(list[k].x, double(y), double(z), list[k].value), sums);
        }
    });
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(splat_ewa_on);

void splat_ewa(const EwaSplat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
               Splatted* row) {
    HWY_DYNAMIC_DISPATCH(splat_ewa_on)(splat, begin, end, sums, row);
}

}  // namespace edgewise::kernels
#endif
