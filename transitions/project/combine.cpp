#include "transitions/project/combine.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/spread.hpp"
#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/combine_model.hpp"
#include "transitions/project/parallel_product.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kWidth = 256, kHeight = 8;  // of a tile: its states stay in the caches

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_combining(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

double tile_bytes(Mode mode) {
    const int planes = kernels::PixelStates::planes(mode->combine, mode->rule) + 2;
    return planes * kWidth * kHeight * 4.0 + 2 * kArraySlack;
}

/// Spread over ranks as in the thesis: the samples lie along z already, one beside the other.
Work spread_work(const Offer& offer, const Ask& ask) {
    const kernels::Optics optics = optics_of(ask.want, offer.from.values);
    double rule = ask.want.mode->operations;
    // TABLE 36 and 37, front to back: 3 a colour, 2 of transparency.
    if (ask.want.mode->takes_transfer)
        rule = static_cast<double>(optics.ramps.size()) * (optics.grey ? 8 : 12) + 3 * 3 + 2;
    Work work{.operations = rule * static_cast<double>(offer.from.samples()),
              .streamed = offer.from.bytes() + offer.to.bytes()};
    const Cut cut = cut_of(offer.from.layout, offer.from.extent, 3, ask.want.ranks);
    add_parallel_product(work, ask.want.mode, cut, static_cast<double>(offer.to.samples()));
    return work;
}

Work work(const Offer& offer, const Ask& ask, int) {
    if (is_spread(offer.from)) return spread_work(offer, ask);
    const double rule = combining_operations(ask.want, offer.from.values);
    return {.operations = rule * static_cast<double>(offer.from.samples()) +
                          kSpanOperations * static_cast<double>(offer.to.samples()),
            .streamed = offer.from.bytes() + offer.to.bytes(),
            .scratch = tile_bytes(ask.want.mode)};
}

Error error(const Offer&, const Ask& ask) { return combined_error(ask); }

Partition parts(const Offer& offer, const Ask& ask) {
    const Extent& to = offer.to.extent;
    return {.kind = Partition::output,
            .leaf = {to.x, std::min<std::int64_t>(to.y, 4 * kHeight), 1},
            .reads = [depth = ask.want.screen.z](const Region& out, int) {
                Region in = out;
                in.begin[2] = 0;
                in.end[2] = depth;
                return in;
            }};
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const kernels::Optics optics = optics_of(want, in.what.values);
    const kernels::Combining with = combining_of(want, in.what.values, optics);
    const kernels::RayCast rays = rays_through_input(want, context.view);
    const std::int64_t row = out.row();
    const kernels::Grid volume = kernels::grid_of(in);
    for_tiles(region, kWidth, kHeight, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        const std::ptrdiff_t plane = kWidth * kHeight;
        Array scratch(static_cast<std::size_t>(tile_bytes(want.mode)), context.memory);
        float* low = static_cast<float*>(scratch.data());
        const kernels::PixelStates states{low + 2 * plane, kWidth, plane};
        fill_spans(rays, tile, kWidth, low, low + plane);
        kernels::clear_states(with, states, size.x, size.y);
        kernels::combine(with, volume, tile.begin[0], tile.begin[1], size.x, size.y, 0,
                         in.what.extent.z, {low, low + plane, kWidth}, states);
        float* first = out.at<float>(tile.begin[0], tile.begin[1], 0);
        kernels::finish_states(with, states, size.x, size.y, first, row);
        give_sign(want, first, size.x, size.y, row);
    });
}

}  // namespace

std::string no_combining(const Representation& from, const Ask& ask) {
    if (ask.want.eye) return "the eye is at a finite distance: rays are not parallel";
    if (std::string reason = no_picture(from, ask); !reason.empty()) return reason;
    if (std::string reason = no_slices(ask.want); !reason.empty()) return reason;
    if (ask.scene.non_finite > 0)
        return fmt::format(
            "{} samples are not finite: rays would miss all that was interpolated from them",
            ask.scene.non_finite);
    return {};
}

double combining_operations(const Request& want, const ValueMap& values) {
    const kernels::Optics optics = optics_of(want, values);
    double rule = 4 + want.mode->operations;
    if (want.mode->takes_transfer)
        rule += static_cast<double>(optics.ramps.size()) * (optics.grey ? 8 : 12) + 10;
    return rule;
}

Transition combine() {
    Transition edge;
    edge.name = "project.combine";
    edge.source = "Wittenbrink 1993, 4.1.3, EQ 62 and 63";
    edge.joins = {{"screen/scalar", "screen/picture"}};
    edge.laws = {Law::constant};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = combine_model;
    edge.derives = add_combined_from;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] { return picture_trials(); };
    edge.factors = {{"", 1.4}};
    return edge;
}

}  // namespace edgewise
