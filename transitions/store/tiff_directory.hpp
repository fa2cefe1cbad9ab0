#pragma once

#include <cstdint>
#include <vector>

#include "transitions/store/file.hpp"

namespace edgewise::store {

/// LZW, deflate and the rest expand less than this.
inline constexpr std::int64_t kTiffDensest = 1 << 14;

/// One page of a TIFF or BigTIFF, read and checked without libtiff.
struct TiffPage {
    std::uint64_t at = 0;  // of its directory
    std::int64_t width = 0, height = 0;
    int bits = 1, samples = 1, format = 1;  // format: 1 unsigned, 2 signed, 3 floating
    int compression = 1, photometric = 1, planar = 1, orientation = 1;
    bool mixed = false;    // channels of different bits
    bool reduced = false;  // a thumbnail of another page
    bool alpha = false, premultiplied = false;
    std::uint64_t stored = 0;  // bytes of all strips or tiles
    std::uint64_t icc = 0, icc_bytes = 0;
};

/// All pages in order. @throws InputError a directory beyond the end or met twice, sizes of 0,
/// strips outside the file, sizes that the strips cannot hold
std::vector<TiffPage> tiff_pages(const File& file);

}  // namespace edgewise::store
