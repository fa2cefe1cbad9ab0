#include "settings/selection.hpp"

#include <limits>

#include "graph/words.hpp"
#include "request/geometry.hpp"
#include "settings/jobs.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

using store::Selection;

constexpr std::int64_t kMostOfSelection = std::numeric_limits<int>::max();

int number_from_0(const std::string& text, const Message& called) {
    return static_cast<int>(whole_of(called, text, 0, kMostOfSelection));
}

void take_level(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = reads::word(value, reading.called());
    query.level_by_result = text == kLevelByResult;
    query.selection.level.reset();
    if (!query.level_by_result) query.selection.level = number_from_0(text, reading.called());
}

SettingValue level_of(const Query& query) {
    return query.level_by_result ? SettingValue(kLevelByResult)
                                 : reads::told(query.selection.level);
}

int time_of(const std::string& text, const Message& called) {
    if (same_word(text, kAll))
        throw RequestError(
            message("@time(all): of `@command(render)`, which makes a film, and of "
                    "`@command(filter)`, which writes a series; here expected one number, from 0"));
    return number_from_0(text, called);
}

void take_channel(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = reads::word(value, reading.called());
    if (names_several_channels(text))
        throw RequestError(
            message("@channel: '{}' is merged by `@command(render)` alone; here expected one "
                    "number, from 0",
                    text));
    const bool is_name = is_channel_name(text);
    query.channel_name = is_name ? text : "";
    query.selection.channel.reset();
    if (!is_name) query.selection.channel = number_from_0(text, reading.called());
}

SettingValue channel_of(const Query& query) {
    return query.channel_name.empty() ? reads::told(query.selection.channel)
                                      : SettingValue(query.channel_name);
}

std::string orientation_of(const std::string& text, const Message&) {
    directions_of(text);
    return text;
}

std::string unit_of(const std::string& text, const Message& called) {
    if (text.empty()) throw RequestError(message("{}: expected mm, um or nm", called));
    return text;
}

}  // namespace

bool names_several_channels(const std::string& channel) {
    return channel.find_first_of(",=") != channel.npos || same_word(channel, kAll);
}

bool is_channel_name(const std::string& channel) {
    return channel.find_first_not_of("+-.0123456789") != channel.npos && !same_word(channel, kAll);
}

Rows selection_settings() {
    using reads::parsed;
    constexpr auto kInput = QuerySetting::Acts::input;
    static const std::vector<QuerySetting> rows = grouped(
        "",
        {{"series", "UID|N", "which series of a folder, or image of an OME-TIFF", has::any,
          reads::text(&Query::selection, &Selection::series)},
         {"level", "N|auto",
          "which resolution of several (OME-Zarr), from 0, the finest; auto: the coarsest that is "
          "as fine as the result",
          has::any,
          reads::with_limits(
              {.least = 0, .greatest = kMostOfSelection, .allowed = {kLevelByResult}},
              {take_level, level_of})},
         {"time", "N|all",
          "which time point, from 0; all: a film of render, a frame for each; a series of filter",
          has::any,
          reads::with_limits(Limits::between(0, kMostOfSelection),
                             parsed(time_of, &Query::selection, &Selection::time))},
         {"channel", "N|NAME|N[=COLOUR],...|all",
          "which channel, from 0, or as the file calls it; render merges several, as 0,1 or "
          "0=red,2=#00ff80; of colours (RGB, RGBA) all are taken where none is named",
          has::any,
          reads::with_limits(Limits::between(0, kMostOfSelection), {take_channel, channel_of})},
         {"orient", "RAS|...", "where x, y, z point, where FILE is silent or wrong", has::any,
          parsed(orientation_of, &Query::selection, &Selection::orient)},
         QuerySetting{"input_spacing", "S[,S[,S]]",
                      "distance of FILE's samples, where it is silent or wrong", has::any,
                      reads::list_within(Limits::above(0), &Query::selection, &Selection::spacing)}
             .along_axes(),
         {"input_unit", "mm|um|nm", "unit of FILE's lengths, where it is silent or wrong", has::any,
          parsed(unit_of, &Query::selection, &Selection::unit)}},
        kInput);
    return rows;
}

}  // namespace edgewise
