#pragma once

#include "settings/setting.hpp"

namespace edgewise::reads {

/// A step of the geometry: its numbers as a text, as a list, or, of a matrix or path, in a file.
Reader step(GeometryStep::Kind kind);

}  // namespace edgewise::reads
