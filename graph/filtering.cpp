#include "graph/filtering.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <utility>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {
namespace {

constexpr std::array<std::string_view, 4> kBorders = {"zero", "clamp", "mirror", "wrap"};
constexpr std::array<std::string_view, 13> kOps = {
    "convolve",     "correlate",   "dilate",      "erode",    "open",
    "close",        "tophat",      "median",      "gradient", "binary_dilate",
    "binary_erode", "binary_open", "binary_close"};

/// Names that other programs have, without what they begin or end with (see plain_op_name).
constexpr std::array<std::pair<std::string_view, std::string_view>, 20> kOthers = {
    {{"convolution", "convolve"},
     {"correlation", "correlate"},
     {"dilation", "dilate"},
     {"erosion", "erode"},
     {"opening", "open"},
     {"closing", "close"},
     {"top_hat", "tophat"},
     {"white_tophat", "tophat"},
     {"white_top_hat", "tophat"},
     {"gradient_magnitude", "gradient"},
     {"gradient_length", "gradient"},
     {"gaussian_gradient_magnitude", "gradient"},
     {"binary_dilation", "binary_dilate"},
     {"binary_erosion", "binary_erode"},
     {"binary_opening", "binary_open"},
     {"binary_closing", "binary_close"},
     {"maximum", "dilate"},
     {"minimum", "erode"},
     {"max", "dilate"},
     {"min", "erode"}}};

template <class Names>
std::size_t place_of(std::string_view word, const Names& names, const char* what) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (same_word(word, names[i])) return i;
    const std::vector<std::string> all(names.begin(), names.end());
    throw RequestError(fmt::format(
        "{} {}: {}", what, word,
        instead_of(word, all, fmt::format("expected one of {}", fmt::join(all, ", ")))));
}

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

using Radii = std::array<std::int64_t, 3>;

/// Lengths over spacings are whole but for rounding, where they are meant to be.
double unrounded(double size) {
    constexpr double kRounding = 1e-6;
    const double whole = std::round(size);
    return std::abs(size - whole) <= kRounding * std::max(1.0, whole) ? whole : size;
}

/// A stencil of 2 R + 1 places along each of the axes, filled by a function of the place, counted
/// from the centre.
template <class Weight>
Stencil filled(const Radii& radius, int axes, const Weight& weight) {
    Stencil stencil;
    for (int axis = 0; axis < axes; ++axis)
        stencil.extent[axis] = 2 * radius[static_cast<std::size_t>(axis)] + 1;
    stencil.weights.clear();
    const auto [cx, cy, cz] = stencil.centre();
    for (std::int64_t z = -cz; z <= cz; ++z)
        for (std::int64_t y = -cy; y <= cy; ++y)
            for (std::int64_t x = -cx; x <= cx; ++x)
                stencil.weights.push_back(weight(double(x), double(y), double(z)));
    return stencil;
}

void normalise(Stencil& stencil) {
    const double sum = std::accumulate(stencil.weights.begin(), stencil.weights.end(), 0.0);
    for (double& weight : stencil.weights) weight /= sum;
}

/// Places where `inside` holds: 1 / count for sums, else 0; holes elsewhere, of sums 0.
template <class Inside>
Stencil set_of(const Stencil::Sizes& radius, int axes, bool of_sum, Stencil::Shape shape,
               const char* name, const Inside& inside) {
    Radii reach{};
    for (std::size_t k = 0; k < 3; ++k)
        reach[k] = static_cast<std::int64_t>(std::floor(unrounded(radius.along[k])));
    Stencil stencil = filled(reach, axes, [&](double x, double y, double z) {
        if (of_sum) return inside(x, y, z) ? 1.0 : 0.0;
        return inside(x, y, z) ? 0.0 : kHole;
    });
    if (of_sum) normalise(stencil);
    stencil.size = radius.along[0];
    stencil.shape = radius.alike(axes) ? shape : Stencil::Shape::any;
    stencil.name = fmt::format("{}:{}", name, radius.text(axes));
    return stencil;
}

Radii gauss_reach(const Stencil::Sizes& sigma) {
    constexpr double kReach = 4;
    Radii radius{};
    for (std::size_t k = 0; k < 3; ++k)
        radius[k] = static_cast<std::int64_t>(std::floor(kReach * sigma.along[k] + 0.5));
    return radius;
}

/// (k / S)^2; an axis without a width has one place.
double squared(double place, double size) {
    return place == 0 ? 0 : (place / size) * (place / size);
}

}  // namespace

std::string_view name_of(Border border) noexcept {
    return kBorders[static_cast<std::size_t>(border)];
}

Border border_named(std::string_view name) {
    return static_cast<Border>(place_of(name, kBorders, "border"));
}

std::int64_t bordered(Border border, std::int64_t at, std::int64_t n) noexcept {
    if (at >= 0 && at < n) return at;
    switch (border) {
        case Border::zero:
            return -1;
        case Border::clamp:
            return at < 0 ? 0 : n - 1;
        case Border::mirror: {
            if (n == 1) return 0;
            const std::int64_t period = 2 * (n - 1);
            const std::int64_t within = ((at % period) + period) % period;
            return within < n ? within : period - within;
        }
        case Border::wrap:
            return ((at % n) + n) % n;
    }
    return -1;
}

std::string_view name_of(FilterOp op) noexcept { return kOps[static_cast<std::size_t>(op)]; }

std::string plain_op_name(std::string_view name) {
    std::string plain = lower(name);
    for (char& letter : plain)
        if (letter == '-' || letter == ' ') letter = '_';
    for (const std::string_view first : {"grey_", "gray_", "morphological_", "morpho_"})
        if (plain.starts_with(first)) plain.erase(0, first.size());
    constexpr std::string_view kLast = "_filter";
    if (plain.ends_with(kLast)) plain.erase(plain.size() - kLast.size());
    for (const auto& [other, ours] : kOthers)
        if (plain == other) return std::string(ours);
    return plain;
}

FilterOp filter_op_named(std::string_view name) {
    const std::string plain = plain_op_name(name);
    for (std::size_t i = 0; i < kOps.size(); ++i)
        if (plain == kOps[i]) return static_cast<FilterOp>(i);
    return static_cast<FilterOp>(place_of(name, kOps, "op"));
}

FilterOp grey_of(FilterOp op) noexcept {
    switch (op) {
        case FilterOp::binary_dilate:
            return FilterOp::dilate;
        case FilterOp::binary_erode:
            return FilterOp::erode;
        case FilterOp::binary_open:
            return FilterOp::open;
        case FilterOp::binary_close:
            return FilterOp::close;
        case FilterOp::convolve:
        case FilterOp::correlate:
        case FilterOp::dilate:
        case FilterOp::erode:
        case FilterOp::open:
        case FilterOp::close:
        case FilterOp::tophat:
        case FilterOp::median:
        case FilterOp::gradient:
            break;
    }
    return op;
}

const std::vector<FilterOp>& filter_ops() {
    static const std::vector<FilterOp> all = [] {
        std::vector<FilterOp> ops;
        for (std::size_t i = 0; i < kOps.size(); ++i) ops.push_back(static_cast<FilterOp>(i));
        return ops;
    }();
    return all;
}

std::int64_t Stencil::places(bool of_sum) const noexcept {
    std::int64_t count = 0;
    for (const double weight : weights) count += !std::isnan(weight) && !(of_sum && weight == 0);
    return count;
}

bool Stencil::flat() const noexcept {
    for (const double weight : weights)
        if (!std::isnan(weight) && weight != 0) return false;
    return true;
}

bool Stencil::Sizes::alike(int axes) const noexcept {
    return std::all_of(along.begin(), along.begin() + axes,
                       [&](double s) { return s == along[0]; });
}

std::string Stencil::Sizes::text(int axes) const {
    if (alike(axes)) return fmt::format("{:g}", along[0]);
    return fmt::format("{:g}", fmt::join(along.begin(), along.begin() + axes, ","));
}

Stencil Stencil::box(const Sizes& radius, int axes, bool of_sum) {
    return set_of(radius, axes, of_sum, Shape::box, "box",
                  [](double, double, double) { return true; });
}

Stencil Stencil::gauss(const Sizes& sigma, int axes) {
    Stencil stencil = filled(gauss_reach(sigma), axes, [&](double x, double y, double z) {
        if (sigma.alike(axes))
            return std::exp(-0.5 * (x * x + y * y + z * z) / (sigma.along[0] * sigma.along[0]));
        return std::exp(-0.5 * (squared(x, sigma.along[0]) + squared(y, sigma.along[1]) +
                                squared(z, sigma.along[2])));
    });
    normalise(stencil);
    stencil.shape = sigma.alike(axes) ? Shape::gauss : Shape::any;
    stencil.size = sigma.along[0];
    stencil.name = fmt::format("gauss:{}", sigma.text(axes));
    return stencil;
}

Stencil Stencil::ball(const Sizes& radius, int axes, bool of_sum) {
    std::array<double, 3> r{};
    for (std::size_t k = 0; k < 3; ++k) r[k] = unrounded(radius.along[k]);
    const bool alike = Sizes(r).alike(axes);
    return set_of(radius, axes, of_sum, Shape::ball, "sphere", [&](double x, double y, double z) {
        if (alike) return x * x + y * y + z * z <= r[0] * r[0];
        // Lengths over spacings are rounded.
        constexpr double kRounding = 1e-6;
        return squared(x, r[0]) + squared(y, r[1]) + squared(z, r[2]) <= 1 + kRounding;
    });
}

Stencil Stencil::cross(const Sizes& radius, int axes, bool of_sum) {
    return set_of(radius, axes, of_sum, Shape::cross, "cross", [](double x, double y, double z) {
        return int(x != 0) + int(y != 0) + int(z != 0) <= 1;
    });
}

Stencil Stencil::sobel(int axis, int axes) {
    constexpr std::array<double, 3> along = {-1, 0, 1}, across = {1, 2, 1};
    Stencil stencil = filled({1, 1, 1}, axes, [&](double x, double y, double z) {
        double weight = 1;
        const std::array<double, 3> place = {x, y, z};
        for (int k = 0; k < axes; ++k) {
            const auto at = static_cast<std::size_t>(place[static_cast<std::size_t>(k)] + 1);
            weight *= k == axis ? along[at] : across[at];
        }
        return weight;
    });
    stencil.name = fmt::format("sobel:{}", "xyz"[axis]);
    return stencil;
}

Stencil Stencil::laplace(int axes) {
    Stencil stencil = filled({1, 1, 1}, axes, [&](double x, double y, double z) {
        const double distance = std::abs(x) + std::abs(y) + std::abs(z);
        return distance == 0 ? -2.0 * axes : distance == 1 ? 1.0 : 0.0;
    });
    stencil.name = "laplace";
    return stencil;
}

Stencil Stencil::difference(int axis, int axes) {
    Radii radius{};
    radius[static_cast<std::size_t>(axis)] = 1;
    Stencil stencil =
        filled(radius, axes, [](double x, double y, double z) { return 0.5 * (x + y + z); });
    stencil.name = "difference";
    return stencil;
}

Stencil Stencil::gauss_derivative(const Sizes& sigma, int axis, int axes) {
    Stencil stencil = gauss(sigma, axes);
    const auto centre = stencil.centre();
    const double along = sigma.along[static_cast<std::size_t>(axis)];
    std::size_t i = 0;
    for (std::int64_t z = -centre[2]; z <= centre[2]; ++z)
        for (std::int64_t y = -centre[1]; y <= centre[1]; ++y)
            for (std::int64_t x = -centre[0]; x <= centre[0]; ++x)
                stencil.weights[i++] *= static_cast<double>(axis == 0   ? x
                                                            : axis == 1 ? y
                                                                        : z) /
                                        (along * along);
    stencil.shape = Shape::any;
    return stencil;
}

Stencil Stencil::times(double factor) const {
    Stencil scaled = *this;
    for (double& weight : scaled.weights) weight *= factor;
    return scaled;
}

}  // namespace edgewise
