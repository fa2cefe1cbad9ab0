#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace edgewise {

/// Every name that a message may give to what can be set: the fields of a query, and of its parts.
/// `machine` is the profile that plans are made for.
inline constexpr auto kSettings = std::to_array<std::string_view>({
    "about",         "angles",      "background",   "balls",         "bits",
    "border",        "box",         "channel",      "colormap",      "crop",
    "cue",           "decimate",    "depth_colour", "exposure",      "eye",
    "fps",           "gradient",    "grid_moves",   "input_spacing", "input_unit",
    "inverse",       "isovalue",    "kernel",       "labels",        "largest",
    "legend",        "level",       "lids",         "lights",        "look_at",
    "machine",       "material",    "matrix",       "max_error",     "max_memory",
    "max_time",      "minimize",    "mode",         "montage",       "mpr",
    "occlusion",     "op",          "orient",       "out",           "outside",
    "path",          "perspective", "phase",        "planes",        "planner",
    "planning_time", "preset",      "quality",      "range",         "ranks",
    "reference",     "repeat",      "rotate",       "scale",         "scale_bar",
    "seed",          "series",      "shade",        "shadows",       "shear",
    "size",          "slab",        "slices",       "smooth",        "spacing",
    "strict",        "threads",     "threshold",    "time",          "to",
    "transfer",      "translate",   "turntable",    "verify",        "via",
    "view",          "window",      "without",      "zero",          "zoom",
});

constexpr bool is_setting(std::string_view name) noexcept {
    return std::find(kSettings.begin(), kSettings.end(), name) != kSettings.end();
}

}  // namespace edgewise
