#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/dicom_file.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// A rectangle of one frame and where it goes in its plane.
struct DicomPiece {
    std::size_t file = 0;
    std::int64_t frame = 0;
    std::int64_t from_x = 0, from_y = 0, to_x = 0, to_y = 0, columns = 0, rows = 0;
    std::int64_t segment = 0;  // the label that its ones stand for; 0: samples as they are
};

/// The frames of a series as planes: sorted by place along the normal, each place with its times.
struct DicomStack {
    std::int64_t columns = 0, rows = 0, slices = 1, times = 1;
    /// All times of the first slice, then of the next. Without pieces: the slice is missing, or
    /// holds no segment.
    std::vector<std::vector<DicomPiece>> planes;
    bool labels = false;  // planes hold the numbers of segments
    std::int64_t most_label = 0;

    const std::vector<DicomPiece>& plane(std::int64_t slice, std::int64_t time) const {
        return planes[static_cast<std::size_t>(slice * times + time)];
    }
};

/// Also fills what the header says of places, and its warnings.
/// @throws InputError frames that do not make one array, naming the files
DicomStack stack_of(const std::vector<DicomFile>& files, bool folder, Header& header);

}  // namespace edgewise::store
