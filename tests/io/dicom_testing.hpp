#pragma once

#include <string_view>

#include "tests/io/store_testing.hpp"

namespace edgewise::store::testing {

/// An element of explicit VR, little-endian; an odd value gets its blank.
inline std::string element(std::uint16_t group, std::uint16_t number, const char* vr,
                           std::string value) {
    if (value.size() % 2) value += ' ';
    std::string bytes;
    put(bytes, 0, group);
    put(bytes, 2, number);
    bytes += vr;
    const bool wide = std::string_view(vr) == "OW" || std::string_view(vr) == "SQ";
    if (wide)
        put(bytes, 8, static_cast<std::uint32_t>(value.size()));
    else
        put(bytes, 6, static_cast<std::uint16_t>(value.size()));
    return bytes + value;
}
inline std::string word(std::uint16_t value) { return raw(std::vector<std::uint16_t>{value}); }

/// One slice of 4 x 5 i16 (rows x columns), for tests to spoil.
struct Slice {
    double z = 0;
    std::uint16_t rows = 4, columns = 5, stored = 16;
    std::string orientation = "1\\0\\0\\0\\1\\0", spacing = "2\\3", syntax = "1.2.840.10008.1.2.1",
                extra, slope = "1";
    std::vector<std::int16_t> pixels = ramp(20);
};
inline std::string dicom(const Slice& slice) {
    return std::string(128, '\0') + "DICM" + element(2, 0x10, "UI", slice.syntax) + slice.extra +
           element(0x20, 0xe, "UI", "1.2") +
           element(0x20, 0x32, "DS", "1\\2\\" + std::to_string(slice.z)) +
           element(0x20, 0x37, "DS", slice.orientation) + element(0x28, 2, "US", word(1)) +
           element(0x28, 4, "CS", "MONOCHROME2") + element(0x28, 0x10, "US", word(slice.rows)) +
           element(0x28, 0x11, "US", word(slice.columns)) +
           element(0x28, 0x30, "DS", slice.spacing) + element(0x28, 0x100, "US", word(16)) +
           element(0x28, 0x101, "US", word(slice.stored)) +
           element(0x28, 0x102, "US", word(static_cast<std::uint16_t>(slice.stored - 1))) +
           element(0x28, 0x103, "US", word(1)) + element(0x28, 0x1053, "DS", slice.slope) +
           element(0x7fe0, 0x10, "OW", raw(slice.pixels));
}

}  // namespace edgewise::store::testing
