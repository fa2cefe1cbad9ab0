// Combining planes of samples along z.
#include <cstdint>

#include "transitions/kernels/combine.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/combine_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/sample_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

struct Planes {
    const Combining& with;
    const Grid& volume;
    std::int64_t x, y, width, height, begin, end;
    const PixelSpans& spans;
    const PixelStates& states;

    template <class Rule, class Make>
    void run_rows(const Make& row_at) const {
        const Rule rule(with);
        const bool sums = with.rule == Combine::sum || with.rule == Combine::mean;
        for (std::int64_t z = begin; z < end; ++z)
            for (std::int64_t r = 0; r < height; ++r) {
                float* state = states.first + r * states.pitch;
                add_parts(rule, row_at(z * volume.slice_step() + (y + r) * volume.row_step() + x),
                          0, width, static_cast<float>(z), spans.low + r * spans.pitch,
                          spans.high + r * spans.pitch, state, states.plane);
                if (sums && (z + 1) % kBlockPlanes == 0) close_block(state, states.plane, width);
            }
    }
};

template <class T>
struct TypedPlanes {
    const Planes& planes;

    template <class Rule>
    void run() const {
        const Grid& volume = planes.volume;
        planes.run_rows<Rule>(
            [&](std::int64_t first) { return Row<T>{volume.row_from<T>(first)}; });
    }
};

struct LoadedPlanes {
    const Planes& planes;

    template <class Rule>
    void run() const {
        const Grid& volume = planes.volume;
        const ScalarLoad load = scalar_load(volume.type);
        planes.run_rows<Rule>([&](std::int64_t first) {
            return LoadedRow{volume.samples, load, first};
        });
    }
};

void combine_on(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
                std::int64_t width, std::int64_t height, std::int64_t begin, std::int64_t end,
                const PixelSpans& spans, const PixelStates& states) {
    const Planes planes{with, volume, x, y, width, height, begin, end, spans, states};
    switch (volume.type) {
        case Type::u8:
            return with_rule<true>(with, TypedPlanes<std::uint8_t>{planes});
        case Type::i8:
            return with_rule<true>(with, TypedPlanes<std::int8_t>{planes});
        case Type::u16:
            return with_rule<true>(with, TypedPlanes<std::uint16_t>{planes});
        case Type::i16:
            return with_rule<true>(with, TypedPlanes<std::int16_t>{planes});
        case Type::f32:
            return with_rule<false>(with, TypedPlanes<float>{planes});
        default:
            return with_rule<false>(with, LoadedPlanes{planes});
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(combine_on);

void combine(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
             std::int64_t width, std::int64_t height, std::int64_t begin, std::int64_t end,
             const PixelSpans& spans, const PixelStates& states) {
    HWY_DYNAMIC_DISPATCH(combine_on)
    (with, volume, x, y, width, height, begin, end, spans, states);
}

}  // namespace edgewise::kernels
#endif
