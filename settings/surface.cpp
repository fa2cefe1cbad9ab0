
#include "settings/jobs.hpp"
#include "settings/light.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

/// Of an isosurface or of labels' surfaces, whichever it is.
std::optional<double>& smooth_in(Query& query) {
    return query.labels ? query.smooth : query.finish.smooth;
}

void take_smooth(Query& query, const SettingValue& value, const Reading& reading) {
    const Message called = reading.called();
    smooth_in(query) = reads::expect_within(Limits::between(0, 1),
                                            number_of(called, reads::word(value, called)), called);
}

SettingValue smooth_of(const Query& query) {
    return reads::told(query.labels ? query.smooth : query.finish.smooth);
}

}  // namespace

Rows surface_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        "", {{"isovalue", "V", "the surface where values reach V", has::mesh,
              reads::number(&Query::isovalue)},
             {"labels", "", help_of_labels("a closed surface around each label but 0"), has::mesh,
              reads::labels()},
             {"smooth", "0..1", message("{}; of isosurfaces: default 0", help_of_smooth()),
              has::mesh, reads::with_limits(Limits::between(0, 1), {take_smooth, smooth_of})},
             QuerySetting{"lids", "", "closes an isosurface at the volume's faces", has::mesh,
                          reads::flag(&Query::finish, &SurfaceFinish::lids)}
                 .typed_as("close"),
             {"largest", "", "keeps the connected part with the largest area; of labels, of each",
              has::mesh, reads::flag(&Query::finish, &SurfaceFinish::largest)},
             {"decimate", "0..1", "takes away this share of the triangles", has::mesh,
              reads::number_in(Limits::between(0, 1), &Query::finish, &SurfaceFinish::decimate)}});
    return rows;
}

}  // namespace edgewise
