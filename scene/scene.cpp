#include "scene/scene.hpp"

#include <algorithm>

#include "graph/range.hpp"
#include "reference/written.hpp"
#include "scene/measured_results.hpp"
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

double preview_operations(const Request& want) noexcept {
    // So many clusters are drawn at most, and a fourth as many outputs hold all there are. What one
    // takes was timed: 0.03 ms of points of a warp, 1 ms of rays, where an operation takes 0.033
    // ns.
    constexpr double kPoints = 500, kRays = 288;
    const bool rays = want.job->of_rays();
    const double outputs = static_cast<double>(want.output().samples()) * want.frames;
    return std::min(rays ? kRays : kPoints, outputs / 4) * (rays ? 3e7 : 9e5);
}

namespace {

/// Whether a path may take an edge: unless somebody asks for it, none does that has a parameter of
/// which no value is tried.
bool is_tried(const Transition& edge, const Demands& asked) {
    const auto has_values = [](const auto& one) { return !one.second.tried.empty(); };
    const auto names = [&](const Demand& demand) { return demand.names(edge); };
    return std::ranges::all_of(edge.parameters, has_values) ||
           std::ranges::any_of(asked.via, names);
}

}  // namespace

void count_scene(const Catalogue& catalogue, const Data& input, const Request& want, Scene& scene,
                 std::pmr::memory_resource* memory, const Demands* asked) {
    const Data whole = with_slack(input, memory);
    std::vector<CountFacts> called;
    for (const Transition& edge : catalogue) {
        if (!edge.views_refused(want).empty()) continue;
        if (edge.count && (!asked || is_tried(edge, *asked)))
            edge.count(whole, want, scene.facts, memory);
        for (const CountFacts count : edge.shared_counts) {
            if (std::find(called.begin(), called.end(), count) != called.end()) continue;
            count(whole, want, scene.facts, memory);
            called.push_back(count);
        }
    }
}

bool has_silent_edges(const Catalogue& catalogue) {
    return std::any_of(catalogue.begin(), catalogue.end(),
                       [](const Transition& edge) { return !edge.error; });
}

Preview preview_facts(const Catalogue& catalogue, const Data& given, const Statistics& statistics,
                      const Request& want, const Phantom* formula, const PreviewOf& of,
                      std::pmr::memory_resource* memory) {
    const Data input = with_slack(given, memory);
    const ReferenceField field(input, want.field, formula);
    const auto see = want.job->of_points() ? preview_points : preview_rays;
    return see(catalogue, of, want, field, statistics, memory);
}

Scene preview_scene(const Catalogue& catalogue, const Data& given, const Statistics& statistics,
                    const Request& want, const Phantom* formula, std::pmr::memory_resource* memory,
                    int times, const Demands& asked) {
    const Data input = with_slack(given, memory);
    Scene scene = unseen_scene(statistics);
    if (want.job->values == JobTraits::Values::other) {
        measure_results(catalogue, asked, input, statistics, want, scene, memory);
        return scene;
    }
    Preview preview = preview_facts(catalogue, input, statistics, want, formula,
                                    {.asked = asked, .times = static_cast<double>(times)}, memory);
    scene.facts = std::move(preview.facts);
    scene.likely = std::move(preview.likely);
    scene.draws = preview.draws;
    scene.exhausted = preview.exhausted;
    scene.range = range_of(want, preview.low, preview.high);
    return scene;
}

void run_scene(const Catalogue& catalogue, const Data& given, const Statistics& statistics,
               const Request& want, const Phantom* formula, Scene& scene,
               std::pmr::memory_resource* memory, const Demands& asked) {
    if (want.job->values == JobTraits::Values::other) return;
    measure_runs(catalogue, asked, with_slack(given, memory), statistics, want, formula, scene,
                 memory);
}

Scene measure_scene(const Catalogue& catalogue, const Data& given, const Statistics& statistics,
                    const Request& want, const Phantom* formula, std::pmr::memory_resource* memory,
                    int times, const Demands& asked) {
    const Data input = with_slack(given, memory);
    Scene scene = preview_scene(catalogue, input, statistics, want, formula, memory, times, asked);
    run_scene(catalogue, input, statistics, want, formula, scene, memory, asked);
    return scene;
}

}  // namespace edgewise
