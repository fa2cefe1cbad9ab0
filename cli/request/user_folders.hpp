#pragma once

#include <optional>
#include <string>

#include "engine/engine.hpp"

namespace edgewise::cli {

/// $XDG_CONFIG_HOME/edgewise, ~/.config/edgewise, or "" where there is no home.
std::string config_folder();
/// Where what was learned is kept from run to run: $XDG_CACHE_HOME/edgewise, ~/.cache/edgewise, or
/// "" where there is no home.
std::string cache_folder();

/// --machine FILE|NAME, else EDGEWISE_MACHINE, else the profile that `calibrate` left for this
/// processor, else the built-in one with what these edges say of it.
/// @throws InputError for a file, RequestError for a name that is not there
Profile chosen_profile(const std::optional<std::string>& machine, const Catalogue& edges);

/// Where facts of data are kept.
std::shared_ptr<FactStore> user_facts();
/// With the machine, and with what is kept in the user's folders.
Engine user_engine(Catalogue edges, Profile machine);

}  // namespace edgewise::cli
