#include "transitions/kernels/stretch_map.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/kernels/largest_opacity.hpp"

namespace edgewise::kernels {
namespace {

/// Whether opacity or colours change too fast between two stored numbers for one value to do.
bool is_steep(const Optics& optics, const OctreeNode& node, float range) {
    for (const OpticsRamp& ramp : optics.ramps) {
        const double width = 1 / static_cast<double>(ramp.inverse_width);
        if (node.high <= ramp.start || node.low >= ramp.start + width) continue;
        double change = std::abs(ramp.opacity);
        for (const float color : ramp.color)
            change = std::max(change, std::abs(static_cast<double>(color)));
        if (change * range > kSteepestCrossed * width) return true;
    }
    return false;
}

}  // namespace

void see_nodes(Combine rule, bool falls, const Optics* optics, std::int64_t begin, std::int64_t end,
               OctreeStops& stops) {
    constexpr float kNothing = -std::numeric_limits<float>::infinity();
    for (std::int64_t i = begin; i < end; ++i) {
        const OctreeNode& node = stops.tree->nodes[static_cast<std::size_t>(i)];
        OctreeStop& stop = stops.stops[static_cast<std::size_t>(i)];
        stop = {node.low > node.high ? kNothing : 0, node.child};
        if (node.low > node.high) continue;
        StoredSpan span{node.low, node.high};
        if (rule == Combine::over) {
            // Where all samples are alike no function is too steep.
            if (node.child == OctreeNode::kLeaf && node.low < node.high &&
                is_steep(*optics, node, stops.tree->range))
                stop.child = OctreeNode::kSamples;
            if (stop.child == OctreeNode::kLeaf) span = {node.mean, node.mean};
            stop.level = largest_opacity(*optics, span);
        } else if (rule == Combine::max) {
            if (node.child == OctreeNode::kLeaf) span = {node.mean, node.mean};
            stop.level = falls ? -span.low : span.high;
        }
    }
}

void join_sampled(Combine rule, OctreeStops& stops) {
    if (rule == Combine::max) return;
    const auto is_sampled = [&](std::size_t i) {
        const OctreeNode& node = stops.tree->nodes[i];
        const OctreeStop& stop = stops.stops[i];
        const bool clear = rule == Combine::over && !(stop.level > 0);
        return node.low > node.high || (stop.child == OctreeNode::kSamples && !clear);
    };
    // Children lie behind their parents.
    for (std::size_t i = stops.stops.size(); i-- > 0;) {
        OctreeStop& stop = stops.stops[i];
        if (stop.child <= 0) continue;
        bool all = true;
        for (std::size_t c = 0; c < 8; ++c)
            all = all && is_sampled(static_cast<std::size_t>(stop.child) + c);
        if (all) stop.child = OctreeNode::kSamples;
    }
}

}  // namespace edgewise::kernels
