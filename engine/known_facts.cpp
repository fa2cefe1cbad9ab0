#include "engine/known_facts.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/measure/machine.hpp"
#include "engine/request/outputs.hpp"
#include "graph/hash.hpp"

namespace edgewise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string digits_of(const std::string& text, std::uint64_t seed = 0) {
    Hash hash(seed);
    hash.add(text.data(), text.size());
    return fmt::format("{:016x}", hash.value());
}

/// 128 bits: chance does not make two data sets alike.
std::string fingerprint(const std::string& text) { return digits_of(text, 1) + digits_of(text, 2); }

/// The oldest tenth goes at once, so that not every fact asks for the times of all files.
void forget_oldest(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    if (files.size() < KnownFacts::kMostFiles) return;
    std::vector<std::pair<fs::file_time_type, fs::path>> aged;
    for (const fs::path& file : files) {
        std::error_code gone;
        aged.emplace_back(fs::last_write_time(file, gone), file);
    }
    std::sort(aged.begin(), aged.end());
    const std::size_t most = KnownFacts::kMostFiles - KnownFacts::kMostFiles / 10;
    for (std::size_t i = 0; i + most < aged.size(); ++i) {
        std::error_code gone;
        fs::remove(aged[i].second, gone);
    }
}

}  // namespace

KnownFacts::KnownFacts(std::optional<InputIdentity> identity, std::string folder)
    : identity_(std::move(identity)), folder_(std::move(folder)) {
    if (folder_.empty() && !cache_folder().empty()) folder_ = cache_folder() + "/scenes";
}

std::string KnownFacts::file_of(const std::string& name, const std::string& of) const {
    // By where the data are, not by what they are: facts of a changed file replace the old ones.
    const std::string request = of.empty() ? "" : "-" + digits_of(of);
    return fmt::format("{}/{}-{}{}.json", folder_, digits_of(identity_->where), name, request);
}

std::optional<Json> KnownFacts::find(const std::string& name, const std::string& of) const {
    if (!identity_ || folder_.empty()) return std::nullopt;
    std::ifstream stream(file_of(name, of), std::ios::binary);
    if (!stream) return std::nullopt;
    std::string text(kMostBytes + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMostBytes) return std::nullopt;
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object() || json.value("schema", Json()) != 1 || !json.contains("fact"))
        return std::nullopt;
    if (json.value("of", Json()) != fingerprint(identity_->what + "|" + of)) return std::nullopt;
    return json["fact"];
}

bool KnownFacts::keep(const std::string& name, const Json& fact, const std::string& of) const {
    if (!identity_ || folder_.empty()) return false;
    try {
        const Json json = {{"schema", 1},
                           {"about", identity_->where},
                           {"of", fingerprint(identity_->what + "|" + of)},
                           {"fact", fact}};
        const std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
        if (text.size() > kMostBytes) return false;
        fs::create_directories(folder_);
        forget_oldest(folder_);
        write_text(file_of(name, of), text);
        return true;
    } catch (const std::exception&) {
        return false;  // facts that cannot be kept are measured again
    }
}

}  // namespace edgewise
