#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/spoken.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/session/report.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "graph/mode.hpp"
#include "graph/words.hpp"
#include "io/store.hpp"
#include "measure/machine.hpp"
#include "planner/machines.hpp"
#include "reference/phantoms.hpp"
#include "request/outputs.hpp"
#include "transfer/presets.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Value& value) {
    return std::visit([](const auto& v) { return Json(v); }, value);
}

Json json_of(const Domain& domain) {
    Json json = Json::object();
    if (domain.words.empty())
        json = {{"low", domain.low}, {"high", domain.high}};
    else
        json = {{"words", domain.words}};
    json["tried"] = Json::array();
    for (const Value& value : domain.tried) json["tried"].push_back(json_of(value));
    json["meaning"] = domain.meaning;
    return json;
}

Json edges() {
    Json list = Json::array();
    for (const Transition& edge : catalogue()) {
        Json joins = Json::array(), parameters = Json::object();
        for (const auto& [from, to] : edge.joins) joins.push_back({{"from", from}, {"to", to}});
        for (const auto& [key, domain] : edge.parameters) parameters[key] = json_of(domain);
        list.push_back({{"name", edge.name},
                        {"source", edge.source},
                        {"joins", joins},
                        {"parameters", parameters},
                        {"on_demand", edge.on_demand}});
    }
    return list;
}

Json filter_list() {
    Json list = Json::array();
    for (const Filter& filter : filters())
        list.push_back({{"name", filter.name}, {"meaning", filter.help}});
    return list;
}

Json mode_list() {
    Json list = Json::array();
    for (const Mode mode : modes()) {
        Json shades = Json::array();
        for (const Shade by : mode->shades) shades.push_back(name_of(by));
        list.push_back({{"name", mode->name},
                        {"meaning", spoken(message_of(mode->help))},
                        {"shades", shades}});
    }
    return list;
}

Json formats() {
    Json list = Json::array();
    for (const store::Format& format : store::formats()) {
        Json types = Json::array();
        for (const Type type : format.types) types.push_back(name_of(type));
        list.push_back({{"name", format.name},
                        {"endings", format.endings},
                        {"reads", format.reads},
                        {"writes", format.writes},
                        {"types", types},
                        {"images", format.images},
                        {"volumes", format.volumes},
                        {"channels", format.channels},
                        {"library", store::library_of(format)},
                        {"meaning", spoken(format.note)}});
    }
    return list;
}

Json phantoms() {
    Json list = Json::array();
    for (const std::string& name : phantom_names())
        list.push_back({{"name", name}, {"axes", phantom_named(name, 8).axes}});
    return list;
}

Json presets() {
    Json list = Json::array();
    for (const std::string& name : preset_names()) {
        const TransferSpec spec = preset_named(name);
        Json points = Json::array();
        for (const Transfer::Point& point : spec.transfer.points)
            points.push_back(
                {{"value", point.value}, {"opacity", point.opacity}, {"color", point.color}});
        list.push_back({{"name", name},
                        {"meaning", preset_help(name)},
                        {"values", name_of(spec.values)},
                        {"unit", spec.unit_given ? Json(spec.transfer.unit) : Json()},
                        {"points", points}});
    }
    return list;
}

Json machines() {
    namespace fs = std::filesystem;
    Json list = Json::array();
    const auto add = [&](const Profile& profile, const std::string& file) {
        list.push_back({{"name", profile.name},
                        {"cpu", profile.cpu},
                        {"processors", profile.processors},
                        {"ranks", profile.ranks},
                        {"file", file.empty() ? Json() : Json(file)},
                        {"operation", profile.operation},
                        {"streamed", profile.streamed},
                        {"gather", profile.gather},
                        {"levels", to_json(profile.levels)},
                        {"latency", profile.latency},
                        {"byte", profile.byte},
                        {"messages", to_json(profile.messages)},
                        {"provenance", profile.provenance},
                        {"spreads", profile.spreads}});
    };
    add(default_profile({}), "");
    for (const std::string& name : bundled_machines()) add(*bundled_profile(name), "");
    std::vector<std::string> files;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(config_folder(), none))
        if (entry.path().extension() == ".json") files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    for (const std::string& file : files) try {
            add(load_profile(file), file);
        } catch (const InputError& error) {
            fmt::print(stderr, "edgewise: warning: {}\n", spoken(error.message()));
        }
    return list;
}

struct Kind {
    const char* name;
    Json (*entries)();
};
constexpr Kind kKinds[] = {{"edges", edges},     {"filters", filter_list}, {"modes", mode_list},
                           {"formats", formats}, {"phantoms", phantoms},   {"machines", machines},
                           {"presets", presets}};

std::string domain_text(const Json& domain) {
    const std::string values =
        domain.contains("words")
            ? domain["words"].dump()
            : fmt::format("{} to {}", domain["low"].dump(), domain["high"].dump());
    const std::string meaning = domain["meaning"];
    return fmt::format("{}, tried {}{}", values, domain["tried"].dump(),
                       meaning.empty() ? "" : " (" + meaning + ")");
}

/// What an operation and accesses cost, by level of memory.
std::string numbers_text(const Json& machine) {
    const auto ns = [](const Json& numbers, const char* name) {
        return fmt::format("{:.3g} ns", 1e9 * numbers[name].get<double>());
    };
    // The first word of where a number comes from.
    const auto origin = [&](const char* name) {
        const std::string all = machine["provenance"].value(name, "guessed");
        return all.substr(0, all.find_first_of(" :,;"));
    };
    std::string text =
        fmt::format("    {} an operation ({})\n", ns(machine, "operation"), origin("operation"));
    const auto line = [&](const Json& level, const std::string& size, const char* name) {
        text += fmt::format("    {}: {} a byte in order, {} a computed address ({})\n", size,
                            ns(level, "streamed"), ns(level, "gather"), origin(name));
    };
    const Json& levels = machine["levels"];
    if (levels.empty()) line(machine, "data of any size", "streamed");
    for (const Json& level : levels) {
        const double kilobytes = level.value("bytes", 0.0) / 1024;
        line(level, kilobytes > 0 ? fmt::format("data up to {:.0f} KiB", kilobytes) : "larger data",
             "levels");
    }
    return text;
}

std::string line_of(const Json& entry) {
    std::string text = entry["name"].get<std::string>();
    if (entry.contains("endings")) {
        std::string can = entry["reads"].get<bool>() ? "reads" : "";
        if (entry["writes"].get<bool>()) can += can.empty() ? "writes" : ", writes";
        text = fmt::format("{:<16} {:<14}", text, can);
        for (const Json& ending : entry["endings"]) text += " " + ending.get<std::string>();
        text += " [" + entry["library"].get<std::string>() + "]";
    }
    if (entry.contains("axes")) text += fmt::format(" ({}D)", entry["axes"].get<int>());
    if (entry.contains("processors"))
        text += fmt::format(
            ": {}{} processors, {}",
            entry["ranks"].get<int>() > 1 ? fmt::format("{} x ", entry["ranks"].get<int>()) : "",
            entry["processors"].get<int>(),
            entry["cpu"].get<std::string>().empty() ? "built in" : entry["cpu"].get<std::string>());
    if (entry.contains("meaning") && !entry["meaning"].get<std::string>().empty())
        text += ": " + entry["meaning"].get<std::string>();
    if (entry.contains("source")) text += ": " + entry["source"].get<std::string>();
    if (entry.value("on_demand", false)) text += " (only by --via)";
    text += "\n";
    if (entry.contains("levels")) text += numbers_text(entry);
    if (entry.contains("joins"))
        for (const Json& join : entry["joins"])
            text += fmt::format("    {} -> {}\n", join["from"].get<std::string>(),
                                join["to"].get<std::string>());
    if (entry.contains("parameters"))
        for (const auto& [key, domain] : entry["parameters"].items())
            text += fmt::format("    /{}: {}\n", key, domain_text(domain));
    return text;
}

int do_list(const std::string& what, const std::optional<std::string>& json) {
    return guarded_with_json(json, [&] {
        if (json && *json != "-") expect_writable("--json", *json);
        const auto kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                       [&](const Kind& k) { return same_word(what, k.name); });
        if (kind == std::end(kKinds)) {
            std::vector<std::string> names;
            for (const Kind& each : kKinds) names.emplace_back(each.name);
            throw RequestError(
                fmt::format("list: there are no '{}'; {}", what, instead_of(what, names)));
        }
        const Json entries = kind->entries();
        if (json) write_text(*json, text_of(Json{{"schema", 1}, {kind->name, entries}}));
        if (json == "-") return static_cast<int>(kDone);
        std::string text;
        for (const Json& entry : entries) text += line_of(entry);
        write_text("-", text);
        return static_cast<int>(kDone);
    });
}

}  // namespace

Verb add_list(CLI::App& main) {
    CLI::App* app = main.add_subcommand("list", "what this build knows");
    auto what = std::make_shared<std::string>();
    auto json = std::make_shared<std::optional<std::string>>();
    app->add_option("WHAT", *what, "edges, filters, modes, formats, phantoms, machines or presets")
        ->required();
    add_text(*app, "--json", *json, "report, to FILE or - for standard output");
    return {app, [what, json] { return do_list(*what, *json); }};
}

}  // namespace edgewise::cli
