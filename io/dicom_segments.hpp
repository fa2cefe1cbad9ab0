#pragma once

#include <array>
#include <vector>

#include "io/dicom_file.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// Names and colours of a segmentation's segments, in the order of the file. Those without a number
/// are left out, and so are colours of other than three numbers.
std::vector<Segment> dicom_segments(const DicomFile& file);

/// RecommendedDisplayCIELabValue (PS3.3 C.10.7.1.1) as sRGB, 0 to 1: L* from 0 to 100, a* and b*
/// from -128 to 127, each over 16 bits, for the white D50 of the ICC's connection space. What sRGB
/// cannot show is clipped.
std::array<double, 3> srgb_of_dicom_lab(const std::array<double, 3>& stored);

}  // namespace edgewise::store
