#include "graph/modes/composite.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/request.hpp"
#include "graph/transfer_table.hpp"

namespace edgewise {
namespace {

// state: red, green, blue, premultiplied; the transparency that is left.

/// x to a power. Steps are parts of the unit by powers of two nearly always: roots of these are as
/// exact as std::pow, and three times as fast.
double raised(double x, double power) noexcept {
    if (power == 1) return x;
    if (power == 2) return x * x;
    if (power == 0.5) return std::sqrt(x);
    if (power == 0.25) return std::sqrt(std::sqrt(x));
    if (power == 0.125) return std::sqrt(std::sqrt(std::sqrt(x)));
    return std::pow(x, power);
}

/// @param lit  called where the sample is seen
template <class LitAt>
void add_one(Stretch& stretch, double value, double piece, const Request& want, LitAt&& lit_at) {
    auto& light = stretch.state;
    double& transparency = light[3];
    std::array<double, 4> optics = want.transfer.at(value);
    if (optics[3] <= 0) return;
    // EQ 53: the transparency of a length is that of the unit length to its power.
    // Behind so much that nothing is seen nobody asks for light.
    constexpr double kNothing = 1e-9;
    const Lit lit = transparency > kNothing ? lit_at() : Lit{};
    if (want.transfer.table && lit.gradient >= 0)
        optics = want.transfer.table->at(value, lit.gradient);
    const double kept = raised(1 - optics[3] * lit.opacity, piece * want.unit / want.transfer.unit);
    for (int c = 0; c < 3; ++c)
        light[c] += transparency * (1 - kept) * (optics[c] * lit.diffuse + lit.specular);
    transparency *= kept;
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    stretch.each_finite(values, pieces, [&](double value, double piece) {
        add_one(stretch, value, piece, want, [] { return Lit{}; });
    });
}

void add_lit(Stretch& stretch, double value, double piece, const std::function<Lit()>& lit,
             const Request& want) {
    add_one(stretch, value, piece, want, lit);
}

bool is_seen(double value, const Request& want) { return want.transfer.at(value)[3] > 0; }

std::string needs(const Request& want, double common, double, double) {
    return want.transfer.at(common)[3] != 0
               ? fmt::format("the commonest value {} is not transparent", common)
               : "";
}

/// Where the transfer function is steep, values' rounding shows.
double cancelled(const Request& want) {
    if (want.transfer.table) return want.transfer.table->steepest * want.magnitude;
    double steepest = 0;
    const std::vector<Transfer::Point>& points = want.transfer.points;
    for (std::size_t i = 1; i < points.size(); ++i)
        if (const double width = points[i].value - points[i - 1].value; width > 0)
            steepest =
                std::max(steepest, std::abs(points[i].opacity - points[i - 1].opacity) / width);
    return steepest * want.magnitude;
}

/// EQ 53: the transparency of a length is that of the unit length to its power.
void lengthen(double factor, std::span<double, 4> values) {
    if (!(values[3] > 0)) return;
    const double opacity = 1 - std::pow(std::max(0.0, 1 - values[3]), factor);
    const double scale = opacity / values[3];
    for (double& value : values) value *= scale;
}

constexpr Shade kShades[] = {Shade::phong, Shade::torrance_sparrow, Shade::particles};

}  // namespace

/// Emission and opacity, front to back (EQ 62 and 63).
const ModeTraits composite_mode = {
    .name = "composite",
    .help = "emission and opacity, front to back",
    .combine = Combine::over,
    .channels = 4,
    .over_background = true,
    .takes_transfer = true,
    .shades = kShades,
    .takes_cue = true,
    .cancelled = cancelled,
    .skips = ModeTraits::Levels::opacities,
    .left = [](const Stretch& stretch) { return stretch.state[3]; },
    .needs = needs,
    .lengthen = lengthen,
    .state_numbers = 4,
    .guess = {0.011, 0.014, 0.003},
    .gain = [](bool noise, double, double, double range) { return (noise ? 0.16 : 0.55) / range; },
    .empty = [](Stretch& stretch) { stretch.state[3] = 1; },
    .add = add,
    .add_lit = add_lit,
    .is_seen = is_seen,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            for (int c = 0; c < 3; ++c) stretch.state[c] += stretch.state[3] * behind.state[c];
            stretch.state[3] *= behind.state[3];
        },
    .result =
        [](const Stretch& stretch, const Request&, double* values) {
            std::copy_n(stretch.state.begin(), 3, values);
            values[3] = 1 - stretch.state[3];
        },
};

}  // namespace edgewise
