// Loops whose work is known, compiled as the edges' kernels are.
#include "transitions/kernels/probe.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/probe_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/gathers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

using namespace gathers::HWY_NAMESPACE;  // NOLINT: the vectors and gathers

/// A place, its cell and fraction, a clip of two comparisons, and a weighted sum: what kernels do
/// to a sample, one step after the other. Eight operations a lane.
HWY_INLINE VF sampled(VF s, VF slope, VF offset) {
    const Floats d;
    const VF place = hn::MulAdd(s, slope, offset), part = hn::Sub(place, hn::Floor(place));
    const VF clipped = hn::Min(hn::Max(part, hn::Set(d, 0.125f)), hn::Set(d, 0.875f));
    return hn::MulAdd(clipped, slope, offset);
}

float operations(std::int64_t wanted, std::int64_t& done) {
    const Floats d;
    const VF slope = hn::Set(d, 0.75f), offset = hn::Set(d, 0.1f);  // all go to 0.4
    VF even = hn::Iota(d, 0), odd = hn::Add(even, offset);
    const std::int64_t each = 2 * 8 * static_cast<std::int64_t>(hn::Lanes(d));
    for (done = 0; done < wanted; done += each) {
        even = sampled(even, slope, offset);
        odd = sampled(odd, slope, offset);
    }
    return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
}

void stream(const float* from, float* to, std::int64_t floats) {
    const Floats d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    std::int64_t i = 0;
    for (; i + 2 * lanes <= floats; i += 2 * lanes) {
        const VF first = hn::LoadU(d, from + i), second = hn::LoadU(d, from + i + lanes);
        hn::StoreU(first, d, to + i);
        hn::StoreU(second, d, to + i + lanes);
    }
    for (; i < floats; ++i) to[i] = from[i];
}

template <class Read>
float gather_as(const float* volume, const ProbeLines& at) {
    const Floats d;
    const Ints di;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto* base = reinterpret_cast<const std::uint8_t*>(volume);
    const VI wrap = hn::Set(di, at.wrap);
    VF even = hn::Zero(d), odd = even;
    for (std::int64_t line = 0; line < at.lines; ++line) {
        const VI begin = hn::Set(di, at.begins[line]);
        for (std::int64_t i = 0; i < at.length; i += 2 * lanes) {
            const VI first = hn::And(hn::Add(begin, hn::LoadU(di, at.steps + i)), wrap);
            const VI second = hn::And(hn::Add(begin, hn::LoadU(di, at.steps + i + lanes)), wrap);
            even = hn::Add(even, gather_one<Read>(base, first));
            odd = hn::Add(odd, gather_one<Read>(base, second));
        }
    }
    return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
}

float gather(const float* volume, const ProbeLines& at) {
    float sum = 0;
    with_reads(Type::f32, [&](auto read) { sum = gather_as<decltype(read)>(volume, at); });
    return sum;
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(operations);
HWY_EXPORT(stream);
HWY_EXPORT(gather);

float probe_operations(std::int64_t wanted, std::int64_t& done) noexcept {
    return HWY_DYNAMIC_DISPATCH(operations)(wanted, done);
}

void probe_stream(const float* from, float* to, std::int64_t floats) noexcept {
    HWY_DYNAMIC_DISPATCH(stream)(from, to, floats);
}

float probe_gather(const float* volume, const ProbeLines& at) noexcept {
    return HWY_DYNAMIC_DISPATCH(gather)(volume, at);
}

}  // namespace edgewise::kernels
#endif
