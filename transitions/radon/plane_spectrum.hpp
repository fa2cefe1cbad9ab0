#pragma once

#include <complex>
#include <memory_resource>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/radon/radon_edge.hpp"

namespace edgewise {

/// The spectrum of a slice, to be read between its samples by a Kaiser-Bessel window.
///
/// Frame: origin = sample n / 2 rounded down; F(f) = sum of value exp(-2 pi i f . (x - origin)), f
/// in cycles a sample. As a spectrum of samples it repeats with every whole cycle.
class PlaneSpectrum {
 public:
    static constexpr int kWidth = 6;
    static constexpr double kPadding = 2;

    PlaneSpectrum(const Extent& input, const RadonPlane& plane, std::pmr::memory_resource* memory);

    /// F at any frequency.
    std::complex<double> at(double fx, double fy) const noexcept;

    /// Twice as long as the input, and as the window at least.
    static Extent period_of(const Extent& input) noexcept;
    /// Bytes that live while the spectrum is made.
    static double bytes(const Extent& input) noexcept;

 private:
    Extent period_;
    std::int64_t row_;
    kernels::Block<kernels::Complex> block_;
    const kernels::Complex* samples_;
    const kernels::TapTable& taps_;
};

}  // namespace edgewise
