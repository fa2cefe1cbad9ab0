#include "engine/request/spec.hpp"

#include <fmt/format.h>

namespace edgewise {

const char* name_of(GeometryStep::Kind kind) noexcept {
    constexpr const char* kNames[] = {"rotate", "matrix",    "scale", "translate",
                                      "shear",  "turntable", "path"};
    return kNames[static_cast<int>(kind)];
}

const char* name_of(Planner planner) noexcept {
    constexpr const char* kNames[] = {"estimate", "pilot", "exhaustive"};
    return kNames[static_cast<int>(planner)];
}

std::string OutputSize::text() const {
    return fit ? "fit" : native ? "native" : fmt::format("{}", fmt::join(sides, "x"));
}

std::string ClipSpec::options() const {
    std::vector<const char*> given;
    if (box) given.push_back("--clip");
    if (!planes.empty()) given.push_back("--clip-plane");
    if (!balls.empty()) given.push_back("--clip-ball");
    if (slab) given.push_back("--slab");
    return fmt::format("{}", fmt::join(given, " and "));
}

}  // namespace edgewise
