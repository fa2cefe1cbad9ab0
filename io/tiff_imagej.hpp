#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/tiff_layout.hpp"

namespace edgewise::store {

/// Whether this is the description that ImageJ writes: lines of "key=value", the first its version.
bool is_imagej(const std::string& description) noexcept;

/// What ImageJ says of its pages: channels, slices and frames; sets the header's spacing, unit,
/// origin and values too, and warns.
TiffLayout imagej_layout(Header&, const std::vector<TiffPage>&, const std::string& description);

/// The colours of channels: the brightest of their lookup tables. Black ones, of tables that run
/// the other way, are none.
std::vector<std::optional<Colour>> imagej_colours(const File&, const TiffPage&);

/// The values that each channel is shown from and to, as the file means values.
/// @param description  of the page, its first
std::vector<std::optional<std::array<double, 2>>> imagej_ranges(const File&, const TiffPage&,
                                                                const std::string& description);

}  // namespace edgewise::store
