#include <algorithm>
#include <cmath>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/shade/classify.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kWidth = 128, kHeight = 4;  // pixels of a tile
constexpr int kChannels = 4;

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays() || !ask.want.mode->takes_transfer)
        return Offer::no("the mode has no transfer function");
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

Work work(const Offer& offer, const Ask&, int) {
    return {.operations = (kCorrectionOperations + 11) * static_cast<double>(offer.from.samples()) +
                          kSpanOperations * static_cast<double>(offer.to.samples()),
            .streamed = offer.from.bytes() + offer.to.bytes()};
}

/// One ray, from front to back. Samples outside low to high are none, those at its ends count for
/// what of the ray is nearest to them.
/// @param sample  of plane 0; `plane` floats from one to the next
void composite(const float* sample, std::ptrdiff_t plane, std::int64_t depth, float low, float high,
               double power, float* out) {
    double light[3] = {}, left = 1;
    const auto first = static_cast<std::int64_t>(std::max(0.0F, std::ceil(low)));
    for (std::int64_t z = first; z < depth && static_cast<float>(z) <= high; ++z) {
        const float* const at = sample + z * plane;
        const double opacity = std::clamp(static_cast<double>(at[3]), 0.0, 1.0);
        if (!(opacity > 0)) continue;
        const auto here = static_cast<float>(z);
        const float begin = here - 1 < low ? low : here - 0.5F;
        const float end = here + 1 > high ? high : here + 0.5F;
        const double caught =
            left * -std::expm1(std::log1p(-opacity) * static_cast<double>(end - begin) * power);
        for (int c = 0; c < 3; ++c) light[c] += caught * static_cast<double>(at[c]) / opacity;
        left -= caught;
        if (left < kTerminated) break;
    }
    for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(light[c]);
    out[3] = static_cast<float>(1 - left);
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const kernels::RayCast rays = rays_through_input(want, context.view);
    const std::int64_t depth = in.what.extent.z;
    const std::ptrdiff_t row = in.row(), plane = kChannels * in.what.extent.x * in.what.extent.y;
    const double power = want.unit / want.transfer.unit;
    for_tiles(region, kWidth, kHeight, context, [&](const Region& tile) {
        std::array<float, kWidth * kHeight> low, high;
        fill_spans(rays, tile, kWidth, low.data(), high.data());
        for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y)
            for (std::int64_t x = tile.begin[0]; x < tile.end[0]; ++x) {
                const auto i =
                    static_cast<std::size_t>((y - tile.begin[1]) * kWidth + x - tile.begin[0]);
                composite(in.as<float>() + y * row + kChannels * x, plane, depth, low[i], high[i],
                          power, out.at<float>(x, y, 0));
            }
    });
}

}  // namespace

Transition composite_colored() {
    Transition edge;
    edge.name = "project.composite_colored";
    edge.source = "Wittenbrink 1993, FIGURE 57, EQ 62 and 63";
    edge.joins = {{"screen/colored", "screen/picture"}};
    edge.offer = offer;
    edge.work = work;
    edge.error = [](const Offer&, const Ask&) -> Error { return {}; };
    edge.run = run;
    return edge;
}

}  // namespace edgewise
