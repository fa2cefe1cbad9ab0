#include "engine/request/spec.hpp"

#include <fmt/format.h>

namespace edgewise {

const char* name_of(GeometryStep::Kind kind) noexcept {
    constexpr const char* kNames[] = {"rotate",    "matrix", "scale",
                                      "translate", "shear",  "turntable"};
    return kNames[static_cast<int>(kind)];
}

const char* name_of(Planner planner) noexcept {
    constexpr const char* kNames[] = {"estimate", "pilot", "exhaustive"};
    return kNames[static_cast<int>(planner)];
}

std::string OutputSize::text() const {
    return fit ? "fit" : fmt::format("{}", fmt::join(sides, "x"));
}

}  // namespace edgewise
