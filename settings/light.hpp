#pragma once

#include <string>

#include "settings/setting.hpp"

namespace edgewise {

/// "0,255", "1%,99.5%", "W400L40", "lung". @throws RequestError
Window window_of(const std::string& text);

/// What several jobs say of labels: `what` they are, and that some may be named.
Message help_of_labels(const char* what);
Message help_of_smooth();

namespace reads {

Reader labels();
Reader window();

}  // namespace reads
}  // namespace edgewise
