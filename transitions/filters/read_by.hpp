#pragma once

#include <cstdint>
#include <string>

#include "transitions/filters/filter.hpp"

namespace edgewise {

/// What samples are, as far as filters go.
struct ReadBy {
    bool coefficients = false;    // of the cubic B-spline, in place of samples
    bool labels = false;          // no new value may appear
    std::int64_t non_finite = 0;  // how many are not finite
};

/// Why such samples cannot be read by a filter, or "".
std::string not_read_by(const Filter& filter, const ReadBy& samples);

}  // namespace edgewise
