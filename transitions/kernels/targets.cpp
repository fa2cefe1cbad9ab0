#include "transitions/kernels/targets.hpp"

#include <fmt/format.h>
#include <hwy/detect_targets.h>

namespace edgewise::kernels {
namespace {

/// Of the sets that a build may be for alone, those of this processor. Not by Highway's library:
/// its start takes 6 ms of a process (1.0.3), and kernels of one set need nothing of it.
std::int64_t sets_of_processor() noexcept {
    std::int64_t sets = HWY_EMU128 | HWY_SCALAR;
#if HWY_ARCH_X86
    const bool sse4 = __builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("sse4.2") &&
                      __builtin_cpu_supports("pclmul") && __builtin_cpu_supports("aes");
    const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                      __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") &&
                      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd");
    if (sse4) sets |= HWY_SSE4;
    if (avx2) sets |= HWY_AVX2;
    if (avx3) sets |= HWY_AVX3;
#endif
    return sets;
}

/// What people call the best of some sets.
const char* name_of_best(std::int64_t sets) noexcept {
    return sets & HWY_AVX3   ? "AVX-512"
           : sets & HWY_AVX2 ? "AVX2"
           : sets & HWY_SSE4 ? "SSE 4.2"
                             : "other instructions";
}

}  // namespace

std::int64_t compiled_targets() noexcept { return HWY_TARGETS; }

std::string processor_lacks(std::int64_t supported) {
    // What the compiler takes for granted on other kinds of processors is there where a program
    // runs.
    if (!HWY_ARCH_X86 || (HWY_TARGETS & supported) != 0) return {};
    return fmt::format(
        "this build of edgewise is for processors with {}, which this one lacks: build it here, or "
        "for all processors (EDGEWISE_SIMD=all, the preset `package`)",
        name_of_best(HWY_TARGETS));
}

std::string processor_lacks() {
    static const std::string lacks = processor_lacks(sets_of_processor());
    return lacks;
}

}  // namespace edgewise::kernels
