#include "transitions/project/distance_cast.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/picture_facts.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/kernels/sorted_mip.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/stretches.hpp"

namespace edgewise {
namespace {

Offer offer_leaps(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_stretches(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (ask.want.mode->skips == ModeTraits::Levels::none)
        return Offer::no(fmt::format("mode {} needs all samples of a ray", ask.want.mode->name));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

double bytes_of_bricks(const Representation& from) {
    constexpr double kBrick = 64, kBytes = 2 * sizeof(float) + 1;
    return kBytes * 1.1 * static_cast<double>(from.samples()) / kBrick + 4096;
}

Work work_leaps(const Offer& offer, const Ask& ask, int view) {
    constexpr double kCellsALook = 12, kBrick = 64, kPasses = 30;
    const auto taken = ask.scene.fact(kCastBricks), all = ask.scene.fact(kCastAll);
    const double share = taken && all && *all > 0 ? std::clamp(*taken / *all, 0.0, 1.0)
                                                  : std::min(1.0, 2 * ask.scene.occupied_fraction);
    Work work = work_of_stretches(offer, ask, view, share, kCellsALook);
    const double samples = static_cast<double>(offer.from.samples());
    work.operations += (4 + 6 * static_cast<double>(bytes_of(offer.from.type))) * samples +
                       kPasses * samples / kBrick;
    work.streamed += offer.from.bytes();
    work.workspace = bytes_of_bricks(offer.from);
    return work;
}

Error error_leaps(const Offer& offer, const Ask& ask) {
    return cast_error(field_filter(Field::linear), offer.with.number("step"), ask);
}

/// What every ray that meets the volume has at least; -inf: it may have nothing.
float least_of_all(const kernels::Grid& volume, const Ask& ask, Context& context) {
    constexpr float kNoLeast = -std::numeric_limits<float>::infinity();
    if (!is_integer(volume.type) && (volume.type != Type::f32 || ask.scene.non_finite > 0))
        return kNoLeast;
    const Extent n = kernels::sorted_bricks_in(volume.extent);
    std::pmr::vector<kernels::SortedBrick> bricks(static_cast<std::size_t>(n.samples()),
                                                  context.memory);
    std::pmr::vector<float> least(static_cast<std::size_t>(n.z), kNoLeast, context.memory);
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t layer) {
        if (!context.stopped())
            least[static_cast<std::size_t>(layer)] =
                kernels::bound_bricks(volume, {}, layer, layer + 1, bricks, context.memory);
    });
    context.poll();
    return *std::min_element(least.begin(), least.end());
}

void run_leaps(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
               Context& context) {
    const StretchRays rays(offer, ask, in, context.view);
    const kernels::Grid& volume = rays.cast().volume;
    const auto bricks = bricks_beside(in, volume, {.optics = rays.optics()}, context.memory,
                                      [&] { return context.stopped(); });
    context.poll();
    const float least = rays.optics() ? 0 : least_of_all(volume, ask, context);
    const kernels::BrickDistances distances(
        *bricks, least, static_cast<int>(offer.with.number("leap")), context.memory);
    cast_stretches({.cast = rays.cast(), .bricks = &distances}, ask.want, out, region, context);
}

}  // namespace

Transition distance_cast() {
    constexpr double kMost = kernels::BrickDistances::kMost;
    Transition edge;
    edge.name = "project.distance_cast";
    edge.source = "Cohen, Sheffer 1994; Zuiderveld, Koning, Viergever 1992";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"step", number(0.01, 4, {1}, "distance of samples, in the smallest spacing")},
        {"leap", number(1, kMost, {kMost}, "bricks at most to the nearest one that matters")}};
    edge.on_demand = true;  // min-max bricks and whole packets of rays take less
    edge.offer = offer_leaps;
    edge.work = work_leaps;
    edge.shared_counts = {measure_casting};
    edge.error = error_leaps;
    edge.parts = parts_of_stretches;
    edge.run = run_leaps;
    return edge;
}

}  // namespace edgewise
