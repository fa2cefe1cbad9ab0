#include "graph/modes/stddev.hpp"

#include <algorithm>
#include <cmath>

#include "graph/request.hpp"

namespace edgewise {
namespace {

// In f64 the sum of the values and that of their squares' distances from the mean.

/// Joins what two parts differ from their own means by (Chan, Golub, LeVeque 1979).
void join(Stretch& stretch, double length, double sum, double squares) {
    if (!(length > 0)) return;
    double& all = stretch.state[0];
    const double before = stretch.length;
    if (before > 0) {
        const double apart = sum / length - all / before;
        squares += apart * apart * before / (before + length) * length;
    }
    all += sum;
    stretch.state[1] += squares;
    stretch.length = before + length;
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces, const Request&) {
    for (std::size_t i = 0; i < values.size(); ++i)
        if (std::isfinite(values[i])) join(stretch, pieces[i], values[i] * pieces[i], 0);
}

// In f32 the running mean and what values differ from it by (Welford 1962; West 1979). Means are
// kept from the first sample on, so that detail on a large offset is not rounded away.

void add_samples(const RayRule::Setting&, const float* stored, const float* weights, float* state,
                 std::ptrdiff_t plane, int rays) {
    for (int ray = 0; ray < rays; ++ray) {
        const float value = stored[ray];
        const float weight = std::isfinite(value) ? weights[ray] : 0.0F;
        float& length = state[ray];
        float& origin = state[plane + ray];
        float& mean = state[2 * plane + ray];
        float& squares = state[3 * plane + ray];
        if (!(weight > 0)) continue;
        if (!(length > 0)) origin = value;
        const float above = value - origin, apart = above - mean;
        length += weight;
        mean += weight / length * apart;
        squares += weight * apart * (above - mean);
    }
}

void join_rays(float* into, std::ptrdiff_t plane, const float* from, std::ptrdiff_t from_plane) {
    const float before = into[0], behind = from[0], length = before + behind;
    if (!(length > 0)) return;
    if (!(before > 0)) into[plane] = from[from_plane];
    const float origins = from[from_plane] - into[plane];
    const float apart = origins + from[2 * from_plane] - into[2 * plane];
    into[0] = length;
    into[2 * plane] += behind / length * apart;
    into[3 * plane] += from[3 * from_plane] + before / length * behind * apart * apart;
}

const RayRule kRule = {
    .planes = 4,  // length, origin, mean above it, squares
    .clear =
        [](float* state, std::ptrdiff_t plane, int rays) {
            for (int p = 0; p < 4; ++p) std::fill_n(state + p * plane, rays, 0.0F);
        },
    .add = add_samples,
    .join = join_rays,
    .finish =
        [](const RayRule::Setting& setting, const float* state, std::ptrdiff_t plane, float* out) {
            const double variance = static_cast<double>(state[3 * plane]) / state[0];
            *out = static_cast<float>(
                state[0] > 0 ? std::abs(setting.values.slope) * std::sqrt(variance) : setting.miss);
        },
};

}  // namespace

/// Standard deviation of the values along the ray, of the population, weighed by length.
const ModeTraits stddev_mode = {
    .name = "stddev",
    .help = "standard deviation along the ray, by length",
    .rule = &kRule,
    .divides = true,
    .cancelled = [](const Request& want) { return want.magnitude; },
    .kept = "a standard deviation counts the empty samples too",
    .operations = 8,
    .state_numbers = 4,
    .guess = {0.015, 0.02, 0.008},
    // A seminorm: it moves by no more than the errors' own deviation.
    .gain = [](bool noise, double length, double,
               double) { return noise ? 1 / std::sqrt(length) : 1; },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            const double before = stretch.length;
            join(stretch, behind.length, behind.state[0], behind.state[1]);
            stretch.length = before;
        },
    .result =
        [](const Stretch& stretch, const Request&, double* values) {
            values[0] = stretch.length > 0 ? std::sqrt(stretch.state[1] / stretch.length) : 0;
        },
};

}  // namespace edgewise
