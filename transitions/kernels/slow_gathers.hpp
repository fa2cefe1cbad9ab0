#pragma once

#include <optional>

namespace edgewise::kernels {

/// Whether this processor reads a vector of samples faster one by one than with its gather
/// instruction, as AMD's Zen 5 does (docs/performance.md). Measured once, by some 50 us of reads
/// from the first-level cache. Both ways give the same bits. Any thread may ask.
bool gathers_are_slow() noexcept;

/// Answers for the processor, to tests and benchmarks. @param slow  nullopt: it is measured again
void set_gathers_slow(std::optional<bool> slow) noexcept;

}  // namespace edgewise::kernels
