#include <algorithm>
#include <utility>

#include "transitions/catalogue.hpp"
#include "transitions/composite/binary_tree_front_to_back.hpp"
#include "transitions/composite/front_to_back.hpp"
#include "transitions/project/front_cast.hpp"

namespace edgewise {
namespace {

/// The edges that show pictures on the way. Trees take fewer pictures than asked for, so they are
/// left to demands.
std::vector<Transition> showing(const FrontWatch& watch) {
    std::vector<Transition> edges{front_cast(watch), front_to_back_over(watch),
                                  binary_tree_front_to_back_over(watch)};
    for (Transition& edge : edges) edge.on_demand = edge.name == edges.back().name;
    return edges;
}

/// Other edges that make pictures refuse to.
void show_nothing(Transition& edge) {
    const bool pictures = std::ranges::any_of(
        edge.joins, [](const auto& join) { return join.second == "screen/picture"; });
    if (!pictures) return;
    edge.offer = [](const Representation&, const Ask&, const Parameters&) {
        return Offer::no("shows no pictures on the way");
    };
}

}  // namespace

Catalogue watched(Catalogue edges, const FrontWatch& watch) {
    const std::vector<Transition> shown = showing(watch);
    for (std::size_t i = 0; i < edges.size(); ++i) {
        Transition& edge = edges[i];
        const auto shows = std::ranges::find(shown, edge.name, &Transition::name);
        if (shows == shown.end()) {
            show_nothing(edge);
            continue;
        }
        edge = *shows;
    }
    return edges;
}

}  // namespace edgewise
