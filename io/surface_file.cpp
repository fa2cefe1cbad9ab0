#include "io/surface_file.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/obj.hpp"
#include "io/ply.hpp"
#include "io/stl.hpp"
#include "io/text.hpp"

namespace edgewise::store {

const std::vector<SurfaceFormat>& surface_formats() {
    static const std::vector<SurfaceFormat> kFormats{
        {"PLY",
         {".ply"},
         "binary; normals; the label of each triangle; f64 far from the origin",
         write_ply},
        {"OBJ", {".obj"}, "text; normals; a group for each label", write_obj},
        {"STL",
         {".stl"},
         "binary; triangles share no vertices; far from the origin the header says what to add",
         write_stl},
    };
    return kFormats;
}

const SurfaceFormat* surface_format_of(std::string_view path) {
    const std::string low = lower(path);
    for (const SurfaceFormat& format : surface_formats())
        for (const std::string& ending : format.endings)
            if (low.ends_with(ending)) return &format;
    return nullptr;
}

void write_surface(const std::string& path, const SurfaceView& surface) {
    const SurfaceFormat* format = surface_format_of(path);
    if (!format)
        throw RequestError(fmt::format("{}: surfaces are written as .ply, .obj or .stl", path));
    format->write(path, surface);
}

}  // namespace edgewise::store
