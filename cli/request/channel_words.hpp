#pragma once

#include <string>
#include <vector>

#include "cli/request/selection_words.hpp"
#include "engine/merge.hpp"

namespace edgewise::cli {

/// Whether --channel asks for a picture in colours: several channels, one with a colour, or all.
bool names_colours(const SelectionWords& words);

/// Whether it is no number: what the file may call one.
bool is_channel_name(const std::string& text);

/// --channel 0,1 or 0=red,2=#00ff80; none of "all". @throws RequestError
std::vector<ChannelSpec> channels_of(const std::string& text);

}  // namespace edgewise::cli
