#include "cli/wisdom.hpp"

#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/machine.hpp"
#include "cli/outputs.hpp"
#include "cli/session.hpp"
#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMostRequests = 500;  // the oldest are forgotten

std::string cache_file() {
    if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder)
        return std::string(folder) + "/edgewise/wisdom.json";
    if (const char* home = std::getenv("HOME"); home && *home)
        return std::string(home) + "/.cache/edgewise/wisdom.json";
    return {};
}

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
                                      {"bytes", &Learned::bytes},
                                      {"given_up", &Learned::given_up}}) {
        if (!json.contains(key) || !json[key].is_number() || !(json[key].get<double>() >= 0))
            return {};
        learned.*member = json[key].get<double>();
    }
    return learned;
}

Json json_of(const Learned& learned) {
    return {{"seconds", learned.seconds}, {"error", learned.error}, {"low", learned.low},
            {"high", learned.high},       {"bytes", learned.bytes}, {"given_up", learned.given_up}};
}

void forget_oldest(Json& requests) {
    while (requests.size() > kMostRequests) {
        auto oldest = requests.begin();
        for (auto it = requests.begin(); it != requests.end(); ++it)
            if (it->value("when", "") < oldest->value("when", "")) oldest = it;
        requests.erase(oldest);
    }
}

/// Mixes bytes into 64 bits (multiply and fold, as in wyhash): not for secrets, but fast.
class Hash {
 public:
    void add(const void* data, std::size_t bytes) noexcept {
        const auto* at = static_cast<const unsigned char*>(data);
        for (; bytes >= 8; at += 8, bytes -= 8) {
            std::uint64_t word;
            std::memcpy(&word, at, 8);
            mix(word);
        }
        std::uint64_t rest = bytes;
        std::memcpy(&rest, at, bytes);
        mix(rest ^ (std::uint64_t{bytes} << 56));
    }
    std::uint64_t value() const noexcept { return state_; }

 private:
    void mix(std::uint64_t word) noexcept {
        const auto product = static_cast<unsigned __int128>(state_ ^ word) * 0x9e3779b97f4a7c15ull;
        state_ = static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64) ^
                 0xa0761d6478bd642full;
    }
    std::uint64_t state_ = 0x2d358dccaa6c78a5ull;
};

}  // namespace

Wisdom Wisdom::load() {
    Wisdom wisdom;
    try {
        const Json json = read_file(cache_file());
        for (const auto& [key, request] : json["requests"].items()) {
            if (!request.is_object() || !request.contains("paths")) continue;
            for (const auto& [path, learned] : request["paths"].items())
                if (auto known = learned_of(learned)) wisdom.requests_[key][path] = *known;
        }
    } catch (const InputError& error) {
        wisdom.problem_ = std::string(error.what()) + "; it is not used, and left as it is";
    }
    return wisdom;
}

const Wisdom::Paths* Wisdom::find(const std::string& request) const {
    const auto found = requests_.find(request);
    return found == requests_.end() ? nullptr : &found->second;
}

void Wisdom::keep(const std::string& request, const std::string& about,
                  const Paths& learned) const {
    const std::string file = cache_file();
    if (file.empty() || !problem_.empty() || learned.empty()) return;
    try {
        fs::create_directories(fs::path(file).parent_path());
        Json json = read_file(file);
        Json& entry = json["requests"][request];
        entry["about"] = about;
        entry["when"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
        for (const auto& [path, each] : learned) entry["paths"][path] = json_of(each);
        forget_oldest(json["requests"]);
        write_text(file, json.dump(1) + "\n");
    } catch (const std::exception&) {
        return;  // a cache that cannot be written is none
    }
}

std::string wisdom_key(const Session& session) {
    const Request& want = session.want();
    const Data& data = *session.input->data;
    std::string text =
        fmt::format("{}|{}|{}|{} {} {}|{} {}|{}|{}|{:a} {:a} {:a} {:a}|{:a} {:a}|",
                    EDGEWISE_VERSION, cpu_name(), usable_cores(), name_of(want.job),
                    name_of(want.mode), want.axes, text_of(want.screen, 3), want.frames,
                    data.what.text(), static_cast<int>(want.field), want.unit, want.zero, want.miss,
                    want.outside, data.what.values.slope, data.what.values.offset);
    for (int view = 0; view < want.frames; ++view)
        for (int i = 0; i < 16; ++i) text += fmt::format("{:a},", want.views.at(view).data()[i]);
    for (int i = 0; i < 3; ++i)
        text += fmt::format("{:a} {:a},", want.spacing[i], want.background[i]);
    if (want.eye)
        text += fmt::format("eye {:a} {:a} {:a} {:a}", want.eye->at[0], want.eye->at[1],
                            want.eye->at[2], want.eye->plane);
    if (want.range) text += fmt::format("range {:a}", *want.range);
    text += fmt::format("{:a}", want.transfer.unit);
    for (const auto& point : want.transfer.points)
        text += fmt::format("{:a} {:a} {:a} {:a} {:a};", point.value, point.opacity, point.color[0],
                            point.color[1], point.color[2]);
    Hash hash;
    hash.add(text.data(), text.size());
    hash.add(data.samples.data(), static_cast<std::size_t>(data.what.bytes()));
    return fmt::format("{:016x}", hash.value());
}

}  // namespace edgewise::cli
