#include "request/query.hpp"

#include <fmt/format.h>

namespace edgewise {

const char* name_of(GeometryStep::Kind kind) noexcept {
    constexpr const char* kNames[] = {"rotate", "matrix",    "scale", "translate",
                                      "shear",  "turntable", "path"};
    return kNames[static_cast<int>(kind)];
}

Message setting_of(GeometryStep::Kind kind) {
    using Kind = GeometryStep::Kind;
    switch (kind) {
        case Kind::rotate:
            return setting("rotate");
        case Kind::matrix:
            return setting("matrix");
        case Kind::scale:
            return setting("scale");
        case Kind::translate:
            return setting("translate");
        case Kind::shear:
            return setting("shear");
        case Kind::turntable:
            return setting("turntable");
        case Kind::path:
            break;
    }
    return setting("path");
}

const char* name_of(Planner planner) noexcept {
    constexpr const char* kNames[] = {"estimate", "pilot", "exhaustive"};
    return kNames[static_cast<int>(planner)];
}

std::string OutputSize::text() const {
    return fit ? "fit" : native ? "native" : fmt::format("{}", fmt::join(sides, "x"));
}

Message ClipSpec::settings() const {
    std::vector<std::string> given;
    if (box) given.push_back(setting("box").marked());
    if (!planes.empty()) given.push_back(setting("planes").marked());
    if (!balls.empty()) given.push_back(setting("balls").marked());
    if (slab) given.push_back(setting("slab").marked());
    return fmt::format("{}", fmt::join(given, " and "));
}

}  // namespace edgewise
