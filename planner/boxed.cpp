#include "planner/boxed.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "planner/choice.hpp"
#include "planner/cost.hpp"

namespace edgewise {
namespace {

constexpr int kMostBoxes = 512;

/// What boxes take of the steps before the last one.
struct Between {
    std::vector<double> made;  // samples of all boxes over samples of the whole, by step
    double bytes = 0;          // at once, in one box
};

Between between(const Plan& plan, const Ask& ask, int first) {
    const std::size_t count = plan.steps.size() - static_cast<std::size_t>(first);
    const Representation& to = plan.steps.back().offer.to;
    const std::vector<Region> regions = boxes_of(to.extent, plan.boxes);
    const int views = to.runs();  // all of them: their boxes differ, and the peak is a promise
    Between all{.made = std::vector<double>(count, 0.0)};
    all.made.back() = 1;
    for (int variant = 0; variant < views; ++variant)
        for (const Region& region : regions) {
            const auto boxes = boxes_read(plan, ask, first, region, to.placed.first_view(variant));
            double before = 0;
            for (std::size_t k = 0; k + 1 < count; ++k) {
                const Representation& made = plan.steps[first + k].offer.to;
                all.made[k] += static_cast<double>(boxes[k].extent().samples()) /
                               static_cast<double>(made.samples()) / views;
                const double bytes = made.bytes(boxes[k]);
                all.bytes = std::max(all.bytes, before + bytes);
                before = bytes;
            }
        }
    return all;
}

/// The plan with its last steps in boxes. None where nothing lies between them.
/// @param added  what the boxes take; null: as if they took nothing
std::optional<Plan> with_between(const Plan& whole, const Ask& ask, int boxes,
                                 const PlanOptions& options, const Between* added) {
    Plan plan = whole;
    plan.boxes = boxes;
    const int last = static_cast<int>(plan.steps.size()) - 1, first = first_in_boxes(plan, ask);
    if (first >= last || plan.steps.back().offer.to.place != Place::memory) return {};

    // The steps count as one, from what the first of them reads to what the last one makes.
    StepCost all;
    const Representation& to = plan.steps.back().offer.to;
    all.made = to.bytes() + to.facet_bytes;
    double seconds = plan.predicted.seconds;
    for (int at = first; at <= last; ++at) {
        Step& step = plan.steps[at];
        const double more = added ? added->made[static_cast<std::size_t>(at - first)] : 1;
        seconds += (more - 1) * step.seconds;
        step.seconds *= more;
        step.predicted.seconds = step.seconds;
        all.seconds += step.seconds;
        all.scratch = std::max(all.scratch, step.scratch);
    }
    if (added) all.scratch += std::min(ask.want.threads, boxes) * added->bytes;
    Label before = first > 0 ? plan.steps[first - 1].label : Label{};
    before.peak = std::max(before.peak, options.pinned);
    const Offer merged{.from = plan.steps[first].offer.from, .to = to};
    const Label label = extend(before, merged, all, first == 0, options.pinned);

    plan.label.peak = label.peak;
    plan.label.seconds = seconds;
    for (int at = first; at <= last; ++at) plan.steps[at].predicted.bytes = label.peak;
    const double least = options.pinned + options.after;
    plan.predicted.seconds = seconds;
    plan.predicted.bytes = options.resident + std::max(label.peak, least);
    plan.predicted.expected = std::min(plan.predicted.expected, plan.predicted.bytes);
    return plan;
}

}  // namespace

std::optional<Plan> boxed(const Plan& whole, const Ask& ask, int boxes,
                          const PlanOptions& options) {
    Plan plan = whole;
    plan.boxes = boxes;
    const int first = first_in_boxes(plan, ask);
    if (first + 1 >= static_cast<int>(plan.steps.size())) return {};
    const Between added = between(plan, ask, first);
    return with_between(whole, ask, boxes, options, &added);
}

std::optional<Plan> fewest_boxes(const Plan& whole, const Ask& ask, const PlanOptions& options) {
    // Even if nothing lay between the steps.
    const std::optional<Plan> least = with_between(whole, ask, kMostBoxes, options, nullptr);
    if (!least || !feasible(least->predicted, ask.want.budget)) return {};
    for (int boxes = 2; boxes <= kMostBoxes; boxes *= 2) {
        std::optional<Plan> plan = boxed(whole, ask, boxes, options);
        if (!plan || !fast_enough(plan->predicted, ask.want.budget)) return {};
        if (feasible(plan->predicted, ask.want.budget)) return plan;
    }
    return {};
}

}  // namespace edgewise
