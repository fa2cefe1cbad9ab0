// Whether paths that are chosen without a budget are as good as the plain one: random requests of a
// file, the path that is chosen, and the ratio of its error to the plain path's on four times the
// usual draws of a full preview. One line a request that does not take the plain path, and a
// summary.
//
//     build/release/bin/likeness_benchmark FILE [REQUESTS [SEED]]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "planner/alike.hpp"
#include "planner/planner.hpp"
#include "scene/scene.hpp"

using namespace edgewise;

namespace {

constexpr int kDraws = 4;  // times the usual ones

Query drawn_query(const char* file, bool volume, std::mt19937& bits) {
    const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(bits); };
    const auto turn = [&] { return std::to_string(360 * unit()); };
    const char* const modes[] = {"mip", "minip", "mean", "xray", "composite"};
    const double frames[] = {1, 24, 120, 360};
    std::vector<Given> given;
    const bool warps = !volume || unit() < 0.1;
    if (volume)
        given.push_back({"rotate", turn() + "," + turn() + "," + turn()});
    else
        given.push_back({"rotate", 360 * unit()});
    if (!warps && unit() < 0.5)
        given.push_back({"zoom", std::exp((2 * unit() - 1) * std::numbers::ln2)});
    if (!warps) {
        given.push_back({"mode", std::string(modes[bits() % std::size(modes)])});
        if (const double count = frames[bits() % std::size(frames)]; count > 1)
            given.push_back({"turntable", count});
        given.push_back({"size", std::floor(128 * std::exp(unit() * 2 * std::numbers::ln2))});
    }
    Query query = query_of(warps ? Job::warp : Job::render, given);
    query.input = file;
    return query;
}

/// The error of the chosen path over the plain one's; below 0: they are the same path, or nothing
/// is known.
double ratio_of(const Planned& planned) {
    const std::vector<Source> sources = planned.sources();
    const Scene scene =
        preview_scene(planned.engine.edges(), *planned.input.data, planned.statistics, planned.want,
                      planned.input.phantom ? &*planned.input.phantom : nullptr,
                      planned.memory.get(), kDraws)
            .as_likely();
    const Ask ask{planned.want, scene};
    const auto plain = plain_way(planned.engine.edges(), ask, sources, *planned.want.budget.like);
    const auto error = likely_error(*planned.answer.plan, ask, sources);
    if (!plain || !error || !(plain->likely > 0)) return -1;
    const std::vector<std::string> steps = planned.answer.plan->texts();
    if (steps.size() == 1 && steps.front() == plain->step) return -1;
    return *error * scene.range / plain->likely;
}

}  // namespace

int main(int count, char** words) {
    if (count < 2) {
        std::fprintf(stderr, "usage: likeness_benchmark FILE [REQUESTS [SEED]]\n");
        return 2;
    }
    const int requests = count > 2 ? std::atoi(words[2]) : 40;
    std::mt19937 bits(count > 3 ? static_cast<unsigned>(std::atoi(words[3])) : 1);
    const Engine engine(catalogue(), default_profile(catalogue()));
    const bool volume = Volume::read(words[1]).header().volume;
    std::vector<double> ratios;
    for (int i = 0; i < requests; ++i) {
        const Query query = drawn_query(words[1], volume, bits);
        const Prepared plan =
            prepare(engine, query, nullptr, {.errors = ErrorsWanted::for_choice, .front = false});
        const double ratio = plan.planned().want.budget.like ? ratio_of(plan.planned()) : -1;
        if (ratio < 0) continue;
        ratios.push_back(ratio);
        std::printf("%6.3f %4d frames", ratio, plan.frames());
        for (const std::string& step : plan.plan().texts()) std::printf(" %s", step.c_str());
        std::printf("\n");
    }
    const auto within = [&](double limit) {
        return std::count_if(ratios.begin(), ratios.end(), [&](double r) { return r <= limit; });
    };
    std::printf(
        "%s: %d requests, %zu with another path than the plain one; of these within 1.05: "
        "%td, 1.10: %td, 2: %td\n",
        words[1], requests, ratios.size(), within(1.05), within(1.10), within(2));
}
