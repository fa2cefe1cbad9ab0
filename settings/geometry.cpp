
#include "graph/words.hpp"
#include "settings/geometry_steps.hpp"
#include "settings/jobs.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

constexpr const char* kGeometryGroup = "Geometry, in the order given";
constexpr std::int64_t kMostSamplesAnAxis = 2147483647;

void take_size(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = value.text('x');
    OutputSize size{.fit = same_word(text, "fit"), .native = same_word(text, "native")};
    if (!size.fit && !size.native)
        for (const std::string& word : split(lower(text), 'x'))
            size.sides.push_back(whole_of(reading.called(), word, 1, kMostSamplesAnAxis));
    query.geometry.size = size;
}

SettingValue size_of(const Query& query) {
    const std::optional<OutputSize>& size = query.geometry.size;
    if (!size) return {};
    return size->fit || size->native ? SettingValue(size->text()) : SettingValue::of(size->sides);
}

bool moves_grid(const std::string& word, const Message& called) {
    const bool grid = same_word(word, "grid") || word == "true";
    if (!grid && !same_word(word, "content") && word != "false")
        throw RequestError(message("{}: '{}' is neither content nor grid", called, word));
    return grid;
}

Message value_of_size(Job job) { return has::warp(job) ? "WxH[xD]|N|fit" : "WxH|N|native"; }

Message help_of_size(Job job) {
    if (has::warp(job)) return "output samples; N: of the longer side";
    return "output samples; N: of the longer side; native: one for each smallest spacing of the "
           "volume. Default native, at least 512 on the longer side";
}

}  // namespace

Rows geometry_settings() {
    using Kind = GeometryStep::Kind;
    static const std::vector<QuerySetting> rows = grouped(
        kGeometryGroup,
        {{"view", "SIDE",
          "front, back, left, right, top, bottom (or coronal, sagittal, axial), or x, y, z: along "
          "the file's axis",
          has::views, reads::text(&Query::geometry, &GeometrySpec::view)},
         {"rotate", "A|X,Y,Z", "degrees about z (2D), or about x, then y, then z", has::views,
          reads::step(Kind::rotate)},
         {"matrix", "NUMBERS|FILE", "object -> screen, row by row", has::views,
          reads::step(Kind::matrix)},
         {"scale", "S[,S[,S]]", "more than 1 enlarges", has::views, reads::step(Kind::scale)},
         {"translate", "T,T[,T]", "in the file's unit", has::views, reads::step(Kind::translate)},
         {"shear", "xy=K,...", "adds K y to x", has::views, reads::step(Kind::shear)},
         {"about", "X,Y[,Z]", "sample that is held fixed; default the centre", has::views,
          reads::list_of_numbers(&Query::geometry, &GeometrySpec::about)},
         {"perspective", "FOV", "vertical angle; default parallel rays", has::render,
          reads::number_in(Limits::within(0, 180), &Query::geometry, &GeometrySpec::perspective)},
         {"eye", "X,Y,Z",
          message("where the eye of @perspective is, also within the volume: a sample of FILE"),
          has::render, reads::so_many_numbers<3>("X,Y,Z", &Query::geometry, &GeometrySpec::eye)},
         {"look_at", "X,Y,Z",
          message("sample of FILE in the middle of its view, in place of @view's direction; up "
                  "stays that of @view"),
          has::render,
          reads::so_many_numbers<3>("X,Y,Z", &Query::geometry, &GeometrySpec::look_at)},
         {"turntable", "N[,ARC]",
          "N views about screen y, over ARC degrees (360), at its place among the others",
          has::render, reads::step(Kind::turntable)},
         {"path", "FILE", "matrices, one for each view, at its place among the others", has::render,
          reads::step(Kind::path)},
         {"zoom", "Z", "more than 1 shows less of the scene, larger", has::render,
          // Beyond these rays of a picture are one ray, or all but one miss.
          reads::number_in(Limits::between(1e-6, 1e6), &Query::geometry, &GeometrySpec::zoom)},
         QuerySetting{"crop", "X0,Y0,Z0,X1,Y1,Z1",
                      "crop: first and last sample of FILE that is kept along each axis (an image: "
                      "X0,Y0,X1,Y1); it stays where it is in the world",
                      has::warp, reads::list_of_numbers(&Query::geometry, &GeometrySpec::crop)}
             .typed_as("clip"),
         QuerySetting{
             "grid_moves", "content|grid",
             message(
                 "what all but @view turns: what is seen (default), or where it is sampled (MPR)"),
             has::warp,
             reads::with_limits(
                 Limits::words({"content", "grid"}),
                 reads::parsed(moves_grid, &Query::geometry, &GeometrySpec::grid_moves))}
             .typed_as("move"),
         QuerySetting{
             "spacing", "S[,S[,S]]", "distance of output samples", has::views,
             reads::list_within(Limits::above(0), &Query::geometry, &GeometrySpec::spacing)}
             .along_axes(),
         QuerySetting{
             "size", value_of_size, help_of_size, has::views,
             reads::with_limits(
                 {.least = 1, .greatest = kMostSamplesAnAxis, .allowed = {"fit", "native"}},
                 {take_size, size_of})}
             .along_axes()});
    return rows;
}

}  // namespace edgewise
