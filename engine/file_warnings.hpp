#pragma once

#include <string>
#include <vector>

#include "graph/message.hpp"

namespace edgewise {

struct Input;
struct Opened;
class Listener;

/// Tells the listener what is wrong with a file: what its reader found, not what the request makes
/// of it. Each request finds it again, and `edgewise info` always lists it. So a listener that
/// wants it once hears of it when a file is new or has changed. What was told is kept like facts of
/// the data (engine/known_facts.hpp). Where none are kept, all is told each time.
/// @param warnings  in the order in which they are told
void tell_of_file(const Opened& opened, const Input& input, const std::vector<Message>& warnings,
                  Listener& messages);

}  // namespace edgewise
