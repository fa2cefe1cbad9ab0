#pragma once

#include <string>

#include "io/module.hpp"

namespace edgewise::store {

void tell(char* error, const std::string& what);

// Where OpenImageIO 2.4 cannot: its WebP is never lossless and forgets colour where alpha is 0, its
// JPEG 2000 fails below 32 pixels. As ModuleInspect, ModuleRead and ModuleWrite.
/// @return false without an error where the file is an animation
bool inspect_webp(const char* path, ModuleImage&, char* error);
bool read_webp(const char* path, const ModuleImage&, void* into, std::size_t bytes, char* error);
bool write_webp(const ModuleImage&, const void* samples, int quality, const ModuleSink&,
                char* error);
bool write_jpeg2000(const ModuleImage&, const void* samples, int quality, const ModuleSink&,
                    char* error);

}  // namespace edgewise::store
