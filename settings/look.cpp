#include <fmt/format.h>

#include "graph/words.hpp"
#include "presentation/colormap.hpp"
#include "settings/jobs.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

constexpr const char* kLooks = "Looks";
constexpr int kMostAlong = 1000;  // pictures
constexpr auto kOfOutput = QuerySetting::Acts::output;

Message help_of_colormap(Job job) {
    const char* of = has::render(job) ? "mip, minip, xray, mean ..." : "pictures";
    std::string maps;
    for (const std::string& name : colormap_names()) maps += (maps.empty() ? "" : ", ") + name;
    return fmt::format("{}: {}; or rows of R,G,B (docs/looks.md)", of, maps);
}

Message help_of_montage(Job job) {
    return has::render(job) ? "frames side by side, in W columns and H rows"
                            : "slices side by side, W x H of them, equally far apart";
}

void take_montage(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = value.text('x');
    const std::vector<std::string> sides = split(lower(text), 'x');
    if (sides.size() != 2)
        throw RequestError(
            message("{}: '{}' given; expected columns and rows, as 4x3", reading.called(), text));
    const auto side = [&](const std::string& word) {
        return static_cast<int>(whole_of(reading.called(), word, 1, kMostAlong));
    };
    query.look.montage = {side(sides[0]), side(sides[1])};
}

}  // namespace

Rows look_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        kLooks,
        {{"colormap", "NAME|FILE", help_of_colormap, has::views,
          reads::text(&Query::look, &LookSpec::colormap)},
         {"depth_colour", "",
          message("mip: colours by the depth of the value, red in front and blue behind, or of "
                  "@colormap"),
          has::render, reads::flag(&Query::look, &LookSpec::depth_colour)},
         {"legend", "", "colours and their values, in a strip at the right", has::views,
          reads::flag(&Query::look, &LookSpec::legend)},
         {"scale_bar", "", "a length, at the lower left", has::views,
          reads::flag(&Query::look, &LookSpec::scale_bar)},
         {"montage", "WxH", help_of_montage, has::views,
          reads::with_limits(
              Limits::between(1, kMostAlong),
              {take_montage, [](const Query& query) { return reads::told(query.look.montage); }})}},
        kOfOutput);
    return rows;
}

}  // namespace edgewise
