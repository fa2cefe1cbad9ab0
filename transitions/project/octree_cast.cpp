#include "transitions/project/octree_cast.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/picture_facts.hpp"
#include "graph/range.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/stretches.hpp"
#include "transitions/store/octree.hpp"

namespace edgewise {
namespace {

Offer offer_through_octree(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_stretches(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

/// Cells outside of leaves; of an octree without a tolerance, what differs from the commonest value
/// and a finest node around it.
double share_of_samples(const Ask& ask) {
    const auto taken = ask.scene.fact(kCastBricks), all = ask.scene.fact(kCastAll);
    if (taken && all && *all > 0) return std::clamp(*taken / *all, 0.0, 1.0);
    return std::min(1.0, 2 * ask.scene.occupied_fraction);
}

Work work_through_octree(const Offer& offer, const Ask& ask, int view) {
    constexpr double kCellsALook = 8, kNode = 8;
    Work work = work_of_stretches(offer, ask, view, share_of_samples(ask), kCellsALook);
    const double nodes = kernels::OctreeBuilder::most_nodes(offer.from.extent);
    work.operations += kNode * nodes;
    work.workspace = nodes * sizeof(kernels::OctreeStop);
    return work;
}

/// How fast opacity and colours change with the value, where leaves are crossed at once.
struct Steepest {
    double opacity = 0, color = 0;

    Steepest(const Transfer& transfer, double range) {
        const std::vector<Transfer::Point>& points = transfer.points;
        for (std::size_t i = 1; i < points.size(); ++i) {
            const double width = points[i].value - points[i - 1].value;
            const double of_opacity = std::abs(points[i].opacity - points[i - 1].opacity);
            double of_color = 0;
            for (std::size_t c = 0; c < 3; ++c)
                of_color =
                    std::max(of_color, std::abs(points[i].color[c] - points[i - 1].color[c]));
            if (std::max(of_opacity, of_color) * range > kernels::kSteepestCrossed * width)
                continue;  // sampled
            if (!(width > 0)) continue;
            opacity = std::max(opacity, of_opacity / width);
            color = std::max(color, of_color / width);
        }
    }
};

/// How far pictures are off where samples are off by 1 (RMS), and by 4 at most.
double gain_of_octree(const Offer& offer, const Ask& ask) {
    const Request& want = ask.want;
    const double longest = longest_way(offer.from, want);
    switch (want.mode->combine) {
        case Combine::max:
            return kernels::OctreeBuilder::kFarthest;
        case Combine::mean:
            return 1;
        case Combine::sum:
            return longest * want.unit;
        case Combine::over:
        case Combine::hit:
        case Combine::other:
            break;
    }
    // A change of opacity changes what is seen by no more than that, a change of colour likewise,
    // weighed by opacities whose sum is at most 1.
    const Steepest steepest(want.transfer, range_between(ask.scene.low, ask.scene.high));
    return steepest.opacity * longest * want.unit / want.transfer.unit + steepest.color;
}

Error error_through_octree(const Offer& offer, const Ask& ask) {
    Error error = cast_error(field_filter(Field::linear), offer.with.number("step"), ask);
    error.gain = std::max(error.gain, gain_of_octree(offer, ask));
    return error;
}

void run_through_octree(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                        const Region& region, Context& context) {
    constexpr std::int64_t kAtOnce = 4096;  // nodes
    const StretchRays rays(offer, ask, in, context.view);
    const auto beside = octree_of(in);
    const auto nodes = static_cast<std::int64_t>(beside->tree.nodes.size());
    kernels::OctreeStops stops{
        .tree = &beside->tree,
        .stops = std::pmr::vector<kernels::OctreeStop>(beside->tree.nodes.size(), context.memory)};
    tbb::parallel_for(std::int64_t{0}, (nodes + kAtOnce - 1) / kAtOnce, [&](std::int64_t part) {
        if (context.stopped()) return;
        kernels::see_nodes(rays.cast().rule, rays.cast().volume.values.slope < 0, rays.optics(),
                           part * kAtOnce, std::min((part + 1) * kAtOnce, nodes), stops);
    });
    context.poll();
    kernels::join_sampled(rays.cast().rule, stops);
    cast_stretches({.cast = rays.cast(), .octree = &stops}, ask.want, out, region, context);
}

}  // namespace

Transition octree_cast() {
    Transition edge;
    edge.name = "project.octree_cast";
    edge.source = "Wittenbrink 1993, FIGURE 60; Levoy 1990; Laur, Hanrahan 1991";
    edge.joins = {{fmt::format("object/{}+{}", kOctree, kOctree), "screen/picture"}};
    edge.parameters = {
        {"step", number(0.01, 4, {1}, "distance of samples, in the smallest spacing")}};
    edge.offer = offer_through_octree;
    edge.work = work_through_octree;
    edge.shared_counts = {measure_casting};
    edge.error = error_through_octree;
    edge.parts = parts_of_stretches;
    edge.run = run_through_octree;
    return edge;
}

}  // namespace edgewise
