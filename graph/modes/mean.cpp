#include "graph/modes/mean.hpp"

#include "graph/request.hpp"

namespace edgewise {
namespace {

void add(Stretch& stretch, std::span<const double> values, const double* pieces, const Request&) {
    double sum = stretch.state[0];
    stretch.each_finite(values, pieces, [&](double value, double piece) { sum += value * piece; });
    stretch.state[0] = sum;
}

void add_lit(Stretch& stretch, double value, double piece, const std::function<Lit()>& lit,
             const Request&) {
    const Lit by = lit();
    stretch.state[0] += (by.diffuse * value + by.specular) * piece;
}

constexpr Shade kShades[] = {Shade::hemisphere, Shade::lambert};

}  // namespace

/// The integral over the ray's length inside the volume.
const ModeTraits mean_mode = {
    .name = "mean",
    .help = "mean value over the ray's length inside the volume",
    .combine = Combine::mean,
    .miss = ModeTraits::Miss::lowest,
    .shades = kShades,
    .takes_cue = true,
    .divides = true,
    .averages = true,
    .slices = ModeTraits::Slices::mean,
    .kept = "a mean counts the empty samples too",
    .state_numbers = 2,
    .guess = {0.0044, 0.0026, 0.0013},
    .gain = [](bool noise, double length, double,
               double) { return gain_of_integral(noise, length) / length; },
    .add = add,
    .add_lit = add_lit,
    .append = [](Stretch& stretch, const Stretch& behind) { stretch.state[0] += behind.state[0]; },
    .result =
        [](const Stretch& stretch, const Request& want, double* values) {
            values[0] = stretch.length > 0 ? stretch.state[0] / stretch.length : want.miss;
        },
};

}  // namespace edgewise
