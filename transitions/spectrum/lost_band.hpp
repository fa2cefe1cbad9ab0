#pragma once

#include <vector>

#include "graph/data.hpp"
#include "transitions/kernels/spectrum_slice.hpp"

namespace edgewise {

/// What a slice of a spectrum leaves out of projections, told from the power of the samples by
/// frequency and direction.
///
/// A projection along d is the plane f . d = 0 of the field's spectrum (the slice theorem). That
/// spectrum is the samples', which repeats in cycles of 1 along each axis, times the field's
/// response. A slice knows it up to 3/4 of a cycle. Beyond, the plane passes the middle of the
/// repetition m at the distance |m . d|, of d of length 1: of an oblique one far enough that smooth
/// samples have nothing there.
///
/// The power is a mean over up to 16 bricks of 32^3 samples in which something varies
/// (varying_bricks), less their means, faded to their faces by the window of Blackman and Harris of
/// four terms, whose side lobes are below 92 dB (Harris, Proc. IEEE 66(1), 1978). It spreads a wave
/// over four neighbouring frequencies on either side, so that steep spectra are overestimated.
class LostBand {
 public:
    /// @param between  the field: spline or linear
    LostBand(const Data& samples, const Region& occupied, kernels::Between between);

    /// Root mean square of a projection beyond the cutoff, over that of the difference of a
    /// trilinear and a spline projection. Negative where no data determine it.
    /// @param direction  of rays [input index]
    double over_difference(const Vec3& direction) const;

 private:
    double power(const Vec3& frequency) const;

    std::vector<float> power_;                     // half of it, x fastest; empty: nothing varies
    std::vector<double> field_, spline_, linear_;  // responses by frequency
};

}  // namespace edgewise
