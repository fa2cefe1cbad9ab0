#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "io/file.hpp"

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
    /// Name of the library's reader or writer. Asked of OpenImageIO: no other sees the file.
    char format[32] = "";
    int window = 1;   // answer: the picture fills the window that it is shown in
    int several = 0;  // answer: the file holds more pictures, of which this is the first
};
/// Takes the bytes of a file that is written. @return false where that fails
struct ModuleSink {
    void* self = nullptr;
    bool (*put)(void* self, std::uint64_t at, const void* bytes, std::size_t count) = nullptr;
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
inline constexpr const char* kWriteName = "edgewise_write";
inline constexpr const char* kDecodeName = "edgewise_decode";
/// All return false and a message instead of throwing.
using ModuleInspect = bool (*)(const char* path, ModuleImage* found, char* error);
using ModuleRead = bool (*)(const char* path, const ModuleImage* image, void* into,
                            std::size_t bytes, char* error);
/// @param quality  1..100, 0: every value is kept
using ModuleWrite = bool (*)(const ModuleImage* image, const void* samples, std::size_t bytes,
                             int quality, const ModuleSink* sink, char* error);
using ModuleDecode = bool (*)(const void* data, std::size_t size, ModuleFrame* frame, void* into,
                              std::size_t bytes, char* error);

/// What these libraries decode hardly shrinks further, not even constant pictures.
inline constexpr std::int64_t kDensest = 1 << 16;

/// Resident memory that opening the library takes.
std::size_t bytes_of(Library library) noexcept;
/// @throws InputError the library is not there, or cannot read the file
/// @param claimed  bytes of samples by the file's header, checked against its length; 0: not known
ModuleImage module_inspect(Library, const std::string& path, const char* format = "",
                           std::int64_t claimed = 0);
/// What every file of that library gives: header, checks, reader.
Header inspect_by(Library, const std::string& path, const char* format, std::int64_t claimed = 0);
/// The type that module_read gives: halves come as f32.
inline Type module_type(const ModuleImage& image) noexcept {
    return static_cast<Type>(image.type) == Type::f16 ? Type::f32 : static_cast<Type>(image.type);
}
void module_read(Library, const std::string& path, const ModuleImage&, std::span<std::byte> into);
/// @throws RunError the file cannot be written, or not by this library
void module_write(Library, Replacement& out, const ModuleImage&, std::span<const std::byte> samples,
                  int quality);
void module_decode(Library, const std::string& path, ModuleFrame&, std::span<const std::byte> data,
                   std::span<std::byte> into);

}  // namespace edgewise::store
