#pragma once

#include <string>
#include <vector>

namespace edgewise {

struct Session;

/// Tells what is wrong with the session's input: what its reader found, not what the request makes
/// of it. Each request finds it again, and `edgewise info` always lists it. So a listener that is
/// told once is told when a file is new or has changed. What was told is kept like facts of the
/// data (engine/known_facts.hpp); of a file that none are kept of, all is told each time.
void tell_of_file(Session& session, const std::vector<std::string>& warnings);

}  // namespace edgewise
