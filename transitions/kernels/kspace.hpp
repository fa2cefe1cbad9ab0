#pragma once

#include <memory_resource>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// A volume or an image from its k-space: value(i) = 1 / n sum over k of F(k) exp(2 pi i (k - m) (i
/// - m) / n) along each axis, m = n / 2 rounded down.
///
/// @param kspace     x fastest
/// @param magnitude  of each value; else its real part
/// @param out        as many samples
/// @param memory     scratch: as many bytes as `kspace` has, and kspace_scratch() a thread
/// @param stop       true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads.
void volume_of_kspace(const Complex* kspace, const Extent& n, bool magnitude, float* out,
                      std::pmr::memory_resource* memory, const Stop& stop);

double kspace_operations(const Extent& n) noexcept;
double kspace_scratch(const Extent& n) noexcept;

}  // namespace edgewise::kernels
