#include "runtime/schedule.hpp"

#include <algorithm>
#include <map>

namespace edgewise {
namespace {

/// What an allocation may take beyond the bytes of its samples: slack behind them, whole pages.
constexpr double kAround = 4096 + kArraySlack;

const Representation& vertex(const Plan& plan, int place) {
    return place == 0 ? plan.source : plan.steps[place - 1].offer.to;
}

/// Frames that share intermediate results come one after the other, so that few of these live.
std::vector<int> grouped(const Plan& plan, std::vector<int> frames) {
    std::stable_sort(frames.begin(), frames.end(), [&](int a, int b) {
        for (int place = 1; place < static_cast<int>(plan.steps.size()); ++place) {
            const Placement& placed = vertex(plan, place).placed;
            if (placed.variant(a) != placed.variant(b))
                return placed.variant(a) < placed.variant(b);
        }
        return false;
    });
    return frames;
}

/// Bytes of the boxes that a region is made from, while it is made.
double bytes_in_boxes(const Plan& plan, const Task& task, const std::vector<Region>& boxes) {
    double most = 0;
    for (int step = task.first; step < task.step; ++step) {
        const auto bytes = [&](int of) {
            return of < task.step ? plan.steps[of].offer.to.bytes(boxes[of - task.first]) + kAround
                                  : 0;
        };
        most = std::max(most, bytes(step) + bytes(step + 1));
    }
    return most;
}

void count_bytes(Schedule& schedule, const Plan& plan, const Ask& ask) {
    for (Lane& lane : schedule.lanes) {
        double kept = 0;
        for (const int at : lane.tasks) {
            const Task& task = schedule.tasks[at];
            const Step& step = plan.steps[task.step];
            const bool reads_own = task.input >= 0 && !schedule.tasks[task.input].shared &&
                                   schedule.tasks[task.input].lane == task.lane;
            const double made = held_bytes(step.offer.to);
            const Step& begin = plan.steps[task.first];
            const double read = reads_own ? held_bytes(begin.offer.from) : 0;
            double scratch = 0, boxes = 0;
            for (int of = task.first; of <= task.step; ++of)
                scratch = std::max(scratch, plan.steps[of].scratch);
            for (const std::vector<Region>& of : task.boxes)
                boxes = std::max(boxes, bytes_in_boxes(plan, task, of));
            // As many are made at once as there are threads.
            boxes *= std::min<double>(ask.want.threads, static_cast<double>(task.regions.size()));
            const double beside =
                scratch + boxes + kAround * static_cast<double>(task.regions.size());
            lane.bytes = std::max(lane.bytes, kept + read + made + beside);
            if (task.shared) kept += made;
        }
    }
}

}  // namespace

double held_bytes(const Representation& what) { return what.own_bytes() + kAround; }

Schedule schedule(const Plan& plan, const Ask& ask, const std::vector<int>& frames) {
    Schedule result;
    const int steps = static_cast<int>(plan.steps.size());
    if (steps == 0) {
        result.ready = frames;
        return result;
    }
    const int boxed = first_in_boxes(plan, ask);
    std::map<std::pair<int, int>, int> made;  // (step, variant) -> task
    const bool set_up = frames.size() > 1 && plan.steps.back().offer.to.runs() > 1 &&
                        plan.steps.front().offer.to.runs() == 1;
    if (set_up) result.lanes.emplace_back();
    for (const int frame : grouped(plan, frames)) {
        int input = -1, lane = -1;
        for (int step = 0; step < steps; ++step) {
            const int begin = step;
            if (step == boxed) step = steps - 1;
            const Representation& to = plan.steps[step].offer.to;
            const int variant = to.placed.variant(frame);
            const auto [found, fresh] =
                made.try_emplace({step, variant}, static_cast<int>(result.tasks.size()));
            if (fresh) {
                const bool follows_set_up = input < 0 || result.tasks[input].lane == 0;
                const bool once = set_up && to.runs() == 1 && follows_set_up;
                if (!once && lane < 0) {
                    lane = static_cast<int>(result.lanes.size());
                    result.lanes.emplace_back();
                }
                Task task{step, begin, variant, frame, once ? 0 : lane, input, 0,
                          {},   {},    {},      false};
                const Step& by = plan.steps[step];
                task.regions = begin < step ? boxes_of(by.offer.to.extent, plan.boxes)
                                            : regions_of(by.by->parts(by.offer, ask), by.offer);
                for (const Region& region : task.regions)
                    if (begin < step)
                        task.boxes.push_back(boxes_read(plan, ask, begin, region, frame));
                result.lanes[task.lane].tasks.push_back(found->second);
                if (input >= 0) {
                    Task& from = result.tasks[input];
                    ++from.readers;
                    from.shared = from.shared || from.lane != task.lane;
                }
                result.tasks.push_back(std::move(task));
            }
            input = found->second;
        }
        result.tasks[input].frames.push_back(frame);
    }
    count_bytes(result, plan, ask);
    return result;
}

}  // namespace edgewise
