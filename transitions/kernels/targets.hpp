#pragma once

#include <cstdint>
#include <string>

namespace edgewise::kernels {

/// Sets of instructions that kernels are compiled for: bits of Highway's targets (HWY_AVX2 ...). A
/// program takes the best of them that its processor has. See cmake/edgewise_vectors.cmake.
std::int64_t compiled_targets() noexcept;

/// Why a processor with such sets of instructions (SSE4, AVX2, AVX-512) cannot run these kernels; ""
/// where it can. A build for the processor that built it may be carried to another one.
std::string processor_lacks(std::int64_t supported);
/// Of this processor.
std::string processor_lacks();

}  // namespace edgewise::kernels
