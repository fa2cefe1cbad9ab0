#pragma once

#include <string>

namespace edgewise {

/// Of the setting level: the resolution that suits the result.
inline constexpr const char* kLevelByResult = "auto";
/// Of the settings time and channel: all of them.
inline constexpr const char* kAll = "all";

/// Whether the setting channel names several channels, one with a colour, or all.
bool names_several_channels(const std::string& channel);
/// Whether it is no number: what the file may call one.
bool is_channel_name(const std::string& channel);

}  // namespace edgewise
