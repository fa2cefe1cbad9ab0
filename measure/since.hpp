#pragma once

#include <chrono>

namespace edgewise {

/// Wall time from `begin` to now [s].
inline double since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace edgewise
