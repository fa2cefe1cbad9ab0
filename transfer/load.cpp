#include "transfer/load.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "transfer/fields.hpp"
#include "transfer/formats.hpp"
#include "transfer/named.hpp"

namespace edgewise {
namespace {

using transfer::refuse;

std::string text_in(const std::string& file, const std::string& where) {
    constexpr std::size_t kLargest = 32 << 20;
    std::error_code none;
    std::ifstream stream(file, std::ios::binary);
    // A device or a pipe may never end.
    if (!std::filesystem::is_regular_file(file, none) || !stream) refuse(where, "cannot be read");
    std::string text;
    // It may grow while it is read, and some files do not tell their size.
    std::array<char, 1 << 16> block;
    while (text.size() <= kLargest && stream) {
        stream.read(block.data(), block.size());
        text.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    }
    if (text.size() > kLargest) refuse(where, "is larger than any transfer function (32 MiB)");
    return text;
}

}  // namespace

nlohmann::json transfer::parsed(std::string_view text, const std::string& where) {
    // A parser that descends would overflow the stack on a million brackets; formats take 8 levels.
    // Empty lists take ten times as much memory as text; tables have the most parts.
    constexpr std::int64_t kMostParts = 8 << 20;
    std::int64_t parts = 0;
    const auto shallow = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        if (depth > 16) refuse(where, "is nested too deeply");
        if (++parts > kMostParts) refuse(where, "has more parts than any transfer function");
        return true;
    };
    try {
        return nlohmann::json::parse(text, shallow);
    } catch (const nlohmann::json::exception& error) {
        refuse(where, "is not JSON: " + shortened(error.what(), 300));
    }
}

TransferSpec load_transfer(const std::string& file, SettingName field) {
    const transfer::NamedFile from = transfer::named_file(file);
    const std::string where = setting(field, file).marked();
    const std::string text = text_in(from.file, where);
    const auto read = [&] {
        if (transfer::is_slicer_text(text)) return transfer::slicer_text_transfer(text, where);
        const nlohmann::json all = transfer::parsed(text, where);
        const nlohmann::json& json = transfer::preset_named_in(all, from.name, where);
        if (transfer::is_vtkjs(json)) return transfer::vtkjs_transfer(json, where);
        if (transfer::is_paraview(json)) return transfer::paraview_transfer(json, where);
        if (transfer::is_slicer(json)) return transfer::slicer_transfer(json, where);
        return transfer::own_transfer(json, where);
    };
    TransferSpec spec = read();
    spec.from = where;
    return spec;
}

}  // namespace edgewise
