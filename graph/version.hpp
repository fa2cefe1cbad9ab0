#pragma once

#include <string>

namespace edgewise {

/// Of this build: "major.minor.patch".
const std::string& version();

}  // namespace edgewise
