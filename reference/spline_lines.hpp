#pragma once

#include "graph/data.hpp"

namespace edgewise {

/// The pole of the cubic B-spline's prefilter: what is m samples away counts |pole|^m.
inline constexpr double kSplinePole = -0.26794919243112270647;  // sqrt(3) - 2

/// A box of numbers, x fastest: where it begins, and how far rows and planes are apart [number].
template <class Real>
struct Box {
    Real* first;
    Extent n;
    std::int64_t row, plane;
};

/// Stored numbers `step` apart along x.
struct StoredBox {
    const void* first;
    Type type;
    std::int64_t step, row, plane;  // [number]
};
/// The box of some samples of one channel, or of all channels with these as further samples.
/// @param step  the channels, or 1
StoredBox stored_box(const Data& data, const std::array<std::int64_t, 3>& begin, int channel,
                     std::int64_t step);

// slope * number + offset, rounded to the type of the box at the end, or all along.

void map_box(const StoredBox& from, double slope, double offset, const Box<float>& to);
void map_box(const StoredBox& from, double slope, double offset, const Box<double>& to);
void map_box(const StoredBox& from, float slope, float offset, const Box<float>& to);

bool all_finite(const Box<float>& box);
bool all_finite(const Box<double>& box);

/// From samples to the coefficients of their cubic B-spline but for its gain, mirrored at the ends,
/// along x, then y, then z (Unser 1999). Lines side by side are lanes of vectors: the numbers are
/// those of each line by itself.
void prefilter(const Box<float>& box);
void prefilter(const Box<double>& box);

}  // namespace edgewise
