#pragma once

#include <optional>
#include <string>

#include "io/store.hpp"

namespace edgewise::cli {

/// Of --level: the resolution that suits the result.
inline constexpr const char* kLevelByResult = "auto";

/// What of a file is meant, and what it fails to say, as it was typed.
struct SelectionWords {
    std::optional<std::string> series, time, channel, level, orient, spacing, unit;
};

/// Whether --time asks for all time points: a film of a render.
bool names_all_times(const SelectionWords& words);

/// Which of several things in a file are meant, and what is said in its place. @throws RequestError
/// also where several channels are named
store::Selection selection_of(const SelectionWords& words);

}  // namespace edgewise::cli
