#include "transitions/kernels/targets.hpp"

#include <fmt/format.h>
#include <hwy/targets.h>

namespace edgewise::kernels {

std::int64_t compiled_targets() noexcept { return HWY_TARGETS; }

std::string processor_lacks(std::int64_t supported) {
    // Plain loops, which all processors run, have the highest bits.
    if (HWY_TARGETS >= HWY_EMU128 || (HWY_TARGETS & supported) != 0) return {};
    const auto least = HWY_TARGETS & -HWY_TARGETS;
    return fmt::format(
        "this build of edgewise is for processors with {}, which this one lacks: build it here, or "
        "for all processors (EDGEWISE_SIMD=all, the preset `package`)",
        least == HWY_AVX3 ? "AVX-512" : hwy::TargetName(static_cast<std::uint32_t>(least)));
}

std::string processor_lacks() {
    static const std::string lacks = processor_lacks(hwy::SupportedTargets());
    return lacks;
}

}  // namespace edgewise::kernels
