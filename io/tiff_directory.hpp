#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/file.hpp"

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
    std::uint64_t stored = 0;   // bytes of all strips or tiles
    std::uint64_t first = 0;    // offset of the first
    bool in_one_piece = false;  // they follow one another
    bool big_endian = false;
    std::uint64_t text = 0, text_bytes = 0;  // ImageDescription
    std::vector<std::uint16_t> colours;      // all reds, all greens, all blues
    double resolution[2] = {0, 0};           // pixels a unit along x and y; 0: not said
    int resolution_unit = 2;                 // 1 none, 2 inch, 3 centimetre
    std::uint64_t icc = 0, icc_bytes = 0;
    std::uint64_t imagej = 0, imagej_bytes = 0;  // ImageJ's own block
    std::vector<std::uint32_t> imagej_parts;     // bytes of its head, then of each of its parts
};

/// By its first four bytes, TIFF and BigTIFF.
bool is_tiff(std::span<const std::byte> head) noexcept;

/// All pages in order. @throws InputError a directory beyond the end or met twice, sizes of 0,
/// strips outside the file, sizes that the strips cannot hold
std::vector<TiffPage> tiff_pages(const File& file);

}  // namespace edgewise::store
