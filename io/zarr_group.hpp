#pragma once

#include <string>

#include "io/store.hpp"
#include "io/zarr_array.hpp"

namespace edgewise::store {

/// An image or array in a hierarchy.
struct ZarrPlace {
    ZarrNode node;
    std::string key;
};

/// The image or array that is meant by a path: itself, or the one that a group holds. Of several
/// `pick.series` chooses: by its name, its path in the group, or its number from 0.
/// @param path  for messages
/// @throws RequestError several, with what the group holds
/// @throws InputError   none
ZarrPlace zarr_place_of(const ZarrStore&, const std::string& key, const std::string& path,
                        const Selection& pick);

}  // namespace edgewise::store
