#include <array>

#include "engine/settings/geometry_steps.hpp"
#include "engine/settings/jobs.hpp"
#include "engine/settings/readers.hpp"
#include "graph/words.hpp"

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
    static const std::array rows{
        QuerySetting{.name = "view",
                     .group = kGeometryGroup,
                     .value = "SIDE",
                     .help = "front, back, left, right, top, bottom (or coronal, sagittal, axial), "
                             "or x, y, z: along the file's axis",
                     .of = has::views,
                     .reads = reads::text(&Query::geometry, &GeometrySpec::view)},
        QuerySetting{.name = "rotate",
                     .group = kGeometryGroup,
                     .value = "A|X,Y,Z",
                     .help = "degrees about z (2D), or about x, then y, then z",
                     .of = has::views,
                     .reads = reads::step(Kind::rotate)},
        QuerySetting{.name = "matrix",
                     .group = kGeometryGroup,
                     .value = "NUMBERS|FILE",
                     .help = "object -> screen, row by row",
                     .of = has::views,
                     .reads = reads::step(Kind::matrix)},
        QuerySetting{.name = "scale",
                     .group = kGeometryGroup,
                     .value = "S[,S[,S]]",
                     .help = "more than 1 enlarges",
                     .of = has::views,
                     .reads = reads::step(Kind::scale)},
        QuerySetting{.name = "translate",
                     .group = kGeometryGroup,
                     .value = "T,T[,T]",
                     .help = "in the file's unit",
                     .of = has::views,
                     .reads = reads::step(Kind::translate)},
        QuerySetting{.name = "shear",
                     .group = kGeometryGroup,
                     .value = "xy=K,...",
                     .help = "adds K y to x",
                     .of = has::views,
                     .reads = reads::step(Kind::shear)},
        QuerySetting{.name = "about",
                     .group = kGeometryGroup,
                     .value = "X,Y[,Z]",
                     .help = "sample that is held fixed; default the centre",
                     .of = has::views,
                     .reads = reads::list_of_numbers(&Query::geometry, &GeometrySpec::about)},
        QuerySetting{.name = "perspective",
                     .group = kGeometryGroup,
                     .value = "FOV",
                     .help = "vertical angle; default parallel rays",
                     .of = has::render,
                     .reads = reads::number(&Query::geometry, &GeometrySpec::perspective)},
        QuerySetting{
            .name = "eye",
            .group = kGeometryGroup,
            .value = "X,Y,Z",
            .help = message("where the eye of @perspective is, also within the volume: a sample "
                            "of FILE"),
            .of = has::render,
            .reads = reads::so_many_numbers<3>("X,Y,Z", &Query::geometry, &GeometrySpec::eye)},
        QuerySetting{
            .name = "look_at",
            .group = kGeometryGroup,
            .value = "X,Y,Z",
            .help = message("sample of FILE in the middle of its view, in place of @view's "
                            "direction; up stays that of @view"),
            .of = has::render,
            .reads = reads::so_many_numbers<3>("X,Y,Z", &Query::geometry, &GeometrySpec::look_at)},
        QuerySetting{.name = "turntable",
                     .group = kGeometryGroup,
                     .value = "N[,ARC]",
                     .help = "N views about screen y, over ARC degrees (360), at its place among "
                             "the others",
                     .of = has::render,
                     .reads = reads::step(Kind::turntable)},
        QuerySetting{.name = "path",
                     .group = kGeometryGroup,
                     .value = "FILE",
                     .help = "matrices, one for each view, at its place among the others",
                     .of = has::render,
                     .reads = reads::step(Kind::path)},
        QuerySetting{.name = "zoom",
                     .group = kGeometryGroup,
                     .value = "Z",
                     .help = "more than 1 shows less of the scene, larger",
                     .of = has::render,
                     .reads = reads::number(&Query::geometry, &GeometrySpec::zoom)},
        QuerySetting{
            .name = "crop",
            .option = "clip",
            .group = kGeometryGroup,
            .value = "X0,Y0,Z0,X1,Y1,Z1",
            .help = "crop: first and last sample of FILE that is kept along each axis (an image: "
                    "X0,Y0,X1,Y1); it stays where it is in the world",
            .of = has::warp,
            .reads = reads::list_of_numbers(&Query::geometry, &GeometrySpec::crop)},
        QuerySetting{
            .name = "grid_moves",
            .option = "move",
            .group = kGeometryGroup,
            .value = "content|grid",
            .help = message("what all but @view turns: what is seen (default), or where it is "
                            "sampled (MPR)"),
            .of = has::warp,
            .reads = reads::parsed(moves_grid, &Query::geometry, &GeometrySpec::grid_moves)},
        QuerySetting{.name = "spacing",
                     .group = kGeometryGroup,
                     .value = "S[,S[,S]]",
                     .help = "distance of output samples",
                     .of = has::views,
                     .reads = reads::list_of_numbers(&Query::geometry, &GeometrySpec::spacing),
                     .per_axis = true},
        QuerySetting{.name = "size",
                     .group = kGeometryGroup,
                     .value = value_of_size,
                     .help = help_of_size,
                     .of = has::views,
                     .reads = {take_size, size_of},
                     .per_axis = true},
    };
    return rows;
}

}  // namespace edgewise
