#pragma once

#include <functional>

namespace edgewise::kernels {

/// Asked once a line of work, by several threads: true to return soon, with the output unfinished.
/// Empty: never.
using Stop = std::function<bool()>;

inline bool stopped(const Stop& stop) { return stop && stop(); }

}  // namespace edgewise::kernels
