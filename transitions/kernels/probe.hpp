#pragma once

#include <cstdint>

namespace edgewise::kernels {

/// Loops whose work is known, counted as graph/cost.hpp counts: a machine is measured with them.
/// What they return or write is of no use but to keep the loop.

/// The arithmetic of samples in vectors, two of which are under way at a time: products, sums,
/// roundings and comparisons that mostly wait for the one before, as in kernels. The processor's
/// peak, of products and sums alone, is some ten times as fast, and says nothing about them.
/// @param operations  at least so many
/// @param done        as many were done
float probe_operations(std::int64_t operations, std::int64_t& done) noexcept;

/// Copies in address order: reads and writes so many floats each.
void probe_stream(const float* from, float* to, std::int64_t floats) noexcept;

/// Positions of samples on the lines of a grid that is turned against a volume's axes, as warps and
/// ray casters read: known before the read, so that none waits for another, and near the line
/// before. In bytes; they wrap around at the volume's end.
struct ProbeLines {
    const std::int32_t* steps = nullptr;   // of a line's samples from its begin
    std::int64_t length = 0;               // of a line, a multiple of 32
    const std::int32_t* begins = nullptr;  // of lines
    std::int64_t lines = 0;
    std::int32_t wrap = 0;  // bytes of the volume less a sample's: a power of two less 4
};

/// Reads one float at each position, lanes at once where the processor can.
float probe_gather(const float* volume, const ProbeLines& at) noexcept;

}  // namespace edgewise::kernels
