#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "charts/table.hpp"

namespace edgewise::charts {

/// A path over the values of a sweep at which it was measured.
struct Course {
    std::string path, family;
    std::vector<std::size_t> points;  // of the table, by value
    std::size_t number = 0;           // from 1; 0: drawn behind the others
    std::size_t dash = 0;             // its place among the numbered ones of its family
};

/// The paths of a sweep. Those that were chosen somewhere, or were on the measured front at half of
/// their values or more, come first, family by family, and have numbers: these tell lines apart
/// where colours are not seen and dashes come again.
std::vector<Course> courses_of(const Table& table);

}  // namespace edgewise::charts
