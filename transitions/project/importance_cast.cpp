#include "transitions/project/importance_cast.hpp"

#include <memory>
#include <optional>

#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/importance_cast.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

/// The edge whose steps are equal.
Transition equal_cast() { return ray_cast(); }

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (want.mode->combine != Combine::over)
        return Offer::no("nothing hides what lies behind it: all samples of a ray count alike");
    if (want.shading.on()) return Offer::no("light differs from sample to sample, not by opacity");
    if (want.cue) return Offer::no("light falls off along rays: far samples count less anyhow");
    if (want.transfer.needs_gradients())
        return Offer::no("opacities need gradients, which differ within a long step");
    if (is_spread(from)) return Offer::no("over ranks: what is left of a ray is known in order");
    return equal_cast().offer(from, ask, with);
}

Work work(const Offer& offer, const Ask& ask, int view) {
    constexpr double kOwnPace = 25;
    Work work = equal_cast().work(offer, ask, view);
    const double taps = filter_named(offer.with.word("filter")).taps;
    // Bricks are always made, and an f32 a brick of 4^3 samples is kept.
    const auto voxels = static_cast<double>(offer.from.samples());
    work.operations += kOwnPace * work.gathers / (taps * taps * taps) +
                       (4 + 6 * static_cast<double>(bytes_of(offer.from.type))) * voxels;
    work.workspace += 2 * 4 * voxels / 64 + 8192;
    work.variant = "importance";
    return work;
}

/// A picture is one region: it is cut into tiles inside, which share the bricks.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const Filter& filter = filter_named(offer.with.word("filter"));
    const kernels::Optics optics = optics_of(want, in.what.values);
    const std::optional<kernels::Kept> kept = kept_of(in.what, want, context.view);
    kernels::RayCast cast{.volume = rule_grid(in, want),
                          .hold = kernels::hold_of(filter),
                          .rule = want.mode->combine,
                          .rays = rays_of(in.what, want, context.view, -0.5),
                          .kept = kept ? &*kept : nullptr,
                          .step = offer.with.number("step"),
                          .unit = want.unit,
                          .optics = &optics,
                          .bound = kTerminated};
    const auto bricks = bricks_beside(
        in, cast.volume, {.optics = &optics, .overshoot = kernels::overshoot_of(filter, 3)},
        context.memory, [&] { return context.stopped(); });
    context.poll();
    cast.bricks = bricks.get();
    const double loss = offer.with.number("loss");
    const std::int64_t row = out.row();
    constexpr std::int64_t kTile = 32;
    for_tiles(region, kTile, kTile, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        kernels::importance_cast(cast, loss, tile.begin[0], tile.begin[1], size.x, size.y,
                                 out.at<float>(tile.begin[0], tile.begin[1], 0), row);
    });
}

}  // namespace

Transition importance_cast() {
    Transition edge;
    edge.name = "project.importance_cast";
    edge.source = "Danskin and Hanrahan 1992";
    edge.joins = equal_cast().joins;
    edge.parameters = {
        {"filter", one_of({"foh", "bspline3"}, "what reads the samples")},
        {"step", number(0.01, 4, {1}, "least distance of samples, in the smallest spacing")},
        {"loss", number(0, 0.25, {0.0625},
                        "what a ray may lose at most, and the transparency from which on steps "
                        "grow")}};
    edge.on_demand = true;  // its error is measured by runs
    edge.offer = offer;
    edge.work = work;
    edge.shared_counts = {measure_casting};
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
