#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/channel_colours.hpp"
#include "io/store.hpp"
#include "io/tiff_directory.hpp"

namespace edgewise::store {

/// Which page of a TIFF holds what.
struct TiffLayout {
    std::int64_t channels = 1, slices = 1, times = 1;  // that pages stand for
    /// Page of channel c, slice z, time t at c + channels * (z + slices * t).
    std::vector<std::size_t> pages;
    bool volume = false;
    bool one_directory = false;  // the samples of all pages follow those of the only one
    bool indices = false;  // colour tables are a way to show the values, which are the indices

    std::size_t page(std::int64_t c, std::int64_t z, std::int64_t t) const {
        return pages[static_cast<std::size_t>(c + channels * (z + slices * t))];
    }
};

/// All pages but thumbnails, as slices.
TiffLayout stack_of(const std::vector<TiffPage>&);

/// Whether it says pixels a unit along x and y that can be meant.
bool has_resolution(const TiffPage&);

/// What the file says of its pages: ImageJ's or OME's description, else a stack in their order.
/// Sets the header's spacing, unit, origin and values too, and warns.
/// @throws InputError   an OME description that contradicts the pages, or of several files
/// @throws RequestError several images, and none of them selected as a series
TiffLayout tiff_layout(Header&, FilePointer, const std::vector<TiffPage>&, const Selection&);

/// The images of an OME-TIFF; empty for all other files.
std::vector<Series> tiff_series(const std::string& path);

/// The colours of channels as an OME-TIFF or a hyperstack of ImageJ says them; empty for all other
/// files. @throws InputError, RequestError as tiff_layout
std::vector<std::optional<Colour>> tiff_colours(const std::string& path, const Selection&);

/// The names of channels as an OME-TIFF says them; empty for all other files.
/// @throws InputError, RequestError as tiff_layout
std::vector<std::string> tiff_channel_names(const std::string& path, const Selection&);

/// The values that a hyperstack of ImageJ shows its channels from and to; empty for all other
/// files.
/// @throws InputError as tiff_layout
std::vector<std::optional<std::array<double, 2>>> tiff_ranges(const std::string& path);

}  // namespace edgewise::store
