#include "graph/modes/minip.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

#include "graph/request.hpp"

namespace edgewise {
namespace {

void add(Stretch& stretch, std::span<const double> values, const double* pieces, const Request&) {
    double least = stretch.state[0];
    stretch.each_finite(values, pieces,
                        [&](double value, double) { least = std::min(least, value); });
    stretch.state[0] = least;
}

std::string needs(const Request& want, double common, double, double high) {
    return common != high || common != want.miss
               ? fmt::format("the commonest value {} is not the largest, {}", common, high)
               : "";
}

}  // namespace

/// Minimum intensity projection: airways in a CT of the chest.
const ModeTraits minip_mode = {
    .name = "minip",
    .help = "least value along the ray",
    .combine = Combine::max,
    .negated = true,
    .miss = ModeTraits::Miss::highest,
    .extreme = -1,
    .skips = ModeTraits::Levels::values,
    .needs = needs,
    .timed_as = "mip",
    .guess = {0.038, 0.050, 0.021},
    .gain = [](bool noise, double, double, double) { return noise ? 1.2 : 3.5; },
    .empty = [](Stretch& stretch) { stretch.state[0] = std::numeric_limits<double>::infinity(); },
    .add = add,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            stretch.state[0] = std::min(stretch.state[0], behind.state[0]);
        },
    .result = [](const Stretch& stretch, const Request& want,
                 double* values) { values[0] = stretch.length > 0 ? stretch.state[0] : want.miss; },
};

}  // namespace edgewise
