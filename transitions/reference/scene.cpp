#include "transitions/reference/scene.hpp"

#include "graph/range.hpp"
#include "transitions/reference/preview.hpp"
#include "transitions/reference/written.hpp"

namespace edgewise {

Scene unseen_scene(const Statistics& statistics) {
    Scene scene;
    scene.low = statistics.low;
    scene.high = statistics.high;
    scene.mean = statistics.mean;
    scene.commonest = statistics.commonest;
    scene.non_finite = statistics.non_finite;
    scene.occupied = statistics.occupied;
    scene.occupied_fraction = statistics.occupied_fraction;
    scene.range = range_between(statistics.low, statistics.high);
    return scene;
}

Scene measure_scene(const Data& input, const Statistics& statistics, const Request& want,
                    const Phantom* formula, std::pmr::memory_resource* memory, int times) {
    Scene scene = unseen_scene(statistics);

    const ReferenceField field(input, want.field, formula);
    Preview preview = want.job == Job::warp ? preview_points(want, field, statistics, memory, times)
                                            : preview_rays(want, field, statistics, memory, times);
    scene.facts = std::move(preview.facts);
    scene.likely = std::move(preview.likely);
    scene.draws = preview.draws;
    scene.exhausted = preview.exhausted;
    scene.range = range_of(want, preview.low, preview.high);
    return scene;
}

}  // namespace edgewise
