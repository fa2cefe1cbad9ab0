#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "graph/filtering.hpp"
#include "graph/small_objects.hpp"

namespace edgewise {

/// One pass of a filter: out(p) is the weighted sum, the largest, the least or the middle of
/// in(p + k), where k goes over the places of a box.
struct Neighbourhood {
    enum class Rule { sum, largest, least, median };

    Rule rule = Rule::sum;
    std::array<std::int64_t, 3> low{0, 0, 0}, high{0, 0, 0};  // ends of the box, both included
    /// x fastest. NaN: a hole. Added before the largest, subtracted before the least is taken.
    SmallVector<double> weights = {1};
    Border border = Border::mirror;
    /// What a sum is times, after it is taken: where all weights that count are equal they are 1.
    double scale = 1;
    Stencil::Shape shape = Stencil::Shape::any;
    double size = 0;  // of the shape

    Extent extent() const noexcept {
        return {high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1};
    }
    bool of_sum() const noexcept { return rule == Rule::sum; }
    /// Whether a place counts: of sums weights of 0 do not, so that 0 x infinity adds nothing.
    bool counts(double weight) const noexcept {
        return weight == weight && !(of_sum() && weight == 0);
    }
    std::int64_t places() const noexcept;
    bool flat() const noexcept;
    /// Whether every place of the box counts.
    bool full() const noexcept { return places() == extent().samples(); }
    /// Whether all weights are whole numbers.
    bool whole() const noexcept;
    double sum_of_magnitudes() const noexcept;
    /// Whether sums of such stored numbers are integers, before they are scaled.
    bool sums_integers(Type type, const ValueMap& values) const noexcept;
};

/// The passes of a filter, each of which reads what the one before it wrote. Of a top hat they make
/// the opening, which is then subtracted from the input. Those of a gradient are the derivatives
/// along the axes: each reads the input.
SmallVector<Neighbourhood> passes_of(const Filtering& filtering);

/// A sum of products of weights along the axes: w(x, y, z) = sum of a_i(x) b_i(y) c_i(z).
struct Product {
    std::array<SmallVector<double>, 3> along;
};

/// Products of which the weights of a sum consist, to 2^-40 of the largest: as many as the matrix x
/// by (y, z) has rank, and each of its rows y by z.
/// @param most_weights  no more than so many in all; nothing where these are not enough
std::optional<SmallVector<Product>> products_of(
    const Neighbourhood& sum, double most_weights = std::numeric_limits<double>::infinity());

}  // namespace edgewise
