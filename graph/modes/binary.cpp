#include "graph/modes/binary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graph/request.hpp"

namespace edgewise {
namespace {

// state: 1 where a value has reached the level; the largest value. White, premultiplied.

enum : std::size_t { kReached, kLargest };
constexpr double kLowest = -std::numeric_limits<double>::infinity();

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    auto& state = stretch.state;
    stretch.each_finite(values, pieces, [&](double value, double) {
        if (value >= want.level()) state[kReached] = 1;
        state[kLargest] = std::max(state[kLargest], value);
    });
}

void add_samples(const RayRule::Setting& setting, const float* stored, const float* weights,
                 float* state, std::ptrdiff_t, int rays) {
    const bool falls = setting.values.slope < 0;
    const auto level = static_cast<float>(setting.stored_level());
    for (int ray = 0; ray < rays; ++ray) {
        const float value = stored[ray];
        const bool reached = falls ? value <= level : value >= level;
        if (reached && weights[ray] > 0 && std::isfinite(value)) state[ray] = 1;
    }
}

const RayRule kRule = {
    .planes = 1,
    .channels = 4,
    .clear = [](float* state, std::ptrdiff_t, int rays) { std::fill_n(state, rays, 0.0F); },
    .add = add_samples,
    .join = [](float* into, std::ptrdiff_t, const float* from,
               std::ptrdiff_t) { *into = std::max(*into, *from); },
    .finish = [](const RayRule::Setting&, const float* state, std::ptrdiff_t,
                 float* out) { std::fill_n(out, 4, *state); },
};

const Threshold kThreshold = {
    .margin = [](const Stretch& stretch,
                 const Request& want) { return stretch.state[kLargest] - want.level(); },
    .flip = [](Stretch& stretch) { stretch.state[kReached] = 1 - stretch.state[kReached]; },
};

}  // namespace

/// Opaque white where the value reaches a level: the segmented object of the thesis.
const ModeTraits binary_mode = {
    .name = "binary",
    .help = "opaque where the value reaches @isovalue",
    .rule = &kRule,
    .channels = 4,
    .over_background = true,
    .takes_level = true,
    .threshold = &kThreshold,
    .needs = [](const Request& want, double common, double, double) -> std::string {
        return common >= want.level() ? "the commonest value reaches the level" : "";
    },
    .operations = 3,
    .guess = {0.15, 0.12, 0.08},
    .gain = [](bool noise, double, double, double range) { return (noise ? 0.5 : 3.0) / range; },
    .empty = [](Stretch& stretch) { stretch.state[kLargest] = kLowest; },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            for (const std::size_t i : {kReached, kLargest})
                stretch.state[i] = std::max(stretch.state[i], behind.state[i]);
        },
    .result = [](const Stretch& stretch, const Request&,
                 double* values) { std::fill_n(values, 4, stretch.state[kReached]); },
};

}  // namespace edgewise
