#pragma once

#include "graph/fingerprint.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Adds what the numbers of a catalogue's edges come from: what each edge declares, and the code
/// that answers about it, as the build id of its program or library and the place in there. Of code
/// without a build id it is the file's size and times. A function object's own values cannot be
/// seen: an edge whose numbers depend on them says so in Transition::version.
void add_code(Fingerprint& to, const Catalogue& edges);

/// Adds the build of this library, and the processor, which may round otherwise than another.
void add_build(Fingerprint& to);

}  // namespace edgewise
