#include "settings/told.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "graph/words.hpp"

namespace edgewise {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char *kJob = "job", *kInput = "input", *kSteps = "steps";

struct AsJson {
    Json operator()(std::monostate) const { return {}; }
    template <typename T>
    Json operator()(const T& one) const {
        return one;
    }
    Json operator()(const SettingValue::List& list) const {
        Json all = Json::array();
        for (const SettingValue& one : list) all.push_back(one.visit(*this));
        return all;
    }
};

/// @throws SettingError
SettingValue value_of(const Json& json, std::string_view name) {
    switch (json.type()) {
        case Json::value_t::null:
            return {};
        case Json::value_t::boolean:
            return json.get<bool>();
        case Json::value_t::number_integer:
        case Json::value_t::number_unsigned:
            return json.get<std::int64_t>();
        case Json::value_t::number_float:
            return json.get<double>();
        case Json::value_t::string:
            return json.get<std::string>();
        case Json::value_t::array: {
            SettingValue::List list;
            for (const Json& one : json) list.push_back(value_of(one, name));
            return list;
        }
        default:
            throw SettingError(fmt::format(
                "{}: expected a text, a number, true, false, or a list of these", name));
    }
}

Job job_named(const Json& json) {
    const auto found = json.is_object() ? json.find(kJob) : json.end();
    if (!json.is_object() || found == json.end() || !found->is_string())
        throw SettingError("job: which one? Expected an object with \"job\": \"render\"");
    const auto name = found->get<std::string>();
    std::vector<std::string> names;
    for (const Job job : jobs()) {
        if (name == name_of(job)) return job;
        names.emplace_back(name_of(job));
    }
    throw SettingError(fmt::format("job: '{}' is not known; {}", name, instead_of(name, names)));
}

void add_steps(std::vector<Given>& given, const Json& steps) {
    if (!steps.is_array()) throw SettingError("steps: expected a list");
    for (const Json& step : steps) {
        if (!step.is_object() || step.size() != 1)
            throw SettingError(
                "steps: expected objects of one setting, as {\"rotate\": [20, 0, 0]}");
        for (const auto& [name, value] : step.items())
            given.push_back({name, value_of(value, name)});
    }
}

bool is_transfer(const Given& one) { return one.name == "transfer" || one.name == "preset"; }

}  // namespace

std::vector<Given> told(const Query& query) {
    Query nothing;
    nothing.job = query.job;
    std::vector<Given> all;
    for (const QuerySetting* row : settings_of(query.job)) {
        const SettingValue value = row->reads.tell(query);
        if (!value.none() && value != row->reads.tell(nothing))
            all.push_back({std::string(row->name.name), value});
    }
    for (const GeometryStep& step : query.geometry.steps)
        all.push_back({name_of(step.kind), SettingValue::of(step.numbers)});
    if (query.transfer && std::ranges::none_of(all, is_transfer))
        throw RequestError(message("@transfer: a program made it, and it has no name"));
    return all;
}

Json json_of(const Query& query) {
    Json json{{kJob, name_of(query.job)}};
    if (!query.input.empty()) json[kInput] = query.input;
    for (const Given& one : told(query)) {
        const Json value = one.value.visit(AsJson());
        const QuerySetting* row = setting_named(one.name, query.job);
        if (row->kind() == Reader::Kind::step)
            json[kSteps].push_back(Json{{one.name, value}});
        else
            json[one.name] = value;
    }
    return json;
}

Query query_of(const Json& json, const Catalogue& edges) {
    const Job job = job_named(json);
    std::vector<Given> given;
    std::string input;
    for (const auto& [name, value] : json.items()) {
        if (name == kJob) continue;
        if (name == kInput)
            input = value_of(value, name).text();
        else if (name == kSteps)
            add_steps(given, value);
        else if (!value.is_null())
            given.push_back({name, value_of(value, name)});
    }
    Query query = query_of(job, given, edges);
    query.input = input;
    return query;
}

}  // namespace edgewise
