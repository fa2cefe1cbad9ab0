#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace edgewise::store {

/// Rows of a picture as PNG stores them: 16-bit samples in the order of the machine.
struct PngRows {
    const std::byte* first = nullptr;
    std::size_t stride = 0;  // bytes of a row
    std::int64_t height = 0;
    int channels = 1;
    int bytes = 1;  // of a sample: 1, 2
};

/// Filters and compresses a picture in parallel and hands over the contents of its IDAT chunks, in
/// order: together they are one zlib stream. Stripes of rows are compressed by themselves, each
/// with the end of the one before as its dictionary, so the bytes do not depend on threads. Takes a
/// few MiB, whatever the picture's size. Filters: the least sum of absolute differences in each row
/// (PNG, third edition, 12.7).
void compress_png(const PngRows& rows, const std::function<void(std::span<const std::byte>)>& take);

}  // namespace edgewise::store
