#pragma once

#include <string>

#include "io/module.hpp"

namespace edgewise::store {

void tell(char* error, const std::string& what);

// Where OpenImageIO 2.4 cannot: its WebP is never lossless, its JPEG 2000 fails below 32 pixels.
// Both as ModuleWrite.
bool write_webp(const ModuleImage&, const void* samples, int quality, const ModuleSink&,
                char* error);
bool write_jpeg2000(const ModuleImage&, const void* samples, int quality, const ModuleSink&,
                    char* error);

}  // namespace edgewise::store
