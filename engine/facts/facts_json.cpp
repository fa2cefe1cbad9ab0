#include "engine/facts/facts_json.hpp"

#include <array>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace edgewise {
namespace {

using Json = nlohmann::json;

/// JSON has no number that is not finite. Finite ones come back to the last bit.
Json number_json(double value) {
    return std::isfinite(value) ? Json(value) : Json(fmt::format("{}", value));
}

double number_of(const Json& json) {
    if (json.is_number()) return json.get<double>();
    const std::string text = json.get<std::string>();
    if (text == "inf") return HUGE_VAL;
    if (text == "-inf") return -HUGE_VAL;
    if (text == "nan" || text == "-nan") return std::nan("");
    throw std::invalid_argument(text);
}

Json numbers_json(const std::vector<double>& values) {
    Json json = Json::array();
    for (const double value : values) json.push_back(number_json(value));
    return json;
}

std::vector<double> numbers_of(const Json& json) {
    std::vector<double> values;
    for (const Json& each : json) values.push_back(number_of(each));
    return values;
}

Json facts_json(const std::map<std::string, double>& facts) {
    Json json = Json::object();
    for (const auto& [name, value] : facts) json[name] = number_json(value);
    return json;
}

std::map<std::string, double> facts_of(const Json& json) {
    std::map<std::string, double> facts;
    for (const auto& [name, value] : json.items()) facts[name] = number_of(value);
    return facts;
}

}  // namespace

Json json_of(const Statistics& s) {
    return {{"low", number_json(s.low)},   {"high", number_json(s.high)},
            {"mean", number_json(s.mean)}, {"lowest", s.lowest},
            {"highest", s.highest},        {"commonest", number_json(s.commonest)},
            {"non_finite", s.non_finite},  {"begin", s.occupied.begin},
            {"end", s.occupied.end},       {"occupied_fraction", number_json(s.occupied_fraction)}};
}

void read(const Json& json, Statistics& s) {
    s.low = number_of(json.at("low"));
    s.high = number_of(json.at("high"));
    s.mean = number_of(json.at("mean"));
    s.lowest = json.at("lowest").get<std::int64_t>();
    s.highest = json.at("highest").get<std::int64_t>();
    s.commonest = number_of(json.at("commonest"));
    s.non_finite = json.at("non_finite").get<std::int64_t>();
    s.occupied.begin = json.at("begin").get<std::array<std::int64_t, 3>>();
    s.occupied.end = json.at("end").get<std::array<std::int64_t, 3>>();
    s.occupied_fraction = number_of(json.at("occupied_fraction"));
}

Json json_of(const Histogram& h) {
    return {{"low", number_json(h.low)},
            {"high", number_json(h.high)},
            {"counts", h.counts},
            {"looked_at", h.looked_at}};
}

void read(const Json& json, Histogram& h) {
    h.low = number_of(json.at("low"));
    h.high = number_of(json.at("high"));
    h.counts = json.at("counts").get<std::vector<std::int64_t>>();
    h.looked_at = json.at("looked_at").get<std::int64_t>();
}

Json json_of(const RadialPower& p) {
    return {{"frequency", numbers_json(p.frequency)},
            {"power", numbers_json(p.power)},
            {"share", numbers_json(p.share)},
            {"bricks", p.bricks},
            {"empty", p.empty},
            {"samples", p.samples}};
}

void read(const Json& json, RadialPower& p) {
    p.frequency = numbers_of(json.at("frequency"));
    p.power = numbers_of(json.at("power"));
    p.share = numbers_of(json.at("share"));
    if (p.power.size() != p.frequency.size() || p.share.size() != p.frequency.size())
        throw std::invalid_argument("rings");
    p.bricks = json.at("bricks").get<int>();
    p.empty = json.at("empty").get<int>();
    p.samples = json.at("samples").get<std::int64_t>();
}

Json json_of(const Seen& seen) {
    return {{"range", number_json(seen.range)},
            {"facts", facts_json(seen.facts)},
            {"likely", facts_json(seen.likely)},
            {"draws", seen.draws},
            {"exhausted", seen.exhausted}};
}

void read(const Json& json, Seen& seen) {
    seen.range = number_of(json.at("range"));
    seen.facts = facts_of(json.at("facts"));
    seen.likely = facts_of(json.at("likely"));
    seen.draws = json.at("draws").get<std::int64_t>();
    seen.exhausted = json.at("exhausted").get<bool>();
}

Json json_of(const FewDraws& draws) {
    Json without = Json::array();
    for (const auto& facts : draws.without) without.push_back(facts_json(facts));
    return {{"likely", facts_json(draws.likely)}, {"without", std::move(without)}};
}

void read(const Json& json, FewDraws& draws) {
    draws.likely = facts_of(json.at("likely"));
    for (const Json& each : json.at("without")) draws.without.push_back(facts_of(each));
}

Json json_of(const Counts& counts) { return facts_json(counts.facts); }

void read(const Json& json, Counts& counts) { counts.facts = facts_of(json); }

Json json_of(const SeenSlope& slope) { return {{"value", number_json(slope.value)}}; }

void read(const Json& json, SeenSlope& slope) { slope.value = number_of(json.at("value")); }

}  // namespace edgewise
