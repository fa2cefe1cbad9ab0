#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/runtime.hpp"
#include "runtime/schedule.hpp"

namespace edgewise {

std::string flow_dot(const Plan& plan, const Ask& ask) {
    std::vector<int> frames;
    for (int frame = 0; frame < ask.want.frames; ++frame) frames.push_back(frame);
    const Schedule what = schedule(plan, ask, frames);
    std::string dot =
        "digraph flow {\n  rankdir=LR;\n  node [shape=box, fontname=\"Helvetica\"];\n"
        "  source [shape=ellipse];\n";
    for (std::size_t i = 0; i < what.lanes.size(); ++i) {
        dot += fmt::format("  subgraph cluster_{} {{\n    label=\"lane {}, {:.1f} MiB\";\n", i, i,
                           what.lanes[i].bytes / 0x1p20);
        for (const int at : what.lanes[i].tasks) {
            const Task& task = what.tasks[at];
            for (std::size_t r = 0; r < task.regions.size(); ++r)
                dot += fmt::format("    t{}r{} [label=\"{}\\nview {}, region {} of {}\"];\n", at, r,
                                   plan.steps[task.step].text(), task.view, r + 1,
                                   task.regions.size());
        }
        dot += "  }\n";
    }
    for (std::size_t at = 0; at < what.tasks.size(); ++at) {
        const Task& task = what.tasks[at];
        for (std::size_t r = 0; r < task.regions.size(); ++r) {
            if (task.input < 0) {
                dot += fmt::format("  source -> t{}r{};\n", at, r);
                continue;
            }
            for (std::size_t q = 0; q < what.tasks[task.input].regions.size(); ++q)
                dot += fmt::format("  t{}r{} -> t{}r{};\n", task.input, q, at, r);
        }
    }
    return dot + "}\n";
}

std::string chrome_trace(const Plan& plan, const std::vector<Ran>& trace) {
    nlohmann::json events = nlohmann::json::array();
    for (const Ran& ran : trace)
        events.push_back(
            {{"name", ran.step < static_cast<int>(plan.steps.size()) ? plan.steps[ran.step].text()
                                                                     : std::string("step")},
             {"ph", "X"},
             {"pid", 1},
             {"tid", ran.thread},
             {"ts", ran.begin * 1e6},
             {"dur", (ran.end - ran.begin) * 1e6},
             {"args", {{"view", ran.view}, {"region", ran.region}}}});
    return events.dump(1) + "\n";
}

}  // namespace edgewise
