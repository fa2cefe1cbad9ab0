#pragma once

#include <cstdint>
#include <vector>

namespace edgewise::kernels {

/// Kaiser-Bessel window K(t) = I0(b sqrt(1 - (2 t / w)^2)) / I0(b) for |t| <= w / 2: interpolates
/// spectra of arrays that were padded and divided by its transform.
///
/// The shape b is the one of least root mean square ghost for its width and padding. Source:
/// Jackson, Meyer, Nishimura, Macovski, IEEE Trans. Med. Imaging 10(3), 1991; Beatty, Nishimura,
/// Pauly, IEEE Trans. Med. Imaging 24(6), 2005.
class KaiserBessel {
 public:
    /// @param width    4 or 6 samples of the spectrum
    /// @param padding  1.25, 1.5 or 2: period of the padded array over its extent
    KaiserBessel(int width, double padding);

    int width() const noexcept { return width_; }
    double padding() const noexcept { return padding_; }
    /// b
    double shape() const noexcept { return shape_; }
    static bool known(int width, double padding) noexcept;

    double operator()(double t) const noexcept;
    /// Integral of K(t) exp(-2 pi i t x); x in periods of the padded array.
    double transform(double x) const noexcept;
    /// Root of the summed squares of what interpolation leaves of a sample at x in the repetitions
    /// x + 1, x - 1, x + 2 ..., over what it leaves at x.
    double ghost(double x) const noexcept;

 private:
    int width_;
    double padding_, shape_, at_zero_;
};

/// Weights of a window's taps at 256 fractions of a sample and the next sample, for interpolation
/// between them: error below 4e-6 of the window's top.
struct TapTable {
    static constexpr int kFractions = 256;
    static constexpr int kMostTaps = 8;  // taps a row, the last ones 0 where the window is narrower

    int width = 0;
    std::vector<float> taps;   // [fraction][tap], tap 0 at floor(position) - width / 2 + 1
    std::vector<float> pairs;  // the same, each weight twice: for real and imaginary parts

    explicit TapTable(const KaiserBessel& window);
    /// The table of a window, made once a process.
    static const TapTable& of(const KaiserBessel& window);
};

}  // namespace edgewise::kernels
