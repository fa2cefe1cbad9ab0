#pragma once

#include <string>

#include "io/surface_file.hpp"

namespace edgewise::store {

/// @throws RunError
void write_stl(const std::string& path, const SurfaceView& surface);

}  // namespace edgewise::store
