#pragma once

#include <cstdint>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {

/// The power of samples by frequency, whatever its direction. Rings are 1/32 cycles a sample wide;
/// the last ones, beyond 1/2, are the corners of the band. Frequencies are those of the index axes:
/// where samples lie closer along one axis than along another, a ring is an ellipsoid in space.
struct RadialPower {
    std::vector<double> frequency;  // the middle of each ring [cycles a sample]
    std::vector<double> power;      // mean square of the variation in each ring [value^2]
    std::vector<double> share;      // of all frequencies that are in each ring; they add up to 1
    int bricks = 0;                 // that the power is a mean of
    int empty = 0;                  // bricks looked at in which nothing varies, left out
    std::int64_t samples = 0;       // looked at

    /// RMS of noise that is as strong at all frequencies as the samples are beyond 3/8 cycles a
    /// sample: no white noise in them is stronger. [value]
    double white() const;
};

/// Measured on up to 16 bricks of 32^3 samples (images: 128^2) in which something varies, spread
/// over the data (transitions/spectrum/varying_bricks.hpp), the same ones for the same data: each
/// less its mean, faded to its faces by a Hann window (which spreads a wave over two neighbouring
/// rings), transformed in f32. By Parseval the rings add up to the mean square within the bricks.
/// Values that are not finite count as the mean of their brick. All channels count alike.
/// @param occupied  box outside of which all samples are equal (Statistics::occupied)
RadialPower measure_radial_power(const Data& data, const Region& occupied,
                                 std::pmr::memory_resource* memory);

}  // namespace edgewise
