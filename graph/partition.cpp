#include <algorithm>

#include "graph/transition.hpp"

namespace edgewise {
namespace {

/// A node should not be shorter than 100 us; leaves are the edge's word for that, and more regions
/// than this bring nothing on the processors of one machine.
constexpr std::int64_t kMostRegions = 16;

}  // namespace

std::vector<Region> regions_of(const Partition& parts, const Offer& offer) {
    const Extent extent = parts.kind == Partition::input ? offer.from.extent : offer.to.extent;
    const Region all = Region::all(extent);
    const int axis = extent.z > 1 ? 2 : 1;  // the slowest, so that regions are contiguous
    if (parts.kind == Partition::whole || parts.leaf[axis] < 1 || parts.leaf == Extent{} ||
        all.empty())
        return {all};
    const std::int64_t leaves = (extent[axis] + parts.leaf[axis] - 1) / parts.leaf[axis];
    const std::int64_t each = parts.leaf[axis] * ((leaves + kMostRegions - 1) / kMostRegions);
    std::vector<Region> regions;
    for (std::int64_t begin = 0; begin < extent[axis]; begin += each) {
        regions.push_back(all);
        regions.back().begin[axis] = begin;
        regions.back().end[axis] = std::min(begin + each, extent[axis]);
    }
    return regions;
}

double part_bytes(const Partition& parts, const Offer& offer) {
    if (parts.kind != Partition::input) return 0;
    return static_cast<double>(regions_of(parts, offer).size() - 1) * offer.to.bytes();
}

}  // namespace edgewise
