#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/channel_colours.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// Whether a path is a folder that says that it is a Zarr array or group, a ZIP file, or leads into
/// one.
bool is_zarr(const std::string& path);
/// The image of such a path at one of its resolutions; fills header.reader.
/// @throws InputError   what it does not say right, and what is not supported, at which field
/// @throws RequestError several images and none selected, a resolution that is not there
Header inspect_zarr(const std::string& path, const Selection&);
/// Colours of an image's channels, by their numbers.
std::vector<std::optional<Colour>> zarr_colours(const std::string& path, const Selection&);
std::vector<std::string> zarr_channel_names(const std::string& path, const Selection&);

}  // namespace edgewise::store
