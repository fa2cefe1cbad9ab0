#include "graph/modes/xray.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/message.hpp"
#include "graph/request.hpp"

namespace edgewise {
namespace {

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    double sum = stretch.state[0];
    stretch.each_finite(values, pieces, [&](double value, double piece) {
        sum += (value - want.zero) * piece * want.unit;
    });
    stretch.state[0] = sum;
}

void add_lit(Stretch& stretch, double value, double piece, const std::function<Lit()>& lit,
             const Request& want) {
    const Lit by = lit();
    stretch.state[0] += (by.diffuse * (value - want.zero) + by.specular) * piece * want.unit;
}

constexpr Shade kShades[] = {Shade::hemisphere, Shade::lambert};

std::string needs(const Request& want, double common, double, double) {
    if (common == want.zero) return {};
    return message("the commonest value is {}, @zero({})", common, want.zero).marked();
}

}  // namespace

/// The integral along the ray [value x file unit].
const ModeTraits xray_mode = {
    .name = "xray",
    .help = "integral of (value - zero) along the ray",
    .combine = Combine::sum,
    .takes_zero = true,
    .shades = kShades,
    .takes_cue = true,
    .cancelled =
        [](const Request& want) {
            const auto depth = static_cast<double>(std::max<std::int64_t>(1, want.screen.z));
            return std::abs(want.zero) * want.unit * depth;
        },
    .averages = true,
    .slices = ModeTraits::Slices::integral,
    .needs = needs,
    .lengthen = [](double factor, std::span<double, 4> values) { values[0] *= factor; },
    .guess = {0.0044, 0.0026, 0.0013},
    .gain = [](bool noise, double length, double unit,
               double) { return gain_of_integral(noise, length) * unit; },
    .add = add,
    .add_lit = add_lit,
    .append = [](Stretch& stretch, const Stretch& behind) { stretch.state[0] += behind.state[0]; },
    .result = [](const Stretch& stretch, const Request&,
                 double* values) { values[0] = stretch.state[0]; },
};

}  // namespace edgewise
