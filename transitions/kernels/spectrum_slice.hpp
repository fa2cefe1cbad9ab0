#pragma once

#include <memory_resource>

#include "transitions/kernels/spectrum.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// What field the samples stand for between their centres: the cubic B-spline through them, the
/// trilinear field, or the band-limited one.
enum class Between { spline, linear, band };

/// Frequency response of a field to its samples along one axis, f in cycles per sample:
/// sinc(f)^4 3 / (2 + cos 2 pi f) for the cardinal cubic B-spline (Unser, Aldroubi, Eden, IEEE
/// Trans. Signal Process. 41(2), 1993), sinc(f)^2 for the trilinear field, 1 up to 1/2 otherwise.
double response(Between between, double f) noexcept;
/// Frequency beyond which a field's response counts as 0 [cycles per sample].
double cutoff(Between between) noexcept;

/// A view: how object space maps to the picture, and what of its spectrum is wanted.
struct SliceView {
    /// Object space from the origin voxel on [voxel] -> screen space [pixel]; the third row only
    /// enters the scale.
    Affine to_screen;
    /// Period of the picture [pixel]: that of the transform that makes it, at least its extent.
    std::int64_t width = 1, height = 1;
    Between between = Between::spline;
    /// false: frequencies within the picture's own band. true: all that the field has; what lies
    /// beyond the picture's band is folded into it, as sampling at pixel centres does.
    bool folded = true;
    /// Multiplies all: units of length, and of the transform that makes the picture.
    double scale = 1;
    /// The slice is that of value x (the field) + derivative . (its gradient by voxel). A B-spline
    /// and a band-limited field are derived, a trilinear one by differences of a voxel to both
    /// sides.
    double value = 1;
    std::array<double, 3> derivative{0, 0, 0};

    /// Complex samples of the slice: kx from 0 to width / 2.
    Extent stored() const noexcept { return {width / 2 + 1, height, 1}; }
};

/// The view's slice: scale x |det| x F(u m0 + v m1) x response x phase, where m0 and m1 are the
/// first two rows of to_screen, (u, v) = (kx / width, ky / height) [cycles per pixel], and the
/// phase puts the origin voxel where it falls on the picture. By the slice theorem this is the
/// spectrum of the integral along screen z [value x pixel], whatever the affine map.
///
/// @param spectrum  of spectrum_of_volume, with this period and window; what spectrum_read says.
///                  Of type f32: whole, of hartley_of_spectrum
/// @param out       complex samples of the box `held` of view.stored()
/// @param part      the box of `held` that is made, the same to the bit whatever is left out
/// @param stop      true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads. Source: Bracewell 1956; [W93] 5.1
void slice_of_spectrum(const Grid& spectrum, const Extent& period, const KaiserBessel& window,
                       const SliceView& view, Complex* out, const Region& held, const Region& part,
                       std::pmr::memory_resource* memory, const Stop& stop);

/// The box of the stored spectrum that a part of the slice is made of. Low frequencies of both
/// signs lie at both ends of y and z, so that it is often all of an axis.
Region spectrum_read(const Extent& period, const KaiserBessel& window, const SliceView& view,
                     const Region& part);

/// How many samples of the spectrum slice_of_spectrum interpolates.
double slice_samples(const SliceView& view) noexcept;
/// Bytes of scratch: for each thread, and for all.
double slice_scratch(const SliceView& view) noexcept;
double slice_workspace(const SliceView& view, const Extent& period) noexcept;

}  // namespace edgewise::kernels
