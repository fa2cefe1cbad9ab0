#include "transitions/composite/front_to_back.hpp"

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace edgewise {
namespace {

constexpr double kMostSlices = 1 << 20;
constexpr std::int64_t kShownPictures = 16;

/// @param shown  to a watch, which wants some pictures
std::vector<std::int64_t> depths_of(const Parameters& with, std::int64_t depth, bool shown) {
    auto every = static_cast<std::int64_t>(with.number("every"));
    if (every < 1 && shown) every = (depth + kShownPictures - 1) / kShownPictures;
    std::vector<std::int64_t> depths;
    if (every < 1) return depths;
    for (std::int64_t at = every; at < depth; at += every) depths.push_back(at);
    depths.push_back(depth);
    return depths;
}

}  // namespace

Transition front_to_back_over(FrontWatch watch) {
    const auto depths = [shown = bool(watch)](const Parameters& with, std::int64_t depth) {
        return depths_of(with, depth, shown);
    };
    Transition edge = over_edge(Compositing::front_to_back, depths, std::move(watch));
    edge.name = "composite.front_to_back";
    edge.source = "Wittenbrink 1993, Appendix B, EQ 62 and 63, TABLE 36 and 37";
    edge.parameters = {
        {"every",
         number(0, kMostSlices, {0},
                "slices from one picture on the way to the next; 0: none, or sixteen pictures "
                "where somebody watches")}};
    edge.offer = [offer = edge.offer](const Representation& from, const Ask& ask,
                                      const Parameters& with) {
        const double every = with.number("every");
        if (every != std::floor(every))
            return Offer::no(fmt::format("every={}: slices are whole", every));
        return offer(from, ask, with);
    };
    return edge;
}

}  // namespace edgewise
