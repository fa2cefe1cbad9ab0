#pragma once

#include <cstdint>
#include <vector>

namespace edgewise::kernels {

/// Kaiser-Bessel window K(t) = I0(b sqrt(1 - (2 t / w)^2)) / I0(b) for |t| <= w / 2: interpolates
/// spectra of arrays that were padded and divided by its transform.
///
/// The shape b is the one of least root mean square ghost for its width and padding. Without
/// padding there is one window alone: the triangle of linear interpolation, K(t) = 1 - |t|, the
/// cheapest and the one whose ghosts are as bright as what they repeat. Source:
/// Jackson, Meyer, Nishimura, Macovski, IEEE Trans. Med. Imaging 10(3), 1991; Beatty, Nishimura,
/// Pauly, IEEE Trans. Med. Imaging 24(6), 2005.
class KaiserBessel {
 public:
    static constexpr int kNarrowest = 2, kWidest = 8;

    /// @param width    2 to 8 samples of the spectrum
    /// @param padding  1.25, 1.5 or 2: period of the padded array over its extent; 1 with width 2:
    ///                 the triangle
    KaiserBessel(int width, double padding);

    int width() const noexcept { return width_; }
    double padding() const noexcept { return padding_; }
    /// b; 0 of the triangle
    double shape() const noexcept { return shape_; }
    static bool known(int width, double padding) noexcept;

    double operator()(double t) const noexcept;
    /// Integral of K(t) exp(-2 pi i t x); x in periods of the padded array.
    double transform(double x) const noexcept;
    /// Relative size of ghosts: root of the summed squares of a sample's copies at x + 1, x - 1,
    /// x + 2 ... after interpolation, over its value at x.
    double ghost(double x) const noexcept;

    // Of samples anywhere in the field, |x| <= 1 / (2 padding), along one axis:
    /// Root mean square of ghost(x).
    double mean_ghost() const noexcept;
    /// At most the sum of |K(x + m)| over |K(x)|, K the transform, for repetitions m up to 256 on
    /// either side: no ghosts of a sample add up to more of it.
    double bound() const noexcept;
    /// By how much rounding of the spectrum grows until the picture, over that of a sample in the
    /// middle: root mean square of the root of the sum of K(t)^2, over the transform at x.
    double amplified() const noexcept;

 private:
    int width_;
    double padding_, shape_, at_zero_;
};

/// Every window there is, narrow ones first.
const std::vector<KaiserBessel>& known_windows();

/// Rows of a table of taps between one sample and the next: 2 to this. Between them weights are
/// interpolated, which leaves 4e-6 of the window's top, and 3e-7 of wide windows: their ghosts are
/// fainter than 4e-6.
constexpr int tap_bits(int width) noexcept { return width > 6 ? 10 : 8; }

/// Weights of a window's taps at fractions of a sample and the next sample, for interpolation
/// between them.
struct TapTable {
    static constexpr int kFractions = 256;  // of windows of up to six taps
    static constexpr int kMostTaps = 8;  // taps a row, the last ones 0 where the window is narrower

    int width = 0, fractions = 0;
    /// [fraction][tap]. The place is that of a sample and a fraction; of an odd width it is half a
    /// sample farther, so that the taps lie around the nearest sample. Tap 0 is at the sample
    /// (width - 1) / 2 before, rounded down.
    std::vector<float> taps;
    std::vector<float> pairs;  // the same, each weight twice: for real and imaginary parts

    explicit TapTable(const KaiserBessel& window);
    /// The table of a window, made once a process.
    static const TapTable& of(const KaiserBessel& window);
};

}  // namespace edgewise::kernels
