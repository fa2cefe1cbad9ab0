#include "graph/fingerprint.hpp"

#include <fmt/format.h>

namespace edgewise {

std::string Fingerprint::text() const {
    return fmt::format("{:016x}{:016x}", first_.value(), second_.value());
}

}  // namespace edgewise
