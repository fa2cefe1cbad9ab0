#include "scene/scene.hpp"

#include "graph/range.hpp"
#include "reference/written.hpp"
#include "scene/measured_runs.hpp"
#include "scene/preview.hpp"

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

void count_scene(const Catalogue& catalogue, const Data& input, const Request& want, Scene& scene,
                 std::pmr::memory_resource* memory) {
    for (const Transition& edge : catalogue)
        if (edge.count && edge.views_refused(want).empty())
            edge.count(input, want, scene.facts, memory);
}

Scene measure_scene(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
                    const Request& want, const Phantom* formula, std::pmr::memory_resource* memory,
                    int times, const Demands& asked) {
    Scene scene = unseen_scene(statistics);
    if (want.job->values == JobTraits::Values::other) return scene;

    const ReferenceField field(input, want.field, formula);
    const auto see = want.job->of_points() ? preview_points : preview_rays;
    Preview preview = see(catalogue, asked, want, field, statistics, memory, times);
    scene.facts = std::move(preview.facts);
    scene.likely = std::move(preview.likely);
    scene.draws = preview.draws;
    scene.exhausted = preview.exhausted;
    scene.range = range_of(want, preview.low, preview.high);
    measure_runs(catalogue, input, statistics, want, formula, scene, memory);
    return scene;
}

}  // namespace edgewise
