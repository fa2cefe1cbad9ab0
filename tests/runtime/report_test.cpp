// The drawing of a plan and the trace of a run can be read by others.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using testing::ToyJob;

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
    const std::string dot = flow_dot(plan, job.ask());
    EXPECT_TRUE(dot.starts_with("digraph flow {"));
    EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
    std::set<std::string> nodes, ends;
    const std::regex node(R"(\n    (t\d+r\d+) \[label=)"), arc(R"(\n  (\w+) -> (\w+);)");
    for (auto it = std::sregex_iterator(dot.begin(), dot.end(), node); it != std::sregex_iterator();
         ++it)
        EXPECT_TRUE(nodes.insert((*it)[1]).second);
    EXPECT_EQ(nodes.size(), job.run(plan, 1).trace.size());
    int arcs = 0;
    for (auto it = std::sregex_iterator(dot.begin(), dot.end(), arc); it != std::sregex_iterator();
         ++it, ++arcs) {
        EXPECT_TRUE((*it)[1] == "source" || nodes.contains((*it)[1]));
        EXPECT_TRUE(nodes.contains((*it)[2]));
        ends.insert((*it)[2]);
    }
    EXPECT_EQ(ends, nodes) << "a node that nothing starts";
    EXPECT_EQ(arcs, 6 + 2 * 6 * 6 + 5 * 12 * 6);
}

}  // namespace
}  // namespace edgewise
