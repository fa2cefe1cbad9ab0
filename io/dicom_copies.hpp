#pragma once

#include <vector>

#include "io/dicom_file.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// Leaves out of a series the files that hold an image once more: equal decoded samples, at one
/// place, of one number and time, whatever the names of the files and their UIDs. A warning says
/// how many. Images that only look alike (other times, echoes, numbers) stay.
void leave_out_copies(std::vector<DicomFile>& files, Header& header);

}  // namespace edgewise::store
