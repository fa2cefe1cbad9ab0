#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <span>
#include <string>

#include "io/module.hpp"

namespace edgewise::store {

/// What a call apart may use before it is ended.
struct Allowance {
    std::size_t memory = 0;  // bytes in addition to this process's; 0: no limit
    unsigned seconds = 5;    // of the processor
};

/// What came of it; `image` and `error` are the call's own.
struct Apart {
    bool whole = false;  // the call came to its end
    bool done = false;   // and returned true
    ModuleImage image;
    char error[kModuleError] = "";
};

/// Held while a library works in this process: its locks must not be taken along into a copy.
std::mutex& at_work();

/// Runs a call in a copy of this process, so that a library that fails on damaged data, hangs or
/// asks for much memory takes no more than that copy along.
/// @param into  becomes what the call left in the memory that it is given, of this size
Apart apart(const ModuleImage& image, std::span<std::byte> into, const Allowance& allowance,
            const std::function<bool(ModuleImage&, void* into, char* error)>& call);

}  // namespace edgewise::store
