#pragma once

#include <cstddef>
#include <string>

namespace edgewise {

/// A number of samples to measure the error on, or all (0); "": a usual one. @throws RequestError
std::size_t verify_count(const std::string& text);

}  // namespace edgewise
