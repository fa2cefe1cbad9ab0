#include "transitions/net/spread.hpp"

#include <fmt/format.h>

#include "graph/spread.hpp"

namespace edgewise {
namespace {

Layout layout_of(const Parameters& with) {
    return with.word("layout") == "columns" ? Layout::columns : Layout::diced;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.ranks < 2) return Offer::no("one rank: there is nothing to spread over");
    if (from.place != Place::disk) return Offer::no("the samples lie at one rank");
    const Layout layout = layout_of(with);
    const Cut cut = cut_of(layout, from.extent, from.axes, ask.want.ranks);
    for (int axis = 0; axis < 3; ++axis)
        if (cut[axis] > from.extent[axis])
            return Offer::no(
                fmt::format("{} ranks along an axis of {} samples", cut[axis], from.extent[axis]));
    // Both cut an image the same way.
    if (from.axes == 2 && layout == Layout::diced) return Offer::no("an image has columns only");
    Representation to = from;
    to.place = Place::ranks;
    to.layout = layout;
    return {.from = from, .to = std::move(to), .with = with};
}

}  // namespace

Transition spread_over_ranks() {
    Transition edge;
    edge.name = "net.spread";
    edge.source = "Wittenbrink 1993, 3.8, FIGURE 41";
    edge.joins = {{"object/scalar", "object/scalar"}};
    edge.any_transform = true;
    edge.parameters = {
        {"layout", one_of({"columns", "slice-and-dice"},
                          "how ranks share the box: all of z, or cut on every axis")}};
    edge.offer = offer;
    edge.work = [](const Offer&, const Ask&, int) { return Work{}; };
    edge.error = exact;
    edge.run = [](const Offer&, const Ask&, const Data&, Data&, const Region&, Context&) {
        throw RunError("net.spread: runs are on one rank");
    };
    return edge;
}

}  // namespace edgewise
