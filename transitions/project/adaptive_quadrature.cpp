#include "transitions/project/adaptive_quadrature.hpp"

#include <algorithm>
#include <optional>
#include <tbb/parallel_for.h>

#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/kernels/adaptive_quadrature.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

/// What the cast of equal steps is asked in place of this edge.
Parameters equal_steps() { return {{"filter", field_filter(Field::linear).name}, {"step", 1.0}}; }

Offer offer_quadrature(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (want.mode->combine != Combine::over)
        return Offer::no(
            "only composites are integrated to a tolerance: their terms lie in 0 to 1");
    if (want.shading.on()) return Offer::no("light has no bound between samples");
    if (want.cue) return Offer::no("light that falls off along rays has no bound here");
    if (want.transfer.needs_gradients())
        return Offer::no("opacities need gradients, which have no bound between samples");
    if (is_spread(from)) return Offer::no("over ranks: a tolerance is spent in order of a ray");
    Offer offer = ray_cast().offer(from, ask, equal_steps());
    offer.with = with;
    return offer;
}

/// Nodes, of which the smallest are nearly all.
double bytes_of_ranges(const Representation& from) {
    return sizeof(kernels::ValueRanges::Range) * 1.2 * static_cast<double>(from.samples()) / 64 +
           4096;
}

Work work_quadrature(const Offer& offer, const Ask& ask, int view) {
    // Ranges read two samples a sample, one by one. A ray takes 200, a node 60, a cell 300. A
    // vector of others holds eight: operations are counted as if in vectors.
    constexpr double kLanes = 8, kRange = 6, kRay = 200, kNode = 60, kCell = 300;
    const auto taken = ask.scene.fact(kCastBricks), all = ask.scene.fact(kCastAll);
    const double share = taken && all && *all > 0 ? std::clamp(*taken / *all, 0.0, 1.0)
                                                  : std::min(1.0, 2 * ask.scene.occupied_fraction);
    const double pixels = static_cast<double>(offer.to.samples());
    const double voxels = static_cast<double>(offer.from.samples());
    // A line through cubes meets 1.5 a side's length on average.
    const double cells = 1.5 * pixels * mean_length(offer.from, ask.want, view);
    return {.operations = kLanes * (kRange * voxels + kRay * pixels + kNode * cells / 4 +
                                    kCell * share * cells),
            .streamed = offer.from.bytes() + offer.to.bytes(),
            .gathers = 8 * share * cells,
            .workspace = bytes_of_ranges(offer.from),
            .variant = "quadrature"};
}

/// A picture is one region: it is cut into tiles inside, which share the ranges.
Partition parts_quadrature(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run_quadrature(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                    const Region& region, Context& context) {
    const Request& want = ask.want;
    const std::optional<kernels::Kept> kept = kept_of(in.what, want, context.view);
    const kernels::RayCast cast{.volume = rule_grid(in, want),
                                .rule = want.mode->combine,
                                .rays = rays_of(in.what, want, context.view, -0.5),
                                .kept = kept ? &*kept : nullptr,
                                .unit = want.unit};
    const kernels::TransferPieces transfer(optics_of(want, in.what.values));
    kernels::ValueRanges ranges(cast.volume.extent, context.memory);
    tbb::parallel_for(std::int64_t{0}, ranges.extent[0].z, [&](std::int64_t layer) {
        if (!context.stopped()) kernels::range_layer(cast.volume, layer, ranges);
    });
    context.poll();
    kernels::join_ranges(ranges);
    const kernels::AdaptiveQuadrature by{.cast = cast,
                                         .transfer = transfer,
                                         .ranges = ranges,
                                         .tolerance = offer.with.number("tolerance"),
                                         .least = offer.with.number("least")};
    const std::int64_t row = out.row();
    constexpr std::int64_t kPixels = 16;  // of a tile, along each side
    for_tiles(region, kPixels, kPixels, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        kernels::adaptive_quadrature(by, tile.begin[0], tile.begin[1], size.x, size.y,
                                     out.at<float>(tile.begin[0], tile.begin[1], 0), row);
    });
}

}  // namespace

Transition adaptive_quadrature() {
    Transition edge;
    edge.name = "project.adaptive_quadrature";
    edge.source = "Novins and Arvo 1992; Trefethen 2013, theorem 19.3";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"tolerance", number(1e-6, 0.1, {1e-3}, "what a channel of 0 to 1 may err at most")},
        {"least", number(1e-9, 0.1, {1e-6},
                         "pieces no longer than this are not halved, in the smallest spacing")}};
    edge.on_demand = true;  // its error is measured by runs
    edge.offer = offer_quadrature;
    edge.work = work_quadrature;
    edge.shared_counts = {measure_casting};
    edge.parts = parts_quadrature;
    edge.run = run_quadrature;
    return edge;
}

}  // namespace edgewise
