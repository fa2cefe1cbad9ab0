#include "graph/version.hpp"

namespace edgewise {

const std::string& version() {
    static const std::string text = EDGEWISE_VERSION;
    return text;
}

}  // namespace edgewise
