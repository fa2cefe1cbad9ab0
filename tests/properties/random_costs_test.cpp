// Random costs make the planner choose paths that would never win; what they make must be as near
// to the reference as they announce.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <set>

#include "planner/planner.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

constexpr int kSeeds = 24;

TEST(RandomCosts, ChooseManyPathsAllOfWhichKeepTheirWord) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto input = std::make_shared<const Data>(make_phantom("shepp-logan", 24, &memory));
    const Request want = request_of(Job::render, Mode::xray, input->what,
                                    {rotation(0, 20, 0), rotation(25, -40, 10)});
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const ReferenceField field(*input, want.field);
    const Expected expected(want, field, &memory);
    const Catalogue edges = catalogue();
    const std::vector<Plan> honest = paths_of(edges, ask, input->what, 1000);

    std::set<std::vector<std::string>> chosen;
    for (int seed = 1; seed <= kSeeds; ++seed) {
        PlanOptions options;
        options.random_costs = static_cast<std::uint64_t>(seed);
        const Answer answer = plan(edges, ask, {{input->what}}, default_profile(edges), options);
        ASSERT_TRUE(answer.plan);
        const std::vector<std::string> texts = answer.plan->texts();
        if (!chosen.insert(texts).second) continue;
        const auto same = std::find_if(honest.begin(), honest.end(),
                                       [&](const Plan& path) { return path.texts() == texts; });
        ASSERT_NE(same, honest.end());
        if (!same->predicted.known) continue;
        EXPECT_LE(expected.error_of(results_of(*answer.plan, ask, input, 2, memory)),
                  same->predicted.error)
            << fmt::format("{}", fmt::join(texts, " "));
    }
    EXPECT_GE(chosen.size(), 8u);
}

}  // namespace
}  // namespace edgewise
