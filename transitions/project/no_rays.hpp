#pragma once

#include <string>

#include "graph/transition.hpp"

namespace edgewise {

/// Why no straight rays pass through a representation, whatever they gather; empty: they do. What
/// no_picture() asks first.
std::string no_rays(const Representation& from, const Ask& ask);

}  // namespace edgewise
