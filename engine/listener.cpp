#include "engine/listener.hpp"

#include <algorithm>

namespace edgewise {

bool Listener::counts(const Message& text) {
    // The same thing found in every frame is worth saying once.
    if (std::find(warnings_.begin(), warnings_.end(), text) != warnings_.end()) return false;
    warnings_.push_back(text);
    return true;
}

void Listener::warning(const Message& text) {
    if (counts(text)) on_warning(text);
}

void Listener::file_warnings(const Input&, const std::vector<Message>& found) {
    for (const Message& text : found) warning(text);
}

}  // namespace edgewise
