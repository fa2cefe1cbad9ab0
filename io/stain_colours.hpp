#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "graph/words.hpp"
#include "io/channel_colours.hpp"

namespace edgewise::store {

/// Stains and fluorescent proteins, in lower case without spaces and signs, with the colour that
/// they are shown in. It goes by the wavelength of most of their emission: up to 480 nm blue, to
/// 560 green, to 640 red; beyond, which the eye hardly sees, magenta.
struct Stain {
    const char* name;
    const char* colour;
};
inline constexpr Stain kStains[] = {
    {"dapi", "blue"},         {"hoechst", "blue"},      {"hoechst33342", "blue"},
    {"hoechst33258", "blue"}, {"bfp", "blue"},          {"ebfp", "blue"},
    {"tagbfp", "blue"},       {"mtagbfp2", "blue"},     {"alexa350", "blue"},
    {"alexa405", "blue"},     {"cfp", "blue"},          {"ecfp", "blue"},
    {"cerulean", "blue"},     {"gfp", "green"},         {"egfp", "green"},
    {"mgfp", "green"},        {"emgfp", "green"},       {"sfgfp", "green"},
    {"fitc", "green"},        {"fluorescein", "green"}, {"alexa488", "green"},
    {"cy2", "green"},         {"yfp", "green"},         {"eyfp", "green"},
    {"venus", "green"},       {"citrine", "green"},     {"mneongreen", "green"},
    {"clover", "green"},      {"gcamp", "green"},       {"bodipyfl", "green"},
    {"rfp", "red"},           {"dsred", "red"},         {"tdtomato", "red"},
    {"mcherry", "red"},       {"cherry", "red"},        {"tagrfp", "red"},
    {"mruby", "red"},         {"mscarlet", "red"},      {"mkate2", "red"},
    {"tritc", "red"},         {"rhodamine", "red"},     {"texasred", "red"},
    {"cy3", "red"},           {"alexa546", "red"},      {"alexa555", "red"},
    {"alexa568", "red"},      {"alexa594", "red"},      {"propidiumiodide", "red"},
    {"cy5", "magenta"},       {"cy55", "magenta"},      {"cy7", "magenta"},
    {"alexa633", "magenta"},  {"alexa647", "magenta"},  {"alexa660", "magenta"},
    {"alexa680", "magenta"},  {"alexa750", "magenta"},  {"irfp", "magenta"},
    {"draq5", "magenta"},     {"atto647n", "magenta"},  {"atto647", "magenta"},
};

/// The colour in which a stain or a protein of this name is usually shown: DAPI blue, GFP green,
/// mCherry red. Nothing where the name tells of none.
inline std::optional<Colour> colour_by_name(const std::string& name) {
    // "Alexa Fluor 488", "AF488", "alexa-488" are one.
    std::string plain;
    for (const char c : lower(name))
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) plain += c;
    for (const std::string_view before : {"alexafluor", "af"})
        if (plain.starts_with(before) && plain.size() == before.size() + 3)
            plain = "alexa" + plain.substr(before.size());
    for (const Stain& stain : kStains)
        if (plain == stain.name) return colour_of(stain.colour);
    return std::nullopt;
}

/// That of colour_by_number(), or the next of these that is not taken.
inline Colour free_colour(int channel, const std::set<Colour>& taken) {
    constexpr int kColours = 7;
    for (int further = 0; further < kColours; ++further)
        if (const Colour colour = colour_by_number(channel + further); !taken.contains(colour))
            return colour;
    return colour_by_number(channel);
}

}  // namespace edgewise::store
