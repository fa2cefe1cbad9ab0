#include <algorithm>
#include <cmath>

#include "graph/errors.hpp"
#include "transitions/filters/bspline3.hpp"
#include "transitions/filters/foh.hpp"
#include "transitions/filters/keys.hpp"
#include "transitions/filters/keys6.hpp"
#include "transitions/filters/lanczos3.hpp"
#include "transitions/filters/zoh.hpp"

namespace edgewise {

const std::vector<Filter>& filters() {
    static const std::vector<Filter> all = {
        zoh_filter(),  foh_filter(),      bspline3_filter(),
        keys_filter(), lanczos3_filter(), keys6_filter(),
    };
    return all;
}

const Filter& filter_named(std::string_view name) {
    const auto found = std::find_if(filters().begin(), filters().end(),
                                    [&](const Filter& filter) { return filter.name == name; });
    if (found != filters().end()) return *found;
    std::string known;
    for (const Filter& filter : filters()) known += (known.empty() ? "" : ", ") + filter.name;
    throw RequestError("no filter is called \"" + std::string(name) + "\"; there are " + known);
}

double Filter::operations_of(int axes) const noexcept {
    // Sums along x of all rows, then along y, then along z: t^3 + t^2 + t products and sums.
    double sums = 0;
    for (int axis = 1; axis <= axes; ++axis) sums += 2 * std::pow(taps, axis);
    return axes * operations + sums;
}

Domain any_filter(const std::vector<std::string>& tried) {
    std::vector<std::string> names;
    std::string help = "reconstruction:";
    for (const Filter& filter : filters()) {
        help += (names.empty() ? " " : ", ") + filter.name + " " + filter.help;
        names.push_back(filter.name);
    }
    return one_of(names, {tried.begin(), tried.end()}, help);
}

}  // namespace edgewise
