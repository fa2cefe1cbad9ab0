#include "engine/wisdom.hpp"

#include <ctime>
#include <filesystem>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/facts/code_version.hpp"
#include "engine/looked.hpp"
#include "graph/errors.hpp"
#include "graph/request_fields.hpp"
#include "measure/machine.hpp"
#include "request/outputs.hpp"

namespace edgewise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMostRequests = 500;  // the oldest are forgotten

/// The file's content, or an empty one. @throws InputError where it is broken
Json read_file(const std::string& file) {
    const Json none = {{"schema", 1}, {"requests", Json::object()}};
    std::error_code absent;
    if (file.empty() || !fs::exists(file, absent)) return none;
    std::ifstream stream(file);
    const Json json = Json::parse(stream, nullptr, false);
    const auto broken = [&](const std::string& why) {
        return InputError("wisdom " + file + ": " + why);
    };
    if (!json.is_object()) throw broken("not a JSON object");
    if (json.value("schema", Json()) != 1) throw broken("schema: expected 1");
    if (!json.contains("requests") || !json["requests"].is_object())
        throw broken("requests: expected an object");
    return json;
}

std::optional<Learned> learned_of(const Json& json) {
    if (!json.is_object() || !json.contains("seconds") || !json["seconds"].is_array()) return {};
    Learned learned;
    for (const Json& each : json["seconds"]) {
        if (!each.is_number() || !(each.get<double>() > 0)) return {};
        learned.seconds.push_back(each.get<double>());
    }
    for (const auto& [key, member] : {std::pair{"error", &Learned::error},
                                      {"low", &Learned::low},
                                      {"high", &Learned::high},
                                      {"samples", &Learned::samples},
                                      {"bytes", &Learned::bytes},
                                      {"given_up", &Learned::given_up}}) {
        if (!json.contains(key) || !json[key].is_number() || !(json[key].get<double>() >= 0))
            return {};
        learned.*member = json[key].get<double>();
    }
    return learned;
}

Json json_of(const Learned& learned) {
    return {{"seconds", learned.seconds},  {"error", learned.error},     {"low", learned.low},
            {"high", learned.high},        {"samples", learned.samples}, {"bytes", learned.bytes},
            {"given_up", learned.given_up}};
}

void forget_oldest(Json& requests) {
    while (requests.size() > kMostRequests) {
        auto oldest = requests.begin();
        for (auto it = requests.begin(); it != requests.end(); ++it)
            if (it->value("when", "") < oldest->value("when", "")) oldest = it;
        requests.erase(oldest);
    }
}

}  // namespace

Wisdom Wisdom::load(const std::string& file) {
    Wisdom wisdom;
    wisdom.file_ = file;
    try {
        const Json json = read_file(file);
        for (const auto& [key, request] : json["requests"].items()) {
            if (!request.is_object() || !request.contains("paths")) continue;
            for (const auto& [path, learned] : request["paths"].items())
                if (auto known = learned_of(learned)) wisdom.requests_[key][path] = *known;
        }
    } catch (const InputError& error) {
        wisdom.problem_ = error.message().marked() + "; it is not used, and left as it is";
    }
    return wisdom;
}

const Wisdom::Paths* Wisdom::find(const std::string& request) const {
    const auto found = requests_.find(request);
    return found == requests_.end() ? nullptr : &found->second;
}

void Wisdom::keep(const std::string& request, const std::string& about,
                  const Paths& learned) const {
    if (file_.empty() || request.empty() || !problem_.empty() || learned.empty()) return;
    try {
        fs::create_directories(fs::path(file_).parent_path());
        Json json = read_file(file_);
        Json& entry = json["requests"][request];
        entry["about"] = about;
        entry["when"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
        for (const auto& [path, each] : learned) entry["paths"][path] = json_of(each);
        forget_oldest(json["requests"]);
        write_text(file_, json.dump(1) + "\n");
    } catch (const std::exception&) {
        return;  // a cache that cannot be written is none
    }
}

std::string wisdom_key(const Looked& looked) {
    const Data& data = *looked.input.data;
    Request want = looked.want;
    want.budget = {};
    want.minimize = {};
    want.threads = want.ranks = 1;
    Fingerprint of;
    add_build(of);
    of.add(usable_cores()).add(data.what.text()).add(data.what.values).add(want);
    of.bytes(data.samples.data(), static_cast<std::size_t>(data.what.bytes()));
    return of.certain() ? of.text() : "";
}

}  // namespace edgewise
