#include "graph/modes/drr.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/request.hpp"

namespace edgewise {
namespace {

// state: the integral of HU, of at least -1000, over the length inside.

constexpr double kWater = 0.0206;  // attenuation of water at about 60 keV [1 / mm]

constexpr double kAir = -1000;  // Hounsfield units: takes away nothing, and nothing does less

/// What is left behind a length through water, and through what differs from it.
double intensity(double length, double hounsfield) {
    return std::exp(-kWater * (length - hounsfield / kAir));
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    stretch.each_finite(values, pieces, [&](double value, double piece) {
        stretch.state[0] += std::max(kAir, value) * piece * want.unit;
        stretch.state[1] += piece * want.unit;
    });
}

// In f32 lengths are summed up apart, so that little contrast on much water is not rounded away.

void add_samples(const RayRule::Setting& setting, const float* stored, const float* weights,
                 float* state, std::ptrdiff_t plane, int rays) {
    const auto slope = static_cast<float>(setting.values.slope),
               offset = static_cast<float>(setting.values.offset);
    for (int ray = 0; ray < rays; ++ray) {
        const float weight = std::isfinite(stored[ray]) ? weights[ray] : 0.0F;
        if (!(weight > 0)) continue;
        const float hounsfield = std::max(float(kAir), slope * stored[ray] + offset);
        state[ray] += weight * hounsfield;
        state[plane + ray] += weight;
    }
}

const RayRule kRule = {
    .planes = 2,
    .clear =
        [](float* state, std::ptrdiff_t plane, int rays) {
            for (int p = 0; p < 2; ++p) std::fill_n(state + p * plane, rays, 0.0F);
        },
    .add = add_samples,
    .join =
        [](float* into, std::ptrdiff_t plane, const float* from, std::ptrdiff_t from_plane) {
            into[0] += from[0];
            into[plane] += from[from_plane];
        },
    .finish =
        [](const RayRule::Setting& setting, const float* state, std::ptrdiff_t plane, float* out) {
            *out = static_cast<float>(intensity(setting.length * static_cast<double>(state[plane]),
                                                setting.length * static_cast<double>(state[0])));
        },
};

std::string needs(const Request&, double common, double, double) {
    return common > kAir
               ? fmt::format("the commonest value is {} HU, which takes away light", common)
               : "";
}

}  // namespace

/// A digitally reconstructed radiograph: the share of X-rays that is left behind a body whose
/// values are Hounsfield units, in a file in mm. A ray that misses keeps all of it.
const ModeTraits drr_mode = {
    .name = "drr",
    .help = "radiograph: exp(-attenuation) of values in Hounsfield units",
    .rule = &kRule,
    .light_left = true,
    .averages = true,
    .slices = ModeTraits::Slices::integral,
    .needs = needs,
    .operations = 6,
    .state_numbers = 2,
    .guess = {0.004, 0.0025, 0.0015},
    .gain = [](bool noise, double length, double unit,
               double) { return 1e-3 * kWater * unit * gain_of_integral(noise, length); },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            for (std::size_t i = 0; i < 2; ++i) stretch.state[i] += behind.state[i];
        },
    .result = [](const Stretch& stretch, const Request&,
                 double* values) { values[0] = intensity(stretch.state[1], stretch.state[0]); },
};

}  // namespace edgewise
