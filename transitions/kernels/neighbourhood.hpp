#pragma once

#include <cstddef>
#include <cstdint>

namespace edgewise::kernels {

/// Where rows are rounded up to: so many values beyond the last one are computed and written, and
/// read around each place. What stands there is never used.
inline constexpr std::int64_t kRowStep = 128;

/// out[i] = the sum of weights[t] in[i + places[t]], for i < n rounded up to kRowStep; with `adds`
/// out[i] is added to. In the order of t, with fused products.
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

}  // namespace edgewise::kernels
