#include "graph/modes/top2.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graph/request.hpp"

namespace edgewise {
namespace {

// state: the highest value and the second. What is missing counts as the least value of the data.

constexpr double kNone = -std::numeric_limits<double>::infinity();

template <class Number>
void take(Number& first, Number& second, Number value) {
    second = std::max(second, std::min(first, value));
    first = std::max(first, value);
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces, const Request&) {
    stretch.each_finite(values, pieces, [&](double value, double) {
        take(stretch.state[0], stretch.state[1], value);
    });
}

// In f32 of stored numbers, with the other sign where the slope is negative.

void add_samples(const RayRule::Setting& setting, const float* stored, const float* weights,
                 float* state, std::ptrdiff_t plane, int rays) {
    const float sign = setting.values.slope < 0 ? -1.0F : 1.0F;
    for (int ray = 0; ray < rays; ++ray)
        if (weights[ray] > 0 && std::isfinite(stored[ray]))
            take(state[ray], state[plane + ray], sign * stored[ray]);
}

const RayRule kRule = {
    .planes = 2,
    .clear =
        [](float* state, std::ptrdiff_t plane, int rays) {
            for (int p = 0; p < 2; ++p)
                std::fill_n(state + p * plane, rays, static_cast<float>(kNone));
        },
    .add = add_samples,
    .join =
        [](float* into, std::ptrdiff_t plane, const float* from, std::ptrdiff_t from_plane) {
            for (int p = 0; p < 2; ++p) take(into[0], into[plane], from[p * from_plane]);
        },
    .finish =
        [](const RayRule::Setting& setting, const float* state, std::ptrdiff_t plane, float* out) {
            const double sign = setting.values.slope < 0 ? -1 : 1;
            double sum = 0;
            for (const float stored : {state[0], state[plane]})
                sum += std::isfinite(stored) ? setting.values(sign * stored) : setting.miss;
            *out = static_cast<float>(sum);
        },
};

}  // namespace

/// The two highest samples of a ray, added up. It depends on where samples are: one a unit.
const ModeTraits top2_mode = {
    .name = "top2",
    .help = "sum of the two highest samples, one a unit of length",
    .rule = &kRule,
    .miss = ModeTraits::Miss::lowest,
    .sampled_every = 1,
    .kept = "the second highest sample may be an empty one",
    .operations = 6,
    .state_numbers = 2,
    .guess = {0.05, 0.06, 0.03},
    .gain = [](bool noise, double, double, double) { return noise ? 2.0 : 6.0; },
    .empty = [](Stretch& stretch) { stretch.state[0] = stretch.state[1] = kNone; },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            for (int i = 0; i < 2; ++i)
                take(stretch.state[0], stretch.state[1], behind.state[static_cast<std::size_t>(i)]);
        },
    .result =
        [](const Stretch& stretch, const Request& want, double* values) {
            values[0] = 0;
            for (int i = 0; i < 2; ++i) {
                const double value = stretch.state[static_cast<std::size_t>(i)];
                values[0] += std::isfinite(value) ? value : want.miss;
            }
        },
};

}  // namespace edgewise
