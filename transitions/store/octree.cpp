#include "transitions/store/octree.hpp"

#include <algorithm>
#include <any>
#include <fmt/format.h>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/range.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"

namespace edgewise {
namespace {

Offer offer_octree(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays()) return Offer::no("the result is a volume, not a picture");
    if (from.axes != 3) return Offer::no("an image has no depth to look through");
    if (from.channels != 1)
        return Offer::no(fmt::format("{} channels; rays combine one", from.channels));
    if (from.type == Type::c64) return Offer::no("complex samples have no mean along a ray");
    if (ask.want.field == Field::nearest) return Offer::no("labels have no mean");
    if (!is_whole(from)) return Offer::no("needs all samples in memory, row by row");
    const double most = kernels::OctreeBuilder::most_nodes(from.extent);
    if (most > std::numeric_limits<std::int32_t>::max())
        return Offer::no(fmt::format("{:.3g} nodes; places of nodes have 31 bits", most));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = kOctree;
    offer.to.facets.insert(kOctree);
    offer.to.facet_bytes += most * sizeof(kernels::OctreeNode);
    return offer;
}

Work work_octree(const Offer& offer, const Ask&, int) {
    constexpr double kAgain = 25.0 / 16;  // rows on faces of nodes
    const double samples = static_cast<double>(offer.from.samples());
    const double sums = offer.with.number("tolerance") > 0 ? 5 : 0;
    return {.operations = kAgain * (3 + sums) * samples,
            .streamed = kAgain * offer.from.bytes(),
            .workspace = kernels::OctreeBuilder::scratch(offer.from.extent)};
}

Error error_octree(const Offer& offer, const Ask& ask) {
    const double tolerance = offer.with.number("tolerance");
    if (tolerance == 0) return {.copies = true};
    return {.bias = tolerance * range_between(ask.scene.low, ask.scene.high)};
}

void run_octree(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                Context& context) {
    kernels::OctreeBuilder builder(kernels::grid_of(in), offer.with.number("tolerance"),
                                   context.memory);
    const auto in_parallel = [&](std::int64_t count, const auto& make) {
        tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t layer) {
            if (!context.stopped()) make(layer, layer + 1);
        });
        context.poll();
    };
    in_parallel(builder.extent(0).z, [&](auto begin, auto end) { builder.sum_layers(begin, end); });
    builder.find_range();
    for (int level = 0; level < builder.levels(); ++level)
        in_parallel(builder.extent(level).z,
                    [&](auto begin, auto end) { builder.join_layers(level, begin, end); });
    auto made = std::make_shared<OctreeBeside>();
    const std::size_t count = builder.count();
    made->room = Array(count * sizeof(kernels::OctreeNode), context.memory);
    made->tree = builder.write({static_cast<kernels::OctreeNode*>(made->room.data()), count});
    out.facets[kOctree] = std::shared_ptr<const OctreeBeside>(made);
}

}  // namespace

std::shared_ptr<const OctreeBeside> octree_of(const Data& data) {
    return std::any_cast<std::shared_ptr<const OctreeBeside>>(data.facets.at(kOctree));
}

Transition octree() {
    Transition edge;
    edge.name = "store.octree";
    edge.source = "Wittenbrink 1993, FIGURE 60; Levoy 1990; Laur, Hanrahan 1991";
    edge.joins = {{"object/scalar", fmt::format("object/{}+{}", kOctree, kOctree)}};
    edge.parameters = {
        {"tolerance", number(0, 1, {0, 0.01},
                             "standard deviation of a leaf at most, share of the data's range")}};
    edge.attaches = true;
    edge.on_demand =
        true;  // rays in packets with min-max bricks take less, see project.octree_cast
    edge.offer = offer_octree;
    edge.work = work_octree;
    edge.error = error_octree;
    edge.run = run_octree;
    return edge;
}

}  // namespace edgewise
