#include "transitions/filters/read_by.hpp"

#include <fmt/format.h>

namespace edgewise {

std::string not_read_by(const Filter& filter, const ReadBy& samples) {
    if (samples.coefficients != filter.coefficients)
        return samples.coefficients
                   ? fmt::format("coefficients are no samples, as filter={} reads", filter.name)
                   : fmt::format("filter={} reads the coefficients of a prefilter", filter.name);
    if (samples.labels && filter.taps > 1) return "labels: only filter=zoh makes no new value";
    if (!filter.positive && samples.non_finite > 0)
        return fmt::format(
            "{} samples are not finite, and all that filter={} reads near them would be",
            samples.non_finite, filter.name);
    return {};
}

}  // namespace edgewise
