#include "graph/plan.hpp"

#include <algorithm>

namespace edgewise {

int first_in_boxes(const Plan& plan, const Ask& ask) {
    int first = static_cast<int>(plan.steps.size()) - 1;
    if (plan.boxes <= 1) return first;
    for (int step = first; step >= 0; --step) {
        const Step& at = plan.steps[step];
        const Partition parts = at.by->parts(at.offer, ask);
        if (parts.kind != Partition::output || !parts.reads ||
            at.offer.to.runs() != plan.steps.back().offer.to.runs())
            break;
        first = step;
    }
    return first;
}

std::vector<Region> boxes_read(const Plan& plan, const Ask& ask, int first, const Region& region,
                               int view) {
    std::vector<Region> boxes{region};
    for (int step = static_cast<int>(plan.steps.size()) - 1; step > first; --step) {
        const Step& at = plan.steps[step];
        Region read = at.by->parts(at.offer, ask).reads(boxes.back(), view);
        // A region that needs nothing: one sample, since a box of none means all.
        if (read.empty()) read = {{0, 0, 0}, {1, 1, 1}};
        boxes.push_back(read);
    }
    std::reverse(boxes.begin(), boxes.end());
    return boxes;
}

}  // namespace edgewise
