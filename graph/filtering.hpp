#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "graph/samples.hpp"

namespace edgewise {

/// What stands beyond the samples: 0; the nearest sample; the samples mirrored about the centre of
/// the outermost one (c b a b c); or the samples again and again.
enum class Border { zero, clamp, mirror, wrap };

std::string_view name_of(Border border) noexcept;
/// @throws RequestError
Border border_named(std::string_view name);

/// Where a place beyond n samples is read from; -1: nowhere, there it is 0.
std::int64_t bordered(Border border, std::int64_t at, std::int64_t n) noexcept;

/// What becomes of the neighbourhood of each sample (FIGURE 10, EQ 6-9):
///   convolve   the sum of w(k) in(p - k)      correlate  the sum of w(k) in(p + k)
///   dilate     the largest in(p - k) + w(k)   erode      the least in(p + k) - w(k)
///   open       eroded, then dilated           close      dilated, then eroded
///   tophat     in less its opening            median     the middle of in(p + k), the lower of two
/// where k goes over the kernel, counted from its centre.
enum class FilterOp { convolve, correlate, dilate, erode, open, close, tophat, median };

std::string_view name_of(FilterOp op) noexcept;
/// @throws RequestError
FilterOp filter_op_named(std::string_view name);
const std::vector<FilterOp>& filter_ops();
/// Whether it sums products; else it orders samples.
constexpr bool is_linear(FilterOp op) noexcept {
    return op == FilterOp::convolve || op == FilterOp::correlate;
}

/// A kernel: a weight at each place of a box around sample floor(n / 2), or none (NaN) where the
/// neighbourhood has a hole. Morphology takes weights of 0 as flat.
struct Stencil {
    /// What it is made by, for edges that know a faster way.
    enum class Shape { any, box, gauss, ball, cross };

    Extent extent{1, 1, 1};
    std::vector<double> weights = {1};  // x fastest
    Shape shape = Shape::any;
    double size = 0;   // radius or standard deviation of its shape [sample]
    std::string name;  // "box:3", or that of a file

    std::array<std::int64_t, 3> centre() const noexcept {
        return {extent.x / 2, extent.y / 2, extent.z / 2};
    }
    double at(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        return weights[static_cast<std::size_t>(x + extent.x * (y + extent.y * z))];
    }
    /// So many places count: those that are not NaN, of sums those that are not 0 either.
    std::int64_t places(bool of_sum) const noexcept;
    /// Whether all places that count have the weight 0.
    bool flat() const noexcept;
    /// All of (2 R + 1) ^ axes; weights of 1 / count for sums, else 0. As all below.
    static Stencil box(double radius, int axes, bool of_sum);
    /// exp(-k^2 / (2 S^2)) for |k| <= floor(4 S + 1/2), as scipy; their sum is 1.
    static Stencil gauss(double sigma, int axes);
    /// Places with |k| <= R. A disc of an image.
    static Stencil ball(double radius, int axes, bool of_sum);
    /// Places on the axes with |k| <= R.
    static Stencil cross(double radius, int axes, bool of_sum);
    /// Derivative -1 0 1 along an axis, smoothed by 1 2 1 along the others: positive where values
    /// rise along the axis, in a correlation.
    static Stencil sobel(int axis, int axes);
    /// Second differences 1 -2 1 along all axes, added.
    static Stencil laplace(int axes);
};

/// What a filter job makes of its input.
struct Filtering {
    FilterOp op = FilterOp::convolve;
    Stencil stencil;
    Border border = Border::mirror;
};

}  // namespace edgewise
