#include "transitions/composite/binary_tree_front_to_back.hpp"

#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace edgewise {
namespace {

constexpr double kMostSlices = 1 << 20;

/// @param shown  to a watch, which wants some pictures
std::vector<std::int64_t> depths_of(const Parameters& with, std::int64_t depth, bool shown) {
    auto first = static_cast<std::int64_t>(with.number("first"));
    if (first < 1 && shown) first = 1;
    std::vector<std::int64_t> depths;
    if (first < 1) return depths;
    for (std::int64_t at = first; at < depth; at *= 2) depths.push_back(at);
    depths.push_back(depth);
    return depths;
}

}  // namespace

Transition binary_tree_front_to_back_over(FrontWatch watch) {
    const auto depths = [shown = bool(watch)](const Parameters& with, std::int64_t depth) {
        return depths_of(with, depth, shown);
    };
    Transition edge = over_edge(Compositing::tree_from_front, depths, std::move(watch));
    edge.name = "composite.binary_tree_front_to_back";
    edge.source = "Wittenbrink 1993, Appendix B, 2.5, TABLE 36 and 37";
    edge.parameters = {
        {"first", number(0, kMostSlices, {0},
                         "slices of the first picture on the way, a power of two; each "
                         "later one has twice as many; 0: none, or 1 where somebody watches")}};
    edge.offer = [offer = edge.offer](const Representation& from, const Ask& ask,
                                      const Parameters& with) {
        const double first = with.number("first");
        if (first != std::floor(first) ||
            (first > 0 && !std::has_single_bit(static_cast<std::uint64_t>(first))))
            return Offer::no(fmt::format(
                "first={}: trees that are paired from the front have 1, 2, 4, 8 ... slices",
                first));
        return offer(from, ask, with);
    };
    return edge;
}

}  // namespace edgewise
