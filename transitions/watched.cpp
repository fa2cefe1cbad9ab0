#include <algorithm>
#include <utility>

#include "transitions/catalogue.hpp"
#include "transitions/composite/binary_tree_front_to_back.hpp"
#include "transitions/composite/front_to_back.hpp"

namespace edgewise {
namespace {

/// The edges that show pictures on the way; the first is the usual one.
std::vector<Transition> showing(const FrontWatch& watch) {
    return {front_to_back_over(watch), binary_tree_front_to_back_over(watch)};
}

}  // namespace

Catalogue watched(Catalogue edges, const FrontWatch& watch) {
    for (const Transition& shows : showing(watch))
        for (std::size_t i = 0; i < edges.size(); ++i)
            if (edges[i].name == shows.name) edges[i] = shows;
    return edges;
}

Demands watched(Demands asked) {
    const std::vector<Transition> edges = showing({});
    const bool named = std::ranges::any_of(asked.via, [&](const Demand& demand) {
        return std::ranges::any_of(
            edges, [&](const Transition& edge) { return demand.name == edge.name; });
    });
    if (!named) asked.via.push_back({edges.front().name});
    return asked;
}

}  // namespace edgewise
