#include "engine/facts/folder_facts.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "graph/hash.hpp"
#include "request/outputs.hpp"

namespace edgewise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kSchema = 2;

std::string digits_of(const std::string& text) {
    Hash hash;
    hash.add(text.data(), text.size());
    return fmt::format("{:016x}", hash.value());
}

/// The oldest tenth goes at once, so that not every fact asks for the times of all files.
void forget_oldest(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    if (files.size() < FolderFacts::kMostFiles) return;
    std::vector<std::pair<fs::file_time_type, fs::path>> aged;
    for (const fs::path& file : files) {
        std::error_code gone;
        aged.emplace_back(fs::last_write_time(file, gone), file);
    }
    std::sort(aged.begin(), aged.end());
    const std::size_t most = FolderFacts::kMostFiles - FolderFacts::kMostFiles / 10;
    for (std::size_t i = 0; i + most < aged.size(); ++i) {
        std::error_code gone;
        fs::remove(aged[i].second, gone);
    }
}

}  // namespace

std::string FolderFacts::file_of(const FactKey& key) const {
    return fmt::format("{}/{}-{}-{}.json", folder_, digits_of(key.name), key.kind,
                       digits_of(key.place));
}

std::optional<std::string> FolderFacts::find(const FactKey& key) const {
    if (folder_.empty()) return std::nullopt;
    std::ifstream stream(file_of(key), std::ios::binary);
    if (!stream) return std::nullopt;
    std::string text(kMostBytes + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMostBytes) return std::nullopt;
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object() || json.value("schema", Json()) != kSchema || !json.contains("fact"))
        return std::nullopt;
    // By its place in the folder it was found, by all that it depends on it is the right one.
    if (json.value("of", Json()) != key.of) return std::nullopt;
    return json["fact"].dump();
}

bool FolderFacts::keep(const FactKey& key, const std::string& fact) {
    if (folder_.empty()) return false;
    try {
        const Json json = {
            {"schema", kSchema}, {"about", key.name}, {"of", key.of}, {"fact", Json::parse(fact)}};
        const std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
        if (text.size() > kMostBytes) return false;
        fs::create_directories(folder_);
        forget_oldest(folder_);
        write_text(file_of(key), text);
        return true;
    } catch (const std::exception&) {
        return false;  // facts that cannot be kept are measured again
    }
}

}  // namespace edgewise
