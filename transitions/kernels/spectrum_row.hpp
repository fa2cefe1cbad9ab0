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
    /// Of a spectrum that is stored as its Hartley transform, sample_hartley_row: real samples at
    /// k = (0, 0, 0), all of them; offsets count these, those `back` are of -k.
    const float* hartley = nullptr;
    const std::ptrdiff_t *rows_back = nullptr, *planes_back = nullptr;
};

/// How many samples before the one at a place its window begins.
constexpr std::int64_t taps_before(int width) noexcept { return (width - 1) / 2; }
/// Half a sample for windows of an odd number of taps, which lie around the nearest sample.
constexpr std::uint64_t tap_shift(int width) noexcept {
    return static_cast<std::uint64_t>(width % 2) << 63;
}

/// The samples before a place, or nearest to it where the width is odd; windows begin
/// taps_before(width) earlier. F(-f) is the conjugate of F(f): only kx >= 0 is stored.
inline std::array<std::int64_t, 3> cells_at(std::array<std::uint64_t, 3> frequency,
                                            const std::array<std::uint64_t, 3>& period,
                                            int width) noexcept {
    __extension__ using Wide = unsigned __int128;
    const std::uint64_t sign = std::uint64_t{0} - (frequency[0] >> 63);
    std::array<std::int64_t, 3> cells;
    for (std::size_t axis = 0; axis < 3; ++axis)
        cells[axis] = static_cast<std::int64_t>(
            (static_cast<Wide>((frequency[axis] ^ sign) - sign) * period[axis] +
             tap_shift(width)) >>
            64);
    return cells;
}
/// Columns that are read from the first tap on: up to four as four, more as eight.
constexpr std::int64_t columns_read(int width) noexcept { return width <= 4 ? 4 : 8; }

/// Samples of a spectrum along a line, by windowed interpolation: width^3 complex taps each.
/// Frequencies are 64-bit fractions of one cycle per voxel, so that they wrap as the spectrum does.
void sample_row(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
                std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out);
/// The same of a spectrum that is stored as its Hartley transform H: F(f) is
/// [H(f) + H(-f)] / 2 - i [H(f) - H(-f)] / 2, each with width^3 real taps ([W93] EQ 79).
void sample_hartley_row(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
                        std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out);

}  // namespace edgewise::kernels
