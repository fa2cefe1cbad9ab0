#include "transitions/filter/neighbourhood.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// Weights that are equal, but perhaps for their signs, become 1 and -1, so that sums of whole
/// numbers are exact.
void take_scale(Neighbourhood& sum) {
    double common = 0;
    bool one_sign = true;
    for (const double weight : sum.weights) {
        if (!sum.counts(weight)) continue;
        if (common == 0) common = weight;
        if (std::abs(weight) != std::abs(common)) return;
        one_sign = one_sign && weight == common;
    }
    if (common == 0) return;
    sum.scale = one_sign ? common : std::abs(common);
    for (double& weight : sum.weights) weight = sum.counts(weight) ? weight / sum.scale : 0;
}

/// @param turned  k becomes -k
Neighbourhood pass_of(const Filtering& filtering, const Stencil& stencil, Neighbourhood::Rule rule,
                      bool turned) {
    Neighbourhood pass{.rule = rule, .border = filtering.border, .shape = stencil.shape};
    pass.weights.assign(stencil.weights.begin(), stencil.weights.end());
    pass.size = stencil.size;
    const auto centre = stencil.centre();
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        const std::int64_t first = -centre[k], last = stencil.extent[axis] - 1 - centre[k];
        pass.low[k] = turned ? -last : first;
        pass.high[k] = turned ? -first : last;
    }
    if (turned) std::reverse(pass.weights.begin(), pass.weights.end());
    if (pass.of_sum()) take_scale(pass);
    return pass;
}

/// A matrix of rows x columns, row by row.
struct Matrix {
    std::size_t rows, columns;
    SmallVector<double> numbers;

    double& at(std::size_t row, std::size_t column) { return numbers[row * columns + column]; }
};

struct Term {
    SmallVector<double> left, right;  // as many as rows, and columns
};

/// Products of a column and a row that add up to the matrix: elimination with complete pivoting, as
/// in the adaptive cross approximation of Bebendorf 2000. Whole numbers often stay whole.
/// @param most  no more than so many; nothing where they are not enough
std::optional<SmallVector<Term>> terms_of(Matrix matrix, std::size_t most) {
    constexpr double kLeast = 0x1p-40;
    SmallVector<Term> terms;
    double first = 0;
    for (;;) {
        std::size_t at = 0;
        for (std::size_t i = 1; i < matrix.numbers.size(); ++i)
            if (std::abs(matrix.numbers[i]) > std::abs(matrix.numbers[at])) at = i;
        const double pivot = matrix.numbers[at];
        if (terms.empty()) first = std::abs(pivot);
        if (!(std::abs(pivot) > kLeast * first)) return terms;
        if (terms.size() == most) return {};
        const std::size_t row = at / matrix.columns, column = at % matrix.columns;
        Term term;
        for (std::size_t r = 0; r < matrix.rows; ++r) term.left.push_back(matrix.at(r, column));
        for (std::size_t c = 0; c < matrix.columns; ++c)
            term.right.push_back(matrix.at(row, c) / pivot);
        for (std::size_t r = 0; r < matrix.rows; ++r)
            for (std::size_t c = 0; c < matrix.columns; ++c)
                matrix.at(r, c) -= term.left[r] * term.right[c];
        // What is left of this row and column is nothing but rounding.
        for (std::size_t r = 0; r < matrix.rows; ++r) matrix.at(r, column) = 0;
        for (std::size_t c = 0; c < matrix.columns; ++c) matrix.at(row, c) = 0;
        terms.push_back(std::move(term));
    }
}

/// Makes weights whole that differ from whole numbers by rounding alone, as those of Sobel's
/// kernel.
void tidy(Product& product) {
    // All factors but the last are scaled so that their least weight is 1.
    for (std::size_t axis = 0; axis < 2; ++axis) {
        auto& factor = product.along[axis];
        auto& last = product.along[2];
        double least = 0;
        for (const double weight : factor) {
            const double size = std::abs(weight);
            if (size > 1e-9 && (least == 0 || size < least)) least = size;
        }
        if (least == 0) continue;
        for (double& weight : factor) weight /= least;
        for (double& weight : last) weight *= least;
    }
    constexpr double kRounding = 1e-12;
    for (auto& factor : product.along)
        for (double& weight : factor) {
            const double number = std::round(weight);
            if (number != 0 && std::abs(weight - number) < kRounding * std::abs(number))
                weight = number;
        }
}

}  // namespace

std::int64_t Neighbourhood::places() const noexcept {
    return std::count_if(weights.begin(), weights.end(), [&](double w) { return counts(w); });
}

bool Neighbourhood::flat() const noexcept {
    return std::all_of(weights.begin(), weights.end(),
                       [](double w) { return std::isnan(w) || w == 0; });
}

bool Neighbourhood::whole() const noexcept {
    return std::all_of(weights.begin(), weights.end(),
                       [](double w) { return std::isnan(w) || w == std::round(w); });
}

bool Neighbourhood::sums_integers(Type type, const ValueMap& values) const noexcept {
    return is_integer(type) && values.slope == std::round(values.slope) &&
           values.offset == std::round(values.offset) && whole();
}

double Neighbourhood::sum_of_magnitudes() const noexcept {
    double sum = 0;
    for (const double weight : weights)
        if (!std::isnan(weight)) sum += std::abs(weight);
    return sum;
}

SmallVector<Neighbourhood> passes_of(const Filtering& filtering) {
    using Rule = Neighbourhood::Rule;
    const auto pass = [&](Rule rule, bool turned) {
        return pass_of(filtering, filtering.stencil, rule, turned);
    };
    if (filtering.op == FilterOp::gradient) {
        SmallVector<Neighbourhood> derivatives;
        for (const Stencil& stencil : filtering.derivatives)
            derivatives.push_back(pass_of(filtering, stencil, Rule::sum, false));
        return derivatives;
    }
    const auto dilate = [&] { return pass(Rule::largest, true); };
    const auto erode = [&] { return pass(Rule::least, false); };
    switch (grey_of(filtering.op)) {
        case FilterOp::convolve:
            return {pass(Rule::sum, true)};
        case FilterOp::correlate:
            return {pass(Rule::sum, false)};
        case FilterOp::dilate:
            return {dilate()};
        case FilterOp::erode:
            return {erode()};
        case FilterOp::open:
        case FilterOp::tophat:
            return {erode(), dilate()};
        case FilterOp::close:
            return {dilate(), erode()};
        case FilterOp::median:
            return {pass(Rule::median, false)};
        default:
            return {};
    }
}

std::optional<SmallVector<Product>> products_of(const Neighbourhood& sum, double most_weights) {
    const Extent n = sum.extent();
    const auto size = [](std::int64_t count) { return static_cast<std::size_t>(count); };
    const double each = static_cast<double>(n.x + n.y + n.z - 2);
    const auto most = static_cast<std::size_t>(std::clamp(most_weights / each, 1.0, 1e9));
    Matrix matrix{size(n.x), size(n.y * n.z), {}};
    matrix.numbers.resize(sum.weights.size());
    for (std::size_t yz = 0; yz < matrix.columns; ++yz)
        for (std::size_t x = 0; x < matrix.rows; ++x) {
            const double weight = sum.weights[x + matrix.rows * yz];
            matrix.at(x, yz) = std::isnan(weight) ? 0 : weight;
        }
    SmallVector<Product> products;
    const auto outer = terms_of(std::move(matrix), most);
    if (!outer) return {};
    for (const Term& one : *outer) {
        Matrix rest{size(n.y), size(n.z), SmallVector<double>(one.right.size())};
        for (std::size_t y = 0; y < rest.rows; ++y)
            for (std::size_t z = 0; z < rest.columns; ++z)
                rest.at(y, z) = one.right[y + rest.rows * z];
        const auto inner = terms_of(std::move(rest), most - products.size());
        if (!inner) return {};
        for (const Term& other : *inner) {
            products.push_back({{one.left, other.left, other.right}});
            tidy(products.back());
        }
    }
    return products;
}

}  // namespace edgewise
