// An X-ray picture of a sphere on two ways: the planner's own choice, and one through the spectrum.
#include <cmath>
#include <cstdio>

#include "planner/planner.hpp"
#include "reference/phantoms.hpp"
#include "runtime/runtime.hpp"
#include "scene/scene.hpp"
#include "transitions/catalogue.hpp"

int main() {
    using namespace edgewise;
    MemoryBudget memory(std::size_t{256} << 20);
    auto sphere = std::make_shared<const Data>(make_phantom("sphere", 64, &memory));

    Request want;  // the volume seen along z, sample for pixel
    want.mode = Mode::xray;
    want.input = want.screen = sphere->what.extent;
    want.budget.error = 0.01;
    const Statistics statistics = statistics_of(*sphere, &memory);
    const Catalogue edges = catalogue();
    const Scene scene = measure_scene(edges, *sphere, statistics, want, nullptr, &memory);
    const Ask ask{want, scene};

    float first = 0;
    for (const char* via : {"", "spectrum.slice"}) {
        PlanOptions options;
        if (*via) options.demands.via = {demand_of(via, edges)};
        const Answer answer = plan(edges, ask, {{sphere->what}}, default_profile(edges), options);
        if (!answer.plan) return std::puts(answer.problem.c_str()), 1;
        float centre = 0;
        run(*answer.plan, ask, sphere,
            [&](int, const auto& picture) { centre = picture->template as<float>()[32 * 65]; },
            {.memory = &memory});
        for (const std::string& step : answer.plan->texts()) std::printf("%s  ", step.c_str());
        std::printf("\n  predicted error %.1e, centre %.3f\n", answer.plan->predicted.error,
                    centre);
        if (*via && std::abs(centre - first) > 0.02f * first) return 1;
        first = centre;
    }
    return 0;
}
