#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "transitions/kernels/fourier.hpp"

namespace edgewise::kernels {

/// A spectrum as a row of samples reads it.
struct SpectrumView {
    const Complex* samples = nullptr;  // at k = (0, 0, 0)
    std::array<std::uint64_t, 3> period{};
    /// Offsets of rows and planes [complex samples]; `width` more than the period, so that a window
    /// that begins before the last one ends without a test.
    const std::ptrdiff_t *rows = nullptr, *planes = nullptr;
    int width = 0;
    const float *taps = nullptr, *pairs = nullptr;  // of TapTable
};

/// Samples of a spectrum along a line, by windowed interpolation: width^3 complex taps each.
/// Frequencies are 64-bit fractions of one cycle per voxel, so that they wrap as the spectrum does.
void sample_row(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
                std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out);

}  // namespace edgewise::kernels
