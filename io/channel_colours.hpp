#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/store.hpp"

namespace edgewise::store {

/// Red, green and blue, 0 to 1.
using Colour = std::array<double, 3>;

/// The colours that a source says its channels are shown in, by the channel's number: those of OME,
/// and the brightest of ImageJ's lookup tables. Absent, or beyond the end: it says none. White
/// throughout tells no channel from another and counts as none.
/// @throws InputError, RequestError as inspect
std::vector<std::optional<Colour>> channel_colours(const std::string& source,
                                                   const Selection& pick = {});

/// The values that a source says its channels are shown from and to: ImageJ's display ranges.
/// Absent, or beyond the end: it says none. @throws InputError as inspect
std::vector<std::optional<std::array<double, 2>>> channel_ranges(const std::string& source);

/// The names that a source gives its channels, by their numbers: those of OME. Absent, or beyond
/// the end: "". @throws InputError, RequestError as inspect
std::vector<std::string> channel_names(const std::string& source, const Selection& pick = {});

/// The channel of a name, in any case.
/// @throws RequestError none of that name, with those that there are; several
int channel_named(const std::string& name, const std::string& source, const Selection& pick = {});

/// The colour of a channel that has none of its own, as ImageJ shows it: red, green, blue, white,
/// cyan, magenta, yellow, and from the start.
Colour colour_by_number(int channel) noexcept;

/// "red", "#00ff80", "00ff80"; nothing where it is no colour.
std::optional<Colour> colour_of(const std::string& text);
/// "#00ff80"
std::string text_of(const Colour& colour);

}  // namespace edgewise::store
