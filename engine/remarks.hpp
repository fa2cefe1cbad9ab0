#pragma once

#include "engine/opened.hpp"

namespace edgewise {

/// What may be wrong with a request that is opened: what is cut off, squeezed, not seen, missed or
/// reduced, and what is guessed because neither words nor file say it.
void say_what_is_open(const Opened& opened, Listener& messages);

}  // namespace edgewise
