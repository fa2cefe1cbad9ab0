#include "planner/profile.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>

#include "graph/errors.hpp"
#include "graph/transition.hpp"
#include "planner/json_fields.hpp"

namespace edgewise {
namespace {

struct NumberField {
    const char* name;
    double Profile::*member;
    double low, high;
};

constexpr NumberField kFields[] = {
    {"operation", &Profile::operation, 0, 1}, {"streamed", &Profile::streamed, 0, 1},
    {"gather", &Profile::gather, 0, 1},       {"local", &Profile::local, 0, 1},
    {"global", &Profile::global, 0, 1},       {"start", &Profile::start, 0, 1},
    {"serial", &Profile::serial, 0, 1},       {"congestion", &Profile::congestion, 0, 1e6},
    {"latency", &Profile::latency, 0, 1},     {"byte", &Profile::byte, 0, 1},
    {"memory", &Profile::memory, 0, 1e18},    {"spread", &Profile::spread, 0, 10},
};

/// Spread where an edge was not timed on this machine: over the requests of
/// benchmarks/predictions.py predictions of the built-in profile were off by 21 % in the median,
/// with factors before those that edges have now.
constexpr double kUncalibrated = 0.35;

/// A mistyped field would leave the built-in number in its place without a word.
void expect_known(const nlohmann::json& json, const JsonFields& fields) {
    const nlohmann::json known = to_json(Profile{});
    std::string names;
    for (const auto& item : known.items()) names += (names.empty() ? "" : ", ") + item.key();
    for (const auto& item : json.items())
        if (!known.contains(item.key()) && item.key() != "comment" &&
            item.key() != "calm")  // of profiles before 0.20
            fields.reject(item.key(), "no such field; there are comment, " + names);
}

}  // namespace

Counted Profile::counted(const Work& work) const noexcept {
    const double byte_read =
        levels.empty() ? streamed : cost_in(levels, &Level::streamed, work.swept);
    const double near = levels.empty() ? gather : levels.front().gather;
    const auto line = [&](double set) { return levels.empty() ? 0 : line_again(levels, set); };
    // A machine without levels was not measured with this program's vectors.
    const Traffic& traffic = work.traffic;
    const double operations = work.operations + (levels.empty() ? 0 : work.masked);
    const double loops = operations * operation + work.streamed * byte_read + work.gathers * near +
                         traffic.local * local +
                         (traffic.global + traffic.congested * congestion) * global;
    const auto fetched = [&](const Lines& lines) { return lines.count * line(lines.span); };
    const double apart = fetched(work.lines) + fetched(work.other_lines);
    return {loops + apart, apart};
}

double Profile::factor(const std::string& edge) const {
    for (std::string known = edge.substr(0, edge.find(' '));; known.resize(known.rfind('/'))) {
        const auto found = factors.find(known);
        if (found != factors.end()) return found->second;
        if (known.find('/') == std::string::npos) break;
    }
    const auto others = factors.find("*");
    return others == factors.end() ? 1 : others->second;
}

Seconds Profile::seconds(const std::string& edge, const Work& work, int threads, int among,
                         int runs) const {
    const double sharing = std::max(1, threads);
    const Counted part = counted(work) / std::max(1, among);
    const double each = part.seconds;
    const double sending = message_seconds(messages, {.latency = latency, .byte = byte},
                                           work.traffic.messages, work.traffic.sent);
    const Rate rate = rates.at(edge, part, runs);
    if (rate.ratio > 0) {
        // The gain from all processors gives the share of a run that threads do not speed up.
        const double alone = 1.0 / processors;
        const double fixed =
            processors > 1 ? std::max(0.0, (rate.shared - alone) / (1 - alone)) : serial;
        return {std::max(start, each * rate.ratio * (fixed + (1 - fixed) / sharing)) + sending,
                std::max(spread, rate.spread)};
    }
    const double alone = (each - part.apart) * factor(edge) + part.apart;
    return {start + alone * (serial + (1 - serial) / sharing) + sending,
            std::max(spread, kUncalibrated)};
}

Profile default_profile(const Catalogue& edges) {
    Profile profile;
    for (const Transition& edge : edges)
        for (const auto& [with, factor] : edge.factors) profile.factors[edge.name + with] = factor;
    profile.processors = std::max(1u, std::thread::hardware_concurrency());
    return profile;
}

Profile load_profile(const std::string& file) {
    std::ifstream stream(file);
    if (!stream) throw InputError("machine profile " + file + ": cannot be opened");
    return parse_profile(std::string(std::istreambuf_iterator<char>(stream), {}), file);
}

Profile parse_profile(const std::string& text, const std::string& file) {
    const JsonFields fields(file);
    const nlohmann::json json = fields.parsed(text);
    if (json.value("schema", nlohmann::json()) != 1)
        fields.reject(
            "schema",
            message("expected \"schema\": 1, as `@command(calibrate) @out FILE` writes it")
                .marked());
    expect_known(json, fields);
    Profile profile;
    const auto word = [&](const char* field) {
        return fields.text(json.value(field, nlohmann::json("")), field);
    };
    const auto count = [&](const char* field, double most, int& number) {
        if (json.contains(field))
            number = static_cast<int>(fields.number(json[field], field, 1, most));
    };
    profile.name = word("name");
    profile.cpu = word("cpu");
    profile.build = word("build");
    profile.when = word("when");
    for (const NumberField& field : kFields)
        if (json.contains(field.name))
            profile.*field.member =
                fields.number(json[field.name], field.name, field.low, field.high);
    count("processors", 1 << 20, profile.processors);
    count("ranks", 1 << 30, profile.ranks);
    const auto object = [&](const char* field) {
        const nlohmann::json part = json.value(field, nlohmann::json::object());
        if (!part.is_object()) fields.reject(field, "expected an object");
        return part;
    };
    const nlohmann::json factors = object("factors"), provenance = object("provenance"),
                         spreads = object("spreads");
    for (const auto& [edge, value] : factors.items())
        profile.factors[edge] = fields.number(value, "factors." + edge, 1e-6, 1e6);
    for (const auto& [number, origin] : provenance.items())
        profile.provenance[number] = fields.text(origin, "provenance." + number);
    for (const auto& [number, value] : spreads.items())
        profile.spreads[number] = fields.number(value, "spreads." + number, 0, 10);
    profile.levels = levels_of(json.value("levels", nlohmann::json::array()), file);
    profile.messages = message_costs_of(json.value("messages", nlohmann::json::array()), file);
    profile.rates = rates_of(object("rates"), file);
    return profile;
}

nlohmann::json to_json(const Profile& profile) {
    nlohmann::json json = {{"schema", 1},
                           {"name", profile.name},
                           {"cpu", profile.cpu},
                           {"build", profile.build},
                           {"when", profile.when},
                           {"processors", profile.processors},
                           {"ranks", profile.ranks},
                           {"levels", to_json(profile.levels)},
                           {"messages", to_json(profile.messages)},
                           {"factors", profile.factors},
                           {"rates", to_json(profile.rates)},
                           {"provenance", profile.provenance},
                           {"spreads", profile.spreads}};
    for (const NumberField& field : kFields) json[field.name] = profile.*field.member;
    return json;
}

}  // namespace edgewise
