// The drawing of a plan and the trace of a run can be read by others.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/runtime/flow_text.hpp"
#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using toys::FlowText;
using toys::ToyJob;

TEST(Report, TraceIsWhatChromeReads) {
    ToyJob job(5, 2);
    job.load();
    const Plan plan = job.plan();
    const Outcome outcome = job.run(plan, 3);
    const nlohmann::json events = nlohmann::json::parse(chrome_trace(plan, outcome.trace));
    ASSERT_TRUE(events.is_array());
    EXPECT_EQ(events.size(), 6u + 2 * 6 + 5 * 12);
    std::set<std::string> steps;
    for (const auto& event : events) {
        EXPECT_EQ(event.at("ph"), "X");
        EXPECT_GE(event.at("ts").get<double>(), 0);
        EXPECT_GE(event.at("dur").get<double>(), 0);
        EXPECT_LE(event.at("ts").get<double>() + event.at("dur").get<double>(),
                  outcome.seconds * 1e6);
        EXPECT_LT(event.at("tid").get<int>(), 3);
        steps.insert(event.at("name"));
    }
    EXPECT_EQ(steps.size(), 3u);
}

TEST(Report, FlowHasANodeForEveryOneThatRuns) {
    ToyJob job(5, 2);
    job.load();
    const Plan plan = job.plan();
    const FlowText drawn(flow_dot(plan, job.ask()));
    const Outcome outcome = job.run(plan, 1);
    EXPECT_EQ(drawn.nodes.size(), outcome.trace.size());
    EXPECT_EQ(drawn.by_step(), FlowText::by_step(outcome.trace));
    EXPECT_EQ(drawn.data.size(), 1u + 1 + 2 + 5) << "the source and one for each task";
    EXPECT_EQ(drawn.started, drawn.nodes) << "a node that nothing starts";
    EXPECT_EQ(drawn.ended, drawn.nodes) << "a node that nothing waits for";
    EXPECT_EQ(drawn.arcs, 2 * (6 + 2 * 6 + 5 * 12)) << "one into each node, one out of it";
}

}  // namespace
}  // namespace edgewise
