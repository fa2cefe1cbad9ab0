#pragma once

#include <cstddef>
#include <cstdint>

namespace edgewise::kernels {

/// Rows in tiles are rounded up to so many values, so that vectors may be read behind the last one.
inline constexpr std::int64_t kRowStep = 128;

// All of them write n values and no more. They read whole vectors: up to kSlack bytes (grid.hpp)
// behind the last value of a place, which are never used.

/// out[i] = the sum of weights[t] in[i + places[t]], for i < n; with `adds` out[i] is added to. In
/// the order of t, with fused products.
/// @param places  in values from in[0]
void sum_row(const float* in, const std::ptrdiff_t* places, const float* weights, std::size_t count,
             bool adds, float* out, std::int64_t n);
void sum_row(const double* in, const std::ptrdiff_t* places, const double* weights,
             std::size_t count, bool adds, double* out, std::int64_t n);

/// out[i] = the largest (or least) in[i + places[t]]. Of NaN nothing is said. `out` may be `in`
/// where all places are at least 0.
/// T: the integers of 1 to 4 bytes, float, double
template <class T>
void extreme_row(const T* in, const std::ptrdiff_t* places, std::size_t count, bool least, T* out,
                 std::int64_t n);

/// out[i] = the largest in[i + places[t]] + weights[t], or the least in[...] - weights[t]; NaN
/// where one of them is.
void grey_row(const float* in, const std::ptrdiff_t* places, const float* weights,
              std::size_t count, bool least, float* out, std::int64_t n);
void grey_row(const double* in, const std::ptrdiff_t* places, const double* weights,
              std::size_t count, bool least, double* out, std::int64_t n);

/// A box of places, each with a weight.
template <class T>
struct WeightBox {
    const T* weights;  // [z, y, x]
    std::int64_t x, y, z;
};

/// Several rows of sums over a box: out[i + r out_row] = the sum of the weight at (a, b, c) times
/// in[i + a + (r + b) in_row + c in_slice], for i < n and r < rows. In the order of the weights,
/// with fused products: as sum_row() to the bit, whatever n and rows are. Four rows share what is
/// read.
void sum_rows(const float* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
              const WeightBox<float>& box, float* out, std::ptrdiff_t out_row, std::int64_t n,
              std::int64_t rows);
void sum_rows(const double* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
              const WeightBox<double>& box, double* out, std::ptrdiff_t out_row, std::int64_t n,
              std::int64_t rows);

}  // namespace edgewise::kernels
