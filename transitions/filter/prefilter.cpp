#include "transitions/filter/prefilter.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/spline_prefilter.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.field == Field::nearest)
        return Offer::no("labels have no values between them, so no spline runs through them");
    if (from.type == Type::c64) return Offer::no("complex samples have no spline here");
    if (from.layout != Layout::linear || from.place != Place::memory)
        return Offer::no("the recursion needs whole rows, columns and slices in memory");
    if (ask.scene.non_finite > 0)
        return Offer::no(fmt::format(
            "{} samples are not finite, and the recursion would carry them through the whole input",
            ask.scene.non_finite));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "coefficients";
    offer.to.drop_facets();
    offer.to.type = Type::f32;
    offer.to.values = {};
    return offer;
}

int filtered_axes(const Extent& extent) {
    return int(extent.x > 1) + int(extent.y > 1) + int(extent.z > 1);
}

Work work(const Offer& offer, const Ask&, int /*view*/) {
    const double n = static_cast<double>(offer.to.samples()) * offer.to.channels;
    const int axes = filtered_axes(offer.to.extent);
    const double f32 = 4;                      // bytes
    return {.operations = n * (2 + 5 * axes),  // the value map, then Unser's box 2
                                               // Rows stay in the cache between the two recursions;
                                               // columns do not, and are read and written by each.
            .streamed =
                offer.from.bytes() + f32 * n + 2 * f32 * n + 4 * f32 * n * std::max(axes - 1, 0)};
}

Error error(const Offer&, const Ask& ask) {
    // Gains are those of the samples that the coefficients stand for. 2^-24 is half a unit in the
    // last place; the recursions amplify it by less than the sum of |pole|^k, 1.4, an axis.
    const double greatest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high));
    return {.noise = 2 * 0x1p-24 * greatest, .copies = true};
}

/// Stored numbers to mapped values in f32.
void map_values(const Data& in, Data& out, const Context& context) {
    const kernels::ScalarLoad load = kernels::scalar_load(in.what.type);
    const ValueMap values = in.what.values;
    const std::int64_t n = in.what.samples() * in.what.channels;
    constexpr std::int64_t kGrain = 1 << 16;
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, kGrain), [&](const auto& part) {
        if (context.stopped()) return;
        float* to = out.as<float>();
        const void* from = in.samples.data();
        for (std::int64_t i = part.begin(); i < part.end(); ++i)
            to[i] = static_cast<float>(values(static_cast<double>(load(from, i))));
    });
}

void run(const Offer&, const Ask&, const Data& in, Data& out, const Region&, Context& context) {
    map_values(in, out, context);
    context.poll();
    kernels::spline_prefilter(out.as<float>(), in.what.extent, in.what.channels);
    context.poll();
}

}  // namespace

Transition spline_prefilter_edge() {
    Transition edge;
    edge.name = "filter.prefilter";
    edge.source = "Unser 1999, boxes 1 and 2";
    edge.joins = {{"object/scalar", "object/coefficients"}};
    edge.laws = {Law::constant, Law::linear};
    edge.any_transform = true;
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials();
        join(all, warp_trials());
        return all;
    };
    edge.factors = {{"", 1.1}};
    return edge;
}

}  // namespace edgewise
