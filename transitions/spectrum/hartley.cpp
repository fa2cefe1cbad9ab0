#include "transitions/spectrum/hartley.hpp"

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/hartley.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

Offer hartley_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = kHartley;
    offer.to.type = Type::f32;
    offer.to.extent = kernels::HartleyShape::stored_of(spectrum_period(from));
    return offer;
}

Work hartley_work(const Offer& offer, const Ask&, int /*view*/) {
    return {.operations = static_cast<double>(offer.to.samples()),
            // Samples beyond the middle of a row come from its opposite: each is read once more.
            .streamed = 2 * offer.from.bytes() + offer.to.bytes()};
}

void run_hartley(const Offer&, const Ask&, const Data& in, Data& out, const Region&,
                 Context& context) {
    kernels::hartley_of_spectrum(kernels::grid_of(in), spectrum_period(in.what), out.as<float>(),
                                 [&] { return context.stopped(); });
    context.poll();
    const kernels::KaiserBessel window = window_of(in.what);
    out.facets[window_facet(window)] = window;
}

}  // namespace

Transition spectrum_hartley() {
    Transition edge;
    edge.name = "spectrum.hartley";
    edge.source = "Bracewell 1986; Wittenbrink 1993, 5.1, EQ 79; Malzbender 1993";
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back(spectrum_kind(window), hartley_kind(window));
    edge.on_demand = true;  // half of a complex spectrum has as many bytes, and is read once
    edge.offer = hartley_offer;
    edge.work = hartley_work;
    edge.error = exact;
    edge.run = run_hartley;
    return edge;
}

}  // namespace edgewise
