#include "transitions/composite/classify.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "graph/spread.hpp"
#include "transitions/kernels/classified.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/counts.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kTileWidth = 256, kTileHeight = 8;

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.mode->combine != Combine::over)
        return Offer::no(
            fmt::format("{}: nobody reads light and transparency of samples", ask.want.mode->name));
    if (std::string reason = no_combining(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (!is_whole(from)) return Offer::no("samples are spread over ranks; this needs all of them");
    return {.from = from, .to = screen_classified(from, ask.want), .with = with};
}

constexpr std::size_t kSpanBytes = 2 * kTileWidth * kTileHeight * sizeof(float) + kArraySlack;

Work work(const Offer& offer, const Ask& ask, int) {
    // EQ 83 of each colour, EQ 88; the last transparency too, for the opacity of the picture.
    const auto depth = static_cast<int>(offer.to.extent.z);
    const double pixels = static_cast<double>(ask.want.output().samples());
    const double initial = initial_counts(depth, kColors).sum() + 1;
    return {.operations = combining_operations(ask.want, offer.from.values) *
                              static_cast<double>(offer.from.samples()) +
                          (initial + kSpanOperations) * pixels,
            .streamed = offer.from.bytes() + offer.to.bytes(),
            .scratch = static_cast<double>(kSpanBytes)};
}

Error error(const Offer&, const Ask&) { return {}; }

Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output,
            .leaf = {offer.to.extent.x, std::min<std::int64_t>(offer.to.extent.y, 8 * kTileHeight),
                     offer.to.extent.z},
            .reads = [](const Region& out, int) { return out; }};
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const kernels::Optics optics = optics_of(want, in.what.values);
    const kernels::Combining with = combining_of(want, in.what.values, optics);
    const kernels::RayCast rays = rays_through_input(want, context.view);
    const kernels::Grid volume = kernels::grid_of(in);
    for_tiles(region, kTileWidth, kTileHeight, context, [&](const Region& tile) {
        Array scratch(kSpanBytes, context.memory);
        float* low = static_cast<float*>(scratch.data());
        float* high = low + kTileWidth * kTileHeight;
        fill_spans(rays, tile, kTileWidth, low, high);
        for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z) {
            if (context.stopped()) return;
            for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y) {
                const std::int64_t spans = (y - tile.begin[1]) * kTileWidth;
                kernels::classify_row(with, volume, tile.begin[0], y, z, tile.extent().x,
                                      low + spans, high + spans,
                                      out.at<float>(tile.begin[0], y, z));
            }
        }
    });
}

}  // namespace

Representation screen_classified(const Representation& from, const Request& want) {
    Representation to = screen_scalar(from, want);
    to.content = "classified";
    to.channels = kernels::kClassified;
    return to;
}

Transition classify() {
    Transition edge;
    edge.name = "composite.classify";
    edge.source = "Wittenbrink 1993, Appendix B, EQ 83 and 88";
    edge.joins = {{"screen/scalar", "screen/classified"}};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.factors = {{"", 1.4}};  // a guess: as project.combine, whose loop it shares
    return edge;
}

}  // namespace edgewise
