#include "graph/modes/mip.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

#include "graph/request.hpp"

namespace edgewise {
namespace {

void add(Stretch& stretch, std::span<const double> values, const double* pieces, const Request&) {
    double most = stretch.state[0];
    stretch.each_finite(values, pieces,
                        [&](double value, double) { most = std::max(most, value); });
    stretch.state[0] = most;
}

std::string needs(const Request& want, double common, double low, double) {
    return common != low || common != want.miss
               ? fmt::format("the commonest value {} is not the least, {}", common, low)
               : "";
}

}  // namespace

/// Maximum intensity projection.
const ModeTraits mip_mode = {
    .name = "mip",
    .help = "largest value along the ray",
    .combine = Combine::max,
    .miss = ModeTraits::Miss::lowest,
    .extreme = 1,
    .skips = ModeTraits::Levels::values,
    .needs = needs,
    .guess = {0.038, 0.050, 0.021},
    .gain = [](bool noise, double, double, double) { return noise ? 1.2 : 3.5; },
    .empty = [](Stretch& stretch) { stretch.state[0] = -std::numeric_limits<double>::infinity(); },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            stretch.state[0] = std::max(stretch.state[0], behind.state[0]);
        },
    .result = [](const Stretch& stretch, const Request& want,
                 double* values) { values[0] = stretch.length > 0 ? stretch.state[0] : want.miss; },
};

}  // namespace edgewise
