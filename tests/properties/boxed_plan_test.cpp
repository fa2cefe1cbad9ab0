// Where no path is small enough, the planner runs the last steps of one box by box.
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "planner/boxed.hpp"
#include "planner/planner.hpp"
#include "runtime/runtime.hpp"
#include "scene/scene.hpp"
#include "tests/properties/run_request.hpp"
#include "tests/runtime/flow_text.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

struct Rendered {
    MemoryBudget memory{std::size_t{1} << 30};
    std::shared_ptr<const Data> data =
        std::make_shared<const Data>(make_phantom("gaussians", 56, &memory));
    Request want = request_of(Job::render, Mode::xray, data->what,
                              {rotation(25, -40, 10), rotation(25, 50, 10)});
    Scene scene = scene_of(*data, want, memory);
    PlanOptions options;

    Rendered() {
        const Catalogue edges = catalogue();
        for (const char* step : {"warp.backward/filter=foh", "project.combine"})
            options.demands.via.push_back(demand_of(step, edges));
    }
    Answer answer() const {
        return plan(catalogue(), {want, scene}, {{data->what}}, default_profile(catalogue()),
                    options);
    }
};

TEST(BoxedPlan, KeepsABudgetThatNoWholeOneKeeps) {
    Rendered rendered;
    const Answer whole = rendered.answer();
    ASSERT_TRUE(whole.plan);
    EXPECT_EQ(whole.plan->boxes, 1);
    const auto expected =
        results_of(*whole.plan, {rendered.want, rendered.scene}, rendered.data, 2, rendered.memory);
    for (const double share : {0.6, 0.3}) {
        rendered.want.budget.bytes = share * whole.plan->predicted.bytes;
        for (const int threads : {1, 2}) {
            rendered.want.threads = threads;
            const Answer answer = rendered.answer();
            ASSERT_TRUE(answer.plan) << answer.problem;
            EXPECT_GT(answer.plan->boxes, 1);
            EXPECT_EQ(answer.plan->texts(), whole.plan->texts());
            // Boxes beside one another make the samples around their faces twice.
            EXPECT_GT(answer.plan->steps[0].seconds, 0);
            EXPECT_GE(boxed(*whole.plan, {rendered.want, rendered.scene}, 8, rendered.options)
                          ->predicted.seconds,
                      whole.plan->predicted.seconds);
            MemoryBudget memory(static_cast<std::size_t>(*rendered.want.budget.bytes));
            const auto results = results_of(*answer.plan, {rendered.want, rendered.scene},
                                            rendered.data, threads, memory);
            // What stands around arrays: pages, which a model of samples does not count.
            constexpr double kAround = 65536;
            EXPECT_LE(static_cast<double>(memory.peak()), answer.plan->predicted.bytes + kAround);
            EXPECT_EQ(rms_difference(results, expected), 0);
        }
    }
}

TEST(BoxedPlan, DrawingHasTheNodesThatRun) {
    Rendered rendered;
    const Answer whole = rendered.answer();
    ASSERT_TRUE(whole.plan);
    const Ask ask{rendered.want, rendered.scene};
    const std::optional<Plan> in_boxes = boxed(*whole.plan, ask, 8, rendered.options);
    ASSERT_TRUE(in_boxes);
    for (const Plan& plan : {*whole.plan, *in_boxes}) {
        RunOptions options;
        options.threads = 2;
        options.memory = &rendered.memory;
        const Outcome outcome = run(
            plan, ask, rendered.data, [](int, const auto&) {}, options);
        const toys::FlowText drawn(flow_dot(plan, ask));
        EXPECT_EQ(drawn.nodes.size(), outcome.trace.size());
        EXPECT_EQ(drawn.by_step(), toys::FlowText::by_step(outcome.trace));
        EXPECT_EQ(drawn.started, drawn.nodes);
        EXPECT_EQ(drawn.ended, drawn.nodes);
        const int boxes = static_cast<int>(boxes_of(plan.steps.back().offer.to.extent, 8).size());
        EXPECT_EQ(drawn.boxes, plan.boxes > 1 ? boxes * rendered.want.frames : 0);
        EXPECT_EQ(drawn.inside, drawn.boxes) << "two steps, one arc between them in each box";
        // The source and, of whole results, one for each view of each task: boxes have no volume.
        EXPECT_EQ(drawn.data.size(), 1u + (plan.boxes > 1 ? 1 : 2) * rendered.want.frames);
    }
}

TEST(BoxedPlan, PromisesNothingThatBoxesCannotKeep) {
    Rendered rendered;
    // The picture alone takes more.
    rendered.want.budget.bytes = 0.5 * screen_picture(rendered.data->what, rendered.want).bytes();
    const Answer answer = rendered.answer();
    EXPECT_FALSE(answer.plan);
    EXPECT_FALSE(answer.nearest.empty());
}

TEST(BoxedPlan, OneStepHasNothingToSave) {
    Rendered rendered;
    rendered.options.demands = {};
    const Answer answer = rendered.answer();
    ASSERT_TRUE(answer.plan);
    ASSERT_EQ(answer.plan->steps.size(), 1u);
    EXPECT_FALSE(boxed(*answer.plan, {rendered.want, rendered.scene}, 8, rendered.options));
}

}  // namespace
}  // namespace edgewise
