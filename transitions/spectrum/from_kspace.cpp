#include "transitions/spectrum/from_kspace.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "transitions/kernels/kspace.hpp"

namespace edgewise {
namespace {

Offer kspace_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (from.type != Type::c64 || from.channels != 1 || from.layout != Layout::linear ||
        from.place != Place::memory)
        return Offer::no("k-space is one channel of complex samples, whole in memory");
    if (ask.scene.non_finite > 0)
        return Offer::no(
            fmt::format("{} samples are not finite, a transform would spread them everywhere",
                        ask.scene.non_finite));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "scalar";
    offer.to.drop_facets();
    offer.to.shares = false;
    offer.to.type = Type::f32;
    offer.to.values = {};
    return offer;
}

Work kspace_work(const Offer& offer, const Ask&, int /*view*/) {
    const Extent& n = offer.from.extent;
    return {.operations = kernels::kspace_operations(n),
            .streamed = 7 * offer.from.bytes() + offer.to.bytes(),
            .scratch = kernels::kspace_scratch(n),
            .workspace = offer.from.bytes()};
}

Error kspace_error(const Offer&, const Ask& ask) {
    // Some ten roundings, of numbers as large as the volume's.
    constexpr double kRoundings = 10 * 0x1p-24;
    return {.noise = kRoundings * std::max(std::abs(ask.scene.low), std::abs(ask.scene.high))};
}

void kspace_run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                Context& context) {
    kernels::volume_of_kspace(in.as<kernels::Complex>(), in.what.extent,
                              offer.with.word("part") == "magnitude", out.as<float>(),
                              context.memory, [&] { return context.stopped(); });
    context.poll();
}

}  // namespace

Transition spectrum_from_kspace() {
    Transition edge;
    edge.name = "spectrum.from_kspace";
    edge.source = "Wittenbrink 1993, 5.2; counts of FFTW's manual";
    edge.joins = {{"object/kspace", "object/scalar"}};
    edge.parameters = {{"part", one_of({"magnitude", "real"}, {std::string("magnitude")},
                                       "what a complex voxel becomes")}};
    edge.offer = kspace_offer;
    edge.work = kspace_work;
    edge.error = kspace_error;
    edge.run = kspace_run;
    return edge;
}

}  // namespace edgewise
