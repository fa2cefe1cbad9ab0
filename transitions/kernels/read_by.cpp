#include "transitions/kernels/read_by.hpp"

#include <fmt/format.h>

namespace edgewise {

std::string not_read_by(const Filter& filter, const std::string& content, const Ask& ask) {
    const bool coefficients = content == "coefficients";
    if (coefficients != filter.coefficients)
        return coefficients
                   ? fmt::format("coefficients are no samples, as filter={} reads", filter.name)
                   : fmt::format("filter={} reads the coefficients of a prefilter", filter.name);
    if (ask.want.field == Field::nearest && filter.taps > 1)
        return "labels: only filter=zoh makes no new value";
    if (!filter.positive && ask.scene.non_finite > 0)
        return fmt::format(
            "{} samples are not finite, and all that filter={} reads near them would be",
            ask.scene.non_finite, filter.name);
    return {};
}

}  // namespace edgewise
