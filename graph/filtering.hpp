#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "graph/fingerprint.hpp"
#include "graph/message.hpp"
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
///   gradient   the length of the vector of derivatives along all axes [value / mm, or / sample]
/// where k goes over the kernel, counted from its centre; and binary_dilate, binary_erode,
/// binary_open and binary_close, which do the same to the places that are not 0.
///
/// NaN is no number: medians leave it out, and are NaN where nothing else is left; sums and
/// extremes of a neighbourhood that holds one are NaN; it is no place of a mask.
///
/// The second pass of an opening or closing at a border that mirrors or clamps takes each result
/// of the first back to all samples that it came from, those behind the border included. So
/// closing >= input >= opening, and both are idempotent, whatever the kernel.
enum class FilterOp {
    convolve,
    correlate,
    dilate,
    erode,
    open,
    close,
    tophat,
    median,
    gradient,
    binary_dilate,
    binary_erode,
    binary_open,
    binary_close
};

std::string_view name_of(FilterOp op) noexcept;
/// By its name, or by one that other programs have for it: "dilation", "grey_opening".
/// @throws RequestError
FilterOp filter_op_named(std::string_view name);
const std::vector<FilterOp>& filter_ops();
/// A word for an operation without what does not matter: "Grey-Dilation" is "dilate", "Median
/// filter" is "median"; of an unknown one its small letters, words joined by _.
std::string plain_op_name(std::string_view name);
/// Whether it sums products; else it orders samples.
constexpr bool is_linear(FilterOp op) noexcept {
    return op == FilterOp::convolve || op == FilterOp::correlate;
}
/// Whether it asks of samples only whether they are 0.
constexpr bool is_binary(FilterOp op) noexcept { return op >= FilterOp::binary_dilate; }
/// What a binary operation does to its mask; others are what they are.
FilterOp grey_of(FilterOp op) noexcept;
/// Whether its kernel is one of sums.
constexpr bool has_weights(FilterOp op) noexcept {
    return is_linear(op) || op == FilterOp::gradient;
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
    /// One size along all axes, or one along each [sample].
    struct Sizes {
        std::array<double, 3> along;

        Sizes(double size) : along{size, size, size} {}  // NOLINT: a number is a size
        explicit Sizes(const std::array<double, 3>& each) : along(each) {}
        bool alike(int axes) const noexcept;
        /// "2", or "2,2,1"
        std::string text(int axes) const;
    };
    /// All of (2 R + 1) ^ axes; weights of 1 / count for sums, else 0. As all below.
    static Stencil box(const Sizes& radius, int axes, bool of_sum);
    /// exp(-k^2 / (2 S^2)) for |k| <= floor(4 S + 1/2), as scipy; their sum is 1.
    static Stencil gauss(const Sizes& sigma, int axes);
    /// Places with |k| <= R. A disc of an image. Of several radii an ellipsoid.
    static Stencil ball(const Sizes& radius, int axes, bool of_sum);
    /// Places on the axes with |k| <= R.
    static Stencil cross(const Sizes& radius, int axes, bool of_sum);
    /// Derivative -1 0 1 along an axis, smoothed by 1 2 1 along the others: positive where values
    /// rise along the axis, in a correlation.
    static Stencil sobel(int axis, int axes);
    /// Second differences 1 -2 1 along all axes, added.
    static Stencil laplace(int axes);
    /// The difference of the two neighbours along an axis, halved: in a correlation a derivative.
    static Stencil difference(int axis, int axes);
    /// That of a Gaussian along an axis, k / S^2 times gauss(S): in a correlation the derivative of
    /// what is smoothed by it. As scipy's gaussian_filter of order 1.
    static Stencil gauss_derivative(const Sizes& sigma, int axis, int axes);
    /// The same weights times a number.
    Stencil times(double factor) const;
};

/// What a filter job makes of its input.
struct Filtering {
    FilterOp op = FilterOp::convolve;
    Stencil stencil;
    Border border = Border::mirror;
    /// Of a gradient: what correlates to the derivative along each axis; `stencil` is not used.
    std::vector<Stencil> derivatives = {};
    /// Of a binary operation: what the result is where it is not 0.
    double inside = 1;
    /// What a user may not expect.
    std::vector<Message> notes = {};
};

template <Either<Stencil> T, class F>
void visit_fields(T& stencil, F&& f) {
    auto& [extent, weights, shape, size, name] = stencil;
    f("extent", extent), f("weights", weights), f("shape", shape), f("size", size), f("name", name);
}

template <Either<Filtering> T, class F>
void visit_fields(T& filtering, F&& f) {
    auto& [op, stencil, border, derivatives, inside, notes] = filtering;
    f("op", op), f("stencil", stencil), f("border", border), f("derivatives", derivatives);
    f("inside", inside);
    static_cast<void>(notes);  // for people
}

}  // namespace edgewise
