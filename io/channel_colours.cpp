#include "io/channel_colours.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "io/text.hpp"
#include "io/tiff_layout.hpp"
#include "io/zarr.hpp"

namespace edgewise::store {
namespace {

constexpr Colour kWhite{1, 1, 1};

struct Named {
    const char* name;
    Colour colour;
};
constexpr Named kNamed[] = {{"red", {1, 0, 0}},    {"green", {0, 1, 0}}, {"blue", {0, 0, 1}},
                            {"white", kWhite},     {"cyan", {0, 1, 1}},  {"magenta", {1, 0, 1}},
                            {"yellow", {1, 1, 0}}, {"grey", kWhite},     {"gray", kWhite}};
constexpr int kNumbered = 7;  // the first of these

}  // namespace

std::vector<std::optional<Colour>> channel_colours(const std::string& source,
                                                   const Selection& pick) {
    std::error_code none;
    std::vector<std::optional<Colour>> colours;
    if (is_zarr(source))
        colours = zarr_colours(source, pick);
    else if (std::filesystem::is_regular_file(source, none) && is_tiff(File(source).head(4)))
        colours = tiff_colours(source, pick);
    const bool all_white = std::all_of(colours.begin(), colours.end(),
                                       [](const auto& colour) { return colour == kWhite; });
    if (colours.size() > 1 && all_white) colours.clear();
    return colours;
}

std::vector<std::optional<std::array<double, 2>>> channel_ranges(const std::string& source) {
    std::error_code none;
    if (std::filesystem::is_regular_file(source, none) && is_tiff(File(source).head(4)))
        return tiff_ranges(source);
    return {};
}

std::vector<std::string> channel_names(const std::string& source, const Selection& pick) {
    std::error_code none;
    if (is_zarr(source)) return zarr_channel_names(source, pick);
    if (std::filesystem::is_regular_file(source, none) && is_tiff(File(source).head(4)))
        return tiff_channel_names(source, pick);
    return {};
}

int channel_named(const std::string& name, const std::string& source, const Selection& pick) {
    const std::vector<std::string> names = channel_names(source, pick);
    std::vector<int> found;
    std::vector<std::string> known;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i].empty()) continue;
        known.push_back(names[i]);
        if (same_word(names[i], name)) found.push_back(static_cast<int>(i));
    }
    if (found.size() == 1) return found.front();
    if (found.size() > 1)
        throw RequestError(message("@channel({}): channels {} of {} have this name", name,
                                   fmt::join(found, " and "), source));
    throw RequestError(message("@channel: {} names no channel '{}'; {}", source, name,
                               known.empty()
                                   ? "it names none: expected a number, from 0"
                                   : fmt::format("its channels are {}", fmt::join(known, ", "))));
}

Colour colour_by_number(int channel) noexcept { return kNamed[channel % kNumbered].colour; }

std::optional<Colour> colour_of(const std::string& text) {
    const std::string word = lower(text);
    for (const Named& named : kNamed)
        if (word == named.name) return named.colour;
    const std::string digits = word.starts_with('#') ? word.substr(1) : word;
    if (digits.size() != 6 || digits.find_first_not_of("0123456789abcdef") != digits.npos)
        return std::nullopt;
    Colour colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<double>(std::stoi(digits.substr(2 * c, 2), nullptr, 16)) / 255;
    return colour;
}

std::string text_of(const Colour& colour) {
    std::string text = "#";
    for (const double part : colour)
        text += fmt::format("{:02x}", static_cast<int>(std::lround(255 * part)));
    return text;
}

}  // namespace edgewise::store
