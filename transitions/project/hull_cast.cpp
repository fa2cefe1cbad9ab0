#include "transitions/project/hull_cast.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fmt/format.h>
#include <memory>

#include "graph/picture_facts.hpp"
#include "graph/ray_rule.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/slab_hull.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/cast_by.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

Offer offer_in_hull(const Representation& from, const Ask& ask, const Parameters& with) {
    const ModeTraits& mode = *ask.want.mode;
    if (mode.combine != Combine::over && mode.combine != Combine::hit)
        return Offer::no(fmt::format("mode {} takes samples that show nothing too", mode.name));
    if (is_spread(from)) return Offer::no("over ranks: each has a box, not what all have");
    return ray_cast().offer(from, ask, with);
}

Work work_in_hull(const Offer& offer, const Ask& ask, int view) {
    constexpr double kPlanes = 26, kPlane = 12, kBrick = 64;
    Work work = ray_cast().work(offer, ask, view);
    const auto voxels = static_cast<double>(offer.from.samples());
    // A hull holds more samples than its bricks and fewer than the volume. Nobody has counted, so
    // the mean of both is a guess. Where the cast asks bricks as well, the hull saves nothing more.
    const auto bricks = ask.scene.fact(kCastBricks), all = ask.scene.fact(kCastTaken);
    const double step = offer.with.number("step");
    const double taken =
        samples_taken(offer, ask, view) * step / static_cast<double>(offer.to.samples());
    if (bricks && all && *all > 0 && taken > (1 + 1e-9) * *bricks) {
        const double share = (1 + std::clamp(*bricks / *all, 0.0, 1.0)) / 2;
        work.operations *= share;
        work.gathers *= share;
    }
    work.operations += (4 + 6 * static_cast<double>(bytes_of(offer.from.type))) * voxels +
                       8 * voxels / kBrick +
                       kPlanes * kPlane * static_cast<double>(offer.to.samples());
    work.streamed += offer.from.bytes();
    work.workspace += 2 * sizeof(float) * 1.1 * voxels / kBrick + 8192;
    work.variant = "hull";
    return work;
}

/// A picture is one region: it is cut into tiles inside, which share the hull.
Partition parts_in_hull(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

/// The hull of the visible bricks.
kernels::SlabHull hull_of_seen(const kernels::RayCast& cast, const Filter& filter,
                               Context& context) {
    const bool over = cast.rule == Combine::over;
    std::shared_ptr<const kernels::Bricks> own;
    if (!cast.bricks) {
        own = bricks_of(cast.volume,
                        {.optics = over && !cast.table ? cast.optics : nullptr,
                         .overshoot = kernels::overshoot_of(filter, 3),
                         .table = over ? cast.table : nullptr},
                        context.memory, [&] { return context.stopped(); });
        context.poll();
    }
    const kernels::Bricks& bricks = own ? *own : *cast.bricks;
    if (over) return kernels::hull_of(bricks, cast.volume.extent, 0, true);
    const float level =
        RayRule::Setting{.values = cast.volume.values, .level = cast.level}.stored_level();
    return kernels::hull_of(bricks, cast.volume.extent,
                            cast.volume.values.slope < 0 ? -level : level, false);
}

void run_in_hull(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                 const Region& region, Context& context) {
    constexpr std::int64_t kPixels = 32;  // of a tile, along each side
    const auto from_hull = [&](const kernels::RayCast& whole) {
        const Filter& filter = filter_named(offer.with.word("filter"));
        const kernels::SlabHull hull = hull_of_seen(whole, filter, context);
        // A little more than whole cells, for rounding. A level knows of samples as far as a
        // brick's side; some filters reach farther.
        const double cells = whole.rule == Combine::over ? 1.01 : 2.01;
        const double beyond =
            std::max(0.0, filter.taps / 2.0 - (1 << kernels::Bricks::kShift)) + 1e-3;
        auto wider = kernels::strides_along_normals(whole);
        for (std::size_t i = 0; i < wider.size(); ++i) {
            const std::array<int, 3>& n = kernels::SlabHull::kNormal[i];
            wider[i] =
                cells * wider[i] + beyond * (std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]));
        }
        const kernels::Kept kept = kernels::kept_in(hull, whole, wider);
        kernels::RayCast cast = whole;
        cast.kept = &kept;
        const std::int64_t row = out.row();
        for_tiles(region, kPixels, kPixels, context, [&](const Region& tile) {
            const Extent size = tile.extent();
            float* const first = out.at<float>(tile.begin[0], tile.begin[1], 0);
            kernels::ray_cast(cast, tile.begin[0], tile.begin[1], size.x, size.y, first, row);
            give_sign(ask.want, first, size.x, size.y, row);
        });
    };
    cast_by({.region = from_hull}, offer, ask, in, out, region, context);
}

}  // namespace

Transition hull_cast() {
    Transition edge = ray_cast();
    edge.name = "project.hull_cast";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "Avila, Sobierajski, Kaufman 1992; Kay, Kajiya 1986; Klosowski and others 1998";
    edge.on_demand = true;  // bricks leave out more where they are asked
    edge.laws.clear();
    edge.plain.reset();
    edge.offer = offer_in_hull;
    edge.work = work_in_hull;
    edge.parts = parts_in_hull;
    edge.run = run_in_hull;
    edge.model = {};
    return edge;
}

}  // namespace edgewise
