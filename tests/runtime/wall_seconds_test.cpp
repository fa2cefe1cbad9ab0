// The time of a step is what a clock beside the run shows, not what its threads add up to.
#include <gtest/gtest.h>
#include <numeric>

#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using toys::ToyJob;

Ran node(int step, int view, double begin, double end) {
    return {.step = step, .view = view, .begin = begin, .end = end};
}

TEST(WallSeconds, OverlappingRegionsOfARunCountOnce) {
    // Two threads, four regions; then a step of one region after a pause.
    const std::vector<Ran> trace = {node(0, 0, 1, 3), node(0, 0, 1.5, 4), node(0, 0, 3, 5),
                                    node(0, 0, 4, 4.5), node(1, 0, 6, 7)};
    EXPECT_EQ(wall_seconds(trace, 3), (std::vector<double>{4, 1, 0}));
}

TEST(WallSeconds, RunsSideBySideShareTheTimeThatTheyHaveInCommon) {
    // View 0 is in step 0 from 0 to 2 and in step 1 from 2 to 6; view 1 in step 0 from 1 to 4.
    const std::vector<Ran> trace = {node(0, 0, 0, 2), node(1, 0, 2, 6), node(0, 1, 1, 4)};
    // Step 0 alone until 2, then half of 2 to 4; step 1 the other half and 4 to 6.
    EXPECT_EQ(wall_seconds(trace, 2), (std::vector<double>{3, 3}));
}

TEST(WallSeconds, NothingRanTakesNothing) {
    EXPECT_EQ(wall_seconds({}, 2), (std::vector<double>{0, 0}));
}

TEST(WallSeconds, StepsTakeNoLongerThanTheRun) {
    for (const int frames : {1, 5})
        for (const int threads : {1, 3}) {
            ToyJob job(frames, std::min(frames, 2));
            job.load();
            const Plan plan = job.plan();
            const Outcome outcome = job.run(plan, threads);
            ASSERT_EQ(outcome.step_seconds.size(), plan.steps.size());
            const double all =
                std::accumulate(outcome.step_seconds.begin(), outcome.step_seconds.end(), 0.0);
            EXPECT_GT(*std::min_element(outcome.step_seconds.begin(), outcome.step_seconds.end()),
                      0);
            EXPECT_LE(all, outcome.seconds * (1 + 1e-9));  // sums of some hundred differences
            if (frames > 1) continue;
            // One frame: from a step's first node to its last.
            for (std::size_t k = 0; k < plan.steps.size(); ++k) {
                double begin = outcome.seconds, end = 0;
                for (const Ran& ran : outcome.trace)
                    if (ran.step == static_cast<int>(k)) {
                        begin = std::min(begin, ran.begin);
                        end = std::max(end, ran.end);
                    }
                EXPECT_NEAR(outcome.step_seconds[k], end - begin, 1e-12);
            }
        }
}

}  // namespace
}  // namespace edgewise
