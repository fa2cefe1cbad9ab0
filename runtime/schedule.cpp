#include "runtime/schedule.hpp"

#include <algorithm>
#include <map>

namespace edgewise {
namespace {

/// A node should not be shorter than 100 us; leaves are the edge's word for that, and more regions
/// than this bring nothing on the processors of one machine.
constexpr std::int64_t kMostRegions = 16;

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

void count_bytes(Schedule& schedule, const Plan& plan) {
    for (Lane& lane : schedule.lanes) {
        double kept = 0;
        for (const int at : lane.tasks) {
            const Task& task = schedule.tasks[at];
            const Step& step = plan.steps[task.step];
            const bool reads_own = task.input >= 0 && !schedule.tasks[task.input].shared &&
                                   schedule.tasks[task.input].lane == task.lane;
            lane.bytes = std::max(lane.bytes, kept + (reads_own ? step.offer.from.bytes() : 0) +
                                                  step.offer.to.bytes() + step.scratch);
            if (task.shared) kept += step.offer.to.bytes();
        }
    }
}

}  // namespace

std::vector<Region> regions_of(const Step& step, const Ask& ask) {
    const Partition parts = step.by->parts(step.offer, ask);
    const Extent extent =
        parts.kind == Partition::input ? step.offer.from.extent : step.offer.to.extent;
    const Region all = Region::all(extent);
    const int axis = extent.z > 1 ? 2 : 1;  // the slowest, so that regions are contiguous
    if (parts.kind == Partition::whole || parts.leaf[axis] < 1 || parts.leaf == Extent{})
        return {all};
    const std::int64_t leaves = (extent[axis] + parts.leaf[axis] - 1) / parts.leaf[axis];
    const std::int64_t each = parts.leaf[axis] * ((leaves + kMostRegions - 1) / kMostRegions);
    std::vector<Region> regions;
    for (std::int64_t begin = 0; begin < extent[axis]; begin += each) {
        regions.push_back(all);
        regions.back().begin[axis] = begin;
        regions.back().end[axis] = std::min(begin + each, extent[axis]);
    }
    return regions;
}

Schedule schedule(const Plan& plan, const Ask& ask, const std::vector<int>& frames) {
    Schedule result;
    const int steps = static_cast<int>(plan.steps.size());
    if (steps == 0) {
        result.ready = frames;
        return result;
    }
    std::map<std::pair<int, int>, int> made;  // (step, variant) -> task
    const bool set_up = frames.size() > 1 && plan.steps.back().offer.to.runs() > 1 &&
                        plan.steps.front().offer.to.runs() == 1;
    if (set_up) result.lanes.emplace_back();
    for (const int frame : grouped(plan, frames)) {
        int input = -1, lane = -1;
        for (int step = 0; step < steps; ++step) {
            const Representation& to = plan.steps[step].offer.to;
            const int variant = to.placed.variant(frame);
            const auto [found, fresh] =
                made.try_emplace({step, variant}, static_cast<int>(result.tasks.size()));
            if (fresh) {
                const bool once = set_up && to.runs() == 1;
                if (!once && lane < 0) {
                    lane = static_cast<int>(result.lanes.size());
                    result.lanes.emplace_back();
                }
                Task task{step, variant, frame, once ? 0 : lane, input, 0, {}, {}, false};
                task.regions = regions_of(plan.steps[step], ask);
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
    count_bytes(result, plan);
    return result;
}

}  // namespace edgewise
