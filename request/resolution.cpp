#include "request/resolution.hpp"

#include <algorithm>
#include <cstddef>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "request/geometry.hpp"
#include "request/input.hpp"
#include "request/make_request.hpp"

namespace edgewise {
namespace {

/// What is given and counts samples of the input; "": nothing does.
Message counts_samples(const Query& query) {
    const GeometrySpec& geometry = query.geometry;
    if (query.clip.box || !query.clip.planes.empty() || !query.clip.balls.empty())
        return query.clip.settings();
    if (geometry.crop) return setting("crop");
    if (geometry.about) return setting("about");
    if (geometry.eye) return setting("eye");
    if (geometry.look_at) return setting("look_at");
    const auto found = std::ranges::find_if(geometry.steps, [](const GeometryStep& step) {
        return step.kind == GeometryStep::Kind::matrix || step.kind == GeometryStep::Kind::path;
    });
    return found == geometry.steps.end() ? Message() : setting_of(found->kind);
}

}  // namespace

int level_as_fine(const store::Header& header, const ScreenGrid& grid, Job job) {
    const int axes = header.volume ? 3 : 2;
    double sample = std::min(grid.spacing.x(), grid.spacing.y());
    if (job == Job::warp && axes == 3) sample = std::min(sample, grid.spacing.z());
    int coarsest = header.level;
    for (std::size_t i = 0; i < header.levels.size(); ++i) {
        bool fine = true;
        for (int axis = 0; axis < axes; ++axis)
            fine = fine && header.spacing[static_cast<std::size_t>(axis)] *
                                   static_cast<double>(header.extent[axis]) <=
                               sample * static_cast<double>(header.levels[i][axis]);
        if (fine) coarsest = std::max(coarsest, static_cast<int>(i));
    }
    return coarsest;
}

store::Selection chosen_selection(const Query& query, const std::optional<Outputs>& outputs) {
    store::Selection selection = selection_of(query);
    if (!query.level_by_result) return selection;
    if (query.job != Job::render && query.job != Job::warp)
        throw RequestError(message(
            "@level(auto): only pictures and warps have samples to choose one by; name a number"));
    if (const Message found = counts_samples(query); !found.empty())
        throw RequestError(message(
            "@level(auto): {} counts samples of the resolution that is read; name its number",
            found));
    const Input input = inspected(query.input, selection);
    if (input.header.levels.size() < 2) return selection;
    GeometrySpec seen = query.geometry;
    seen.upright = outputs && !outputs->none() && !outputs->format().volumes;
    take_usual_size(seen, grid_of(input), query.job);
    const Geometry geometry = geometry_of(seen, grid_of(input), query.job);
    selection.level = level_as_fine(input.header, geometry.grid, query.job);
    return selection;
}

}  // namespace edgewise
