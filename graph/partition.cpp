#include <algorithm>
#include <array>

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

std::vector<Region> boxes_of(const Extent& extent, int count) {
    std::array<std::int64_t, 3> pieces{1, 1, 1};
    const auto length = [&](int axis) { return (extent[axis] + pieces[axis] - 1) / pieces[axis]; };
    // Its prime factors, the largest first, each to the axis whose pieces are longest.
    std::vector<int> factors;
    for (int factor = 2; count > 1; ++factor)
        for (; count % factor == 0; count /= factor) factors.insert(factors.begin(), factor);
    for (const int factor : factors) {
        int longest = 2;
        for (const int axis : {1, 0})
            if (length(axis) > length(longest)) longest = axis;
        pieces[longest] = std::min(extent[longest], pieces[longest] * factor);
    }
    std::vector<Region> boxes;
    const auto cut = [&](int axis, std::int64_t piece) {
        return extent[axis] * piece / pieces[axis];
    };
    for (std::int64_t z = 0; z < pieces[2]; ++z)
        for (std::int64_t y = 0; y < pieces[1]; ++y)
            for (std::int64_t x = 0; x < pieces[0]; ++x) {
                Region box;
                for (int axis = 0; axis < 3; ++axis) {
                    const std::int64_t piece = axis == 0 ? x : axis == 1 ? y : z;
                    box.begin[axis] = cut(axis, piece);
                    box.end[axis] = cut(axis, piece + 1);
                }
                boxes.push_back(box);
            }
    return boxes;
}

double part_bytes(const Partition& parts, const Offer& offer) {
    if (parts.kind != Partition::input) return 0;
    return static_cast<double>(regions_of(parts, offer).size() - 1) * offer.to.bytes();
}

}  // namespace edgewise
