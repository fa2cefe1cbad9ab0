#include <fmt/format.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "runtime/runtime.hpp"
#include "runtime/schedule.hpp"

namespace edgewise {

namespace {

/// Draws a schedule: a rectangle is a node of one step and one region, an ellipse is data. What
/// run() does between nodes, to allocate the data and to join the regions, is drawn as the data.
class FlowDrawing {
 public:
    FlowDrawing(const Plan& plan, const Ask& ask)
        : plan_(plan), ask_(ask), schedule_(schedule(plan, ask, all_frames(ask))) {}

    std::string dot() {
        dot_ =
            "digraph flow {\n  rankdir=LR;\n  node [shape=box, fontname=\"Helvetica\"];\n"
            "  edge [fontname=\"Helvetica\", fontsize=10];\n";
        line(1, "source [shape=ellipse, label=\"{}\"];", plan_.source.text());
        for (std::size_t i = 0; i < schedule_.lanes.size(); ++i) lane(i);
        for (std::size_t at = 0; at < schedule_.tasks.size(); ++at) arcs(at);
        return dot_ + "}\n";
    }

 private:
    static std::vector<int> all_frames(const Ask& ask) {
        std::vector<int> frames;
        for (int frame = 0; frame < ask.want.frames; ++frame) frames.push_back(frame);
        return frames;
    }

    template <class... Values>
    void line(int depth, fmt::format_string<Values...> text, Values&&... values) {
        dot_.append(2 * static_cast<std::size_t>(depth), ' ');
        fmt::format_to(std::back_inserter(dot_), text, std::forward<Values>(values)...);
        dot_ += '\n';
    }

    static std::string node(std::size_t task, std::size_t region, int step) {
        return fmt::format("t{}r{}s{}", task, region, step);
    }

    void lane(std::size_t i) {
        line(1, "subgraph cluster_{} {{", i);
        line(2, "label=\"lane {}, {:.1f} MiB\";", i, schedule_.lanes[i].bytes / 0x1p20);
        for (const int at : schedule_.lanes[i].tasks) {
            const Task& task = schedule_.tasks[at];
            for (std::size_t r = 0; r < task.regions.size(); ++r)
                task.first < task.step ? box(at, r) : region(2, at, r, task.step);
            line(2, "d{} [shape=ellipse, label=\"{}\"];", at, data_text(task));
        }
        line(1, "}}");
    }

    void region(int depth, std::size_t at, std::size_t r, int step) {
        const Task& task = schedule_.tasks[at];
        const char* what = task.first < task.step ? "box" : "region";
        line(depth, "{} [label=\"{}\\nview {}, {} {} of {}\"];", node(at, r, step),
             plan_.steps[step].text(), task.view, what, r + 1, task.regions.size());
    }

    /// One node of run() makes all steps of a box, and the trace has an entry for each.
    void box(std::size_t at, std::size_t r) {
        const Task& task = schedule_.tasks[at];
        line(2, "subgraph cluster_t{}r{} {{", at, r);
        line(3, "style=dashed; label=\"box {} of {}\";", r + 1, task.regions.size());
        for (int step = task.first; step <= task.step; ++step) region(3, at, r, step);
        const std::vector<Region>& boxes = task.boxes[r];
        for (int step = task.first; step < task.step; ++step)
            line(3, "{} -> {} [label=\"{}\"];", node(at, r, step), node(at, r, step + 1),
                 text_of(boxes[step - task.first].extent(), plan_.steps[step].offer.to.axes));
        line(2, "}}");
    }

    std::string data_text(const Task& task) const {
        const Step& step = plan_.steps[task.step];
        std::string text = step.offer.to.text();
        const std::size_t count = task.regions.size();
        const bool in_parts = step.by->parts(step.offer, ask_).kind == Partition::input;
        if (task.first < task.step)
            text += fmt::format("\\njoined from {} boxes", count);
        else if (count > 1)
            text += fmt::format("\\n{} {} {}", in_parts ? "merged from" : "joined from", count,
                                in_parts ? "parts" : "regions");
        if (task.frames.size() == 1) text += fmt::format("\\nframe {}", task.frames.front());
        if (task.frames.size() > 1) text += fmt::format("\\n{} frames", task.frames.size());
        return text;
    }

    void arcs(std::size_t at) {
        const Task& task = schedule_.tasks[at];
        const std::string input =
            task.input < 0 ? std::string("source") : fmt::format("d{}", task.input);
        for (std::size_t r = 0; r < task.regions.size(); ++r) {
            line(1, "{} -> {};", input, node(at, r, task.first));
            line(1, "{} -> d{};", node(at, r, task.step), at);
        }
    }

    const Plan& plan_;
    const Ask& ask_;
    const Schedule schedule_;
    std::string dot_;
};

}  // namespace

std::string flow_dot(const Plan& plan, const Ask& ask) { return FlowDrawing(plan, ask).dot(); }

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
