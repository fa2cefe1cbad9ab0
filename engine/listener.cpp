#include "engine/listener.hpp"

#include <algorithm>

namespace edgewise {

void Listener::warning(const std::string& text) {
    // The same thing found in every frame is worth saying once.
    if (std::find(warnings_.begin(), warnings_.end(), text) != warnings_.end()) return;
    warnings_.push_back(text);
    on_warning(text);
}

}  // namespace edgewise
