#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>

#include "graph/data.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// How differences of neighbouring samples stand for a derivative.
enum class Differences {
    central,  // (f(x + 1) - f(x - 1)) / 2: exact to degree 2 (EQ 57)
    sobel,    // the same, smoothed by 1 2 1 along both other axes: less noise, more blur
    fourth,   // (8 (f(x + 1) - f(x - 1)) - (f(x + 2) - f(x - 2))) / 12: exact to degree 4
};

/// Gradients of all samples of a volume, of stored numbers by input index. One gradient is four
/// i16: x, y, z in units of `scale`, and 0.
struct Gradients {
    Array samples;
    float scale = 1;

    const std::int16_t* data() const noexcept {
        return static_cast<const std::int16_t*>(samples.data());
    }
};

/// What one unit of Gradients stands for where stored numbers lie within a range.
float gradient_scale(double low, double high) noexcept;

/// Fills slices [begin, end). Beyond the ends the outermost samples continue. A neighbour that is
/// not finite is taken for the sample itself; of a sample that is not finite the gradient is 0.
/// @param to  of slice 0
void gradient_slices(const Grid& volume, Differences by, float scale, std::int64_t begin,
                     std::int64_t end, std::int16_t* to);

}  // namespace edgewise::kernels
