#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/request/query.hpp"

namespace edgewise::cli {

/// Geometry as it was typed.
struct GeometryWords {
    std::optional<std::string> view, about, perspective, eye, look_at, spacing, size, zoom, move;
    std::optional<std::string> clip, slab;
    std::vector<std::string> clip_planes, clip_balls;
    /// rotate, matrix, scale, translate, shear, turntable, path with their values, in the order
    /// given.
    std::vector<std::pair<std::string, std::string>> steps;
};

/// --clip, --clip-plane, --clip-ball and --slab. @throws RequestError
ClipSpec clip_spec(const GeometryWords& words);

/// Reads the numbers, and the files of --matrix and --path.
/// @throws RequestError naming the option, its value and what was expected
GeometrySpec geometry_spec(const GeometryWords& words);

}  // namespace edgewise::cli
