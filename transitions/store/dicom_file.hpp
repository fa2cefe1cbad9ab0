#pragma once

#include <map>
#include <string>
#include <vector>

#include "transitions/store/file.hpp"

namespace edgewise::store {

/// The elements of one DICOM file that describe its pixels (PS3.3 C.7.6, PS3.5). Checked: every
/// length lies inside the file, sequences are nested at most 32 deep, sizes are at least 1.
struct DicomFile {
    std::string path;
    std::string syntax;  // UID of the transfer syntax
    bool big_endian = false, compressed = false;
    std::string series, text, modality;
    std::string sop_class;
    std::int64_t rows = 0, columns = 0, frames = 1;
    int samples = 1, planar = 0, allocated = 0, stored = 0, high = 0;
    bool is_signed = false;
    std::string photometric;
    double slope = 1, intercept = 0;
    int instance = 0;
    bool has_position = false, has_orientation = false, has_spacing = false;
    std::array<double, 3> position{0, 0, 0};
    std::array<double, 6> orientation{1, 0, 0, 0, 1, 0};
    std::array<double, 2> spacing{1, 1};        // between rows, between columns [mm]
    double thickness = 0;                       // or distance between slices [mm], 0: not said
    std::uint64_t pixels = 0, pixel_bytes = 0;  // where they are; not of compressed ones

    /// @throws InputError
    explicit DicomFile(const std::string& file);
};

}  // namespace edgewise::store
