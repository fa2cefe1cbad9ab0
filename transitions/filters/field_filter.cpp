#include "transitions/filters/field_filter.hpp"

#include <algorithm>
#include <stdexcept>

namespace edgewise {
namespace {

/// Two weights that keep linear functions are those of the line between two samples, and four of
/// coefficients those of the cubic B-spline.
bool gives(const Filter& filter, Field field) {
    switch (field) {
        case Field::nearest:
            return filter.taps == 1;
        case Field::linear:
            return filter.taps == 2 && filter.order == 2;
        case Field::spline:
        case Field::formula:
            return filter.taps == 4 && filter.coefficients;
    }
    return false;
}

}  // namespace

const Filter& field_filter(Field field) {
    const auto found = std::find_if(filters().begin(), filters().end(),
                                    [&](const Filter& filter) { return gives(filter, field); });
    if (found == filters().end()) throw std::logic_error("no filter gives the field of a request");
    return *found;
}

}  // namespace edgewise
