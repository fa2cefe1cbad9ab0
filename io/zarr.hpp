#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/channel_colours.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// Whether a folder says that it is a Zarr array or group.
bool is_zarr(const std::string& folder);
/// The image of a folder at one of its resolutions; fills header.reader.
/// @throws InputError   what it does not say right, and what is not supported, at which field
/// @throws RequestError several images and none selected, a resolution that is not there
Header inspect_zarr(const std::string& folder, const Selection&);
/// Colours of an image's channels, by their numbers.
std::vector<std::optional<Colour>> zarr_colours(const std::string& folder, const Selection&);

}  // namespace edgewise::store
