#pragma once

#include <optional>
#include <string>

namespace edgewise::cli {

/// What of a file is meant, and what it fails to say, as it was typed.
struct SelectionWords {
    std::optional<std::string> series, time, channel, orient, spacing, unit;
};

}  // namespace edgewise::cli
