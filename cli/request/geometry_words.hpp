#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/request/spec.hpp"

namespace edgewise::cli {

/// Geometry as it was typed.
struct GeometryWords {
    std::optional<std::string> view, about, perspective, spacing, size, zoom, move;
    /// rotate, matrix, scale, translate, shear, turntable with their values, in the order given.
    std::vector<std::pair<std::string, std::string>> steps;
};

/// Reads the numbers, and the file of --matrix.
/// @throws RequestError naming the option, its value and what was expected
GeometrySpec geometry_spec(const GeometryWords& words);

}  // namespace edgewise::cli
