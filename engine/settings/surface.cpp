#include <array>

#include "engine/settings/jobs.hpp"
#include "engine/settings/light.hpp"
#include "engine/settings/readers.hpp"

namespace edgewise {
namespace {

/// Of an isosurface or of labels' surfaces, whichever it is.
std::optional<double>& smooth_in(Query& query) {
    return query.labels ? query.smooth : query.finish.smooth;
}

void take_smooth(Query& query, const SettingValue& value, const Reading& reading) {
    smooth_in(query) = number_of(reading.called(), reads::word(value, reading.called()));
}

SettingValue smooth_of(const Query& query) {
    return reads::told(query.labels ? query.smooth : query.finish.smooth);
}

}  // namespace

Rows surface_settings() {
    static const std::array rows{
        QuerySetting{.name = "isovalue",
                     .value = "V",
                     .help = "the surface where values reach V",
                     .of = has::mesh,
                     .reads = reads::number(&Query::isovalue)},
        QuerySetting{.name = "labels",
                     .help = help_of_labels("a closed surface around each label but 0"),
                     .of = has::mesh,
                     .reads = reads::labels()},
        QuerySetting{.name = "smooth",
                     .value = "0..1",
                     .help = message("{}; of isosurfaces: default 0", help_of_smooth()),
                     .of = has::mesh,
                     .reads = {take_smooth, smooth_of}},
        QuerySetting{.name = "lids",
                     .option = "close",
                     .help = "closes an isosurface at the volume's faces",
                     .of = has::mesh,
                     .reads = reads::flag(&Query::finish, &SurfaceFinish::lids)},
        QuerySetting{.name = "largest",
                     .help = "keeps the connected part with the largest area; of labels, of each",
                     .of = has::mesh,
                     .reads = reads::flag(&Query::finish, &SurfaceFinish::largest)},
        QuerySetting{.name = "decimate",
                     .value = "0..1",
                     .help = "takes away this share of the triangles",
                     .of = has::mesh,
                     .reads = reads::number(&Query::finish, &SurfaceFinish::decimate)},
    };
    return rows;
}

}  // namespace edgewise
