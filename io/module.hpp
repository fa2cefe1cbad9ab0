#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "io/store.hpp"

namespace edgewise::store {

/// ITK, OpenImageIO and the decoders of DICOM cost 18, 120 and 8 MB of resident memory as soon as
/// they are linked, more than a small --max-memory. So each sits in a library of its own, opened
/// when a file of theirs is met.
enum class Library { itk, oiio, dicom };

/// What crosses the border: plain data, so that no type of theirs is needed here.
struct ModuleImage {
    std::int64_t size[3] = {1, 1, 1};
    int axes = 2;
    int channels = 1;
    int type = 0;  // a Type
    double spacing[3] = {1, 1, 1}, origin[3] = {0, 0, 0};
    double direction[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // three columns
    int alpha = 0;                                      // an Alpha
    char format[32] = "";
};
/// One compressed frame of DICOM, as its file describes it.
struct ModuleFrame {
    const char* kind = "";  // "JPEG", "JPEG-LS", "JPEG 2000"
    int columns = 0, rows = 0, samples = 1;
    int allocated = 8;  // bits of a sample in memory
    int bits = 8;       // of a sample in the stream
    int planar = 0;     // answer: channels lie one after another
};
inline constexpr std::size_t kModuleError = 1024;
inline constexpr const char* kInspectName = "edgewise_inspect";
inline constexpr const char* kReadName = "edgewise_read";
inline constexpr const char* kDecodeName = "edgewise_decode";
/// All return false and a message instead of throwing.
using ModuleInspect = bool (*)(const char* path, ModuleImage* found, char* error);
using ModuleRead = bool (*)(const char* path, const ModuleImage* image, void* into,
                            std::size_t bytes, char* error);
using ModuleDecode = bool (*)(const void* data, std::size_t size, ModuleFrame* frame, void* into,
                              std::size_t bytes, char* error);

/// What these libraries decode hardly shrinks further, not even constant pictures.
inline constexpr std::int64_t kDensest = 1 << 16;

/// Resident memory that opening the library takes.
std::size_t bytes_of(Library library) noexcept;
/// @throws InputError the library is not there, or cannot read the file
ModuleImage module_inspect(Library, const std::string& path);
void module_read(Library, const std::string& path, const ModuleImage&, std::span<std::byte> into);
void module_decode(Library, const std::string& path, ModuleFrame&, std::span<const std::byte> data,
                   std::span<std::byte> into);

}  // namespace edgewise::store
