#include "graph/filtering.hpp"

#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {
namespace {

constexpr std::array<std::string_view, 4> kBorders = {"zero", "clamp", "mirror", "wrap"};
constexpr std::array<std::string_view, 8> kOps = {"convolve", "correlate", "dilate", "erode",
                                                  "open",     "close",     "tophat", "median"};

template <class Names>
std::size_t place_of(std::string_view word, const Names& names, const char* what) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (same_word(word, names[i])) return i;
    const std::vector<std::string> all(names.begin(), names.end());
    throw RequestError(fmt::format("{} {}: {}", what, word, instead_of(word, all)));
}

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

/// A stencil of 2 R + 1 places along each of the axes, filled by a function of the place, counted
/// from the centre.
template <class Weight>
Stencil filled(std::int64_t radius, int axes, const Weight& weight) {
    Stencil stencil;
    for (int axis = 0; axis < axes; ++axis) stencil.extent[axis] = 2 * radius + 1;
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
Stencil set_of(double radius, int axes, bool of_sum, const Inside& inside) {
    Stencil stencil = filled(static_cast<std::int64_t>(std::floor(radius)), axes,
                             [&](double x, double y, double z) {
                                 if (of_sum) return inside(x, y, z) ? 1.0 : 0.0;
                                 return inside(x, y, z) ? 0.0 : kHole;
                             });
    if (of_sum) normalise(stencil);
    stencil.size = radius;
    return stencil;
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

FilterOp filter_op_named(std::string_view name) {
    return static_cast<FilterOp>(place_of(name, kOps, "op"));
}

const std::vector<FilterOp>& filter_ops() {
    static const std::vector<FilterOp> all{
        FilterOp::convolve, FilterOp::correlate, FilterOp::dilate, FilterOp::erode,
        FilterOp::open,     FilterOp::close,     FilterOp::tophat, FilterOp::median};
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

Stencil Stencil::box(double radius, int axes, bool of_sum) {
    Stencil stencil = set_of(radius, axes, of_sum, [](double, double, double) { return true; });
    stencil.shape = Shape::box;
    stencil.name = fmt::format("box:{:g}", radius);
    return stencil;
}

Stencil Stencil::gauss(double sigma, int axes) {
    constexpr double kReach = 4;
    const auto radius = static_cast<std::int64_t>(std::floor(kReach * sigma + 0.5));
    Stencil stencil = filled(radius, axes, [&](double x, double y, double z) {
        return std::exp(-0.5 * (x * x + y * y + z * z) / (sigma * sigma));
    });
    normalise(stencil);
    stencil.shape = Shape::gauss;
    stencil.size = sigma;
    stencil.name = fmt::format("gauss:{:g}", sigma);
    return stencil;
}

Stencil Stencil::ball(double radius, int axes, bool of_sum) {
    Stencil stencil = set_of(radius, axes, of_sum, [&](double x, double y, double z) {
        return x * x + y * y + z * z <= radius * radius;
    });
    stencil.shape = Shape::ball;
    stencil.name = fmt::format("sphere:{:g}", radius);
    return stencil;
}

Stencil Stencil::cross(double radius, int axes, bool of_sum) {
    Stencil stencil = set_of(radius, axes, of_sum, [](double x, double y, double z) {
        return int(x != 0) + int(y != 0) + int(z != 0) <= 1;
    });
    stencil.shape = Shape::cross;
    stencil.name = fmt::format("cross:{:g}", radius);
    return stencil;
}

Stencil Stencil::sobel(int axis, int axes) {
    constexpr std::array<double, 3> along = {-1, 0, 1}, across = {1, 2, 1};
    Stencil stencil = filled(1, axes, [&](double x, double y, double z) {
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
    Stencil stencil = filled(1, axes, [&](double x, double y, double z) {
        const double distance = std::abs(x) + std::abs(y) + std::abs(z);
        return distance == 0 ? -2.0 * axes : distance == 1 ? 1.0 : 0.0;
    });
    stencil.name = "laplace";
    return stencil;
}

}  // namespace edgewise
