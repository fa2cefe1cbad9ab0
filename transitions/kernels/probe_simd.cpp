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

float operations(std::int64_t wanted, std::int64_t& done) {
    const Floats d;
    // Two units with four cycles from operands to result need eight sums; sixteen registers hold
    // ten and both operands.
    VF s0 = hn::Iota(d, 0), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0, s8 = s0,
       s9 = s0;
    const VF half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f);  // the sums go to 2
    const std::int64_t each = 2 * 10 * static_cast<std::int64_t>(hn::Lanes(d));
    for (done = 0; done < wanted; done += each) {
        s0 = hn::MulAdd(s0, half, one), s1 = hn::MulAdd(s1, half, one);
        s2 = hn::MulAdd(s2, half, one), s3 = hn::MulAdd(s3, half, one);
        s4 = hn::MulAdd(s4, half, one), s5 = hn::MulAdd(s5, half, one);
        s6 = hn::MulAdd(s6, half, one), s7 = hn::MulAdd(s7, half, one);
        s8 = hn::MulAdd(s8, half, one), s9 = hn::MulAdd(s9, half, one);
    }
    const VF low = hn::Add(hn::Add(s0, s1), hn::Add(s2, s3)), high = hn::Add(s4, hn::Add(s5, s6));
    return hn::GetLane(
        hn::SumOfLanes(d, hn::Add(hn::Add(low, high), hn::Add(s7, hn::Add(s8, s9)))));
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

float gather(const float* volume, const ProbeLines& at) {
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
            even = hn::Add(even, gather_one<float>(base, first));
            odd = hn::Add(odd, gather_one<float>(base, second));
        }
    }
    return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
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
