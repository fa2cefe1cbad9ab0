#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "engine/facts/few_draws.hpp"
#include "scene/histogram.hpp"
#include "scene/statistics.hpp"
#include "transitions/spectrum/radial_power.hpp"

namespace edgewise {

/// What a preview adds to statistics (Scene has both).
struct Seen {
    double range = 1;
    std::map<std::string, double> facts, likely;
    std::int64_t draws = 0;
    bool exhausted = false;
};

/// How steep what a transfer function shows is (scene/ring_free.hpp: seen_slope).
struct SeenSlope {
    double value = 0;
};

// Facts as JSON and back: the same to the last bit, numbers that are not finite too.

nlohmann::json json_of(const Statistics& statistics);
nlohmann::json json_of(const Histogram& histogram);
nlohmann::json json_of(const RadialPower& spectrum);
nlohmann::json json_of(const Seen& seen);
nlohmann::json json_of(const FewDraws& draws);
nlohmann::json json_of(const Counts& counts);
nlohmann::json json_of(const SeenSlope& slope);

/// @throws std::exception  fields that are missing or of another kind
void read(const nlohmann::json& json, Statistics& statistics);
void read(const nlohmann::json& json, Histogram& histogram);
void read(const nlohmann::json& json, RadialPower& spectrum);
void read(const nlohmann::json& json, Seen& seen);
void read(const nlohmann::json& json, FewDraws& draws);
void read(const nlohmann::json& json, Counts& counts);
void read(const nlohmann::json& json, SeenSlope& slope);

}  // namespace edgewise
