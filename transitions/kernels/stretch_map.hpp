#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "transitions/kernels/brick_distances.hpp"
#include "transitions/kernels/octree.hpp"
#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

// What tells a ray how far it may go at once.

/// A box of places [low, high), and what a ray has of it: nothing, one value, or its samples.
struct BoxAhead {
    enum Holds { nothing, one_value, samples } holds = samples;
    float value = 0;  // of one_value [stored number]
    std::array<int, 3> low{}, high{};
};

/// A node of an octree as rays of a request see it.
struct OctreeStop {
    /// Of max the largest value, negated where the slope is negative; of over the largest opacity;
    /// else -inf where there is nothing, and 0.
    float level = 0;
    std::int32_t child = 0;  // as OctreeNode has it
};

struct OctreeStops {
    const Octree* tree = nullptr;
    std::pmr::vector<OctreeStop> stops;  // one a node
};

/// A leaf is crossed at once where opacity and colours rise and fall no faster between its least
/// and its greatest value than so many times a ramp over the whole range.
inline constexpr double kSteepestCrossed = 4;

/// What nodes [begin, end) are of a request.
/// @param optics  of over, else null
void see_nodes(Combine rule, bool falls, const Optics* optics, std::int64_t begin, std::int64_t end,
               OctreeStops& stops);

/// Joins nodes all of which are sampled, so that rays do not ask for each. Of a maximum, whose rays
/// leave out some of them, it does nothing.
void join_sampled(Combine rule, OctreeStops& stops);

/// The nodes of an octree that one ray comes to, one after another.
class OctreeWay {
 public:
    explicit OctreeWay(const OctreeStops& stops) : stops_(stops), level_(stops.tree->depth) {}

    void begin_ray() { level_ = stops_.tree->depth; }
    /// The largest node around a sample that need not be divided.
    /// @param needs  whether a level may matter
    template <class Needs>
    BoxAhead at(const std::array<int, 3>& sample, const Needs& needs) {
        // Up to the node that has the place before in it too, then down.
        std::array<unsigned, 3> place{};
        unsigned differ = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            place[axis] = static_cast<unsigned>(sample[axis]) >> Octree::kShift;
            differ |= place[axis] ^ last_[axis];
        }
        last_ = place;
        level_ = std::max(level_, static_cast<int>(std::bit_width(differ)));
        BoxAhead box;
        for (;;) {
            const std::int32_t node = path_[static_cast<std::size_t>(level_)];
            const OctreeStop& stop = stops_.stops[static_cast<std::size_t>(node)];
            if (!needs(stop.level)) {
                box.holds = BoxAhead::nothing;
                break;
            }
            if (stop.child <= 0) {
                if (stop.child == OctreeNode::kLeaf) {
                    box.holds = BoxAhead::one_value;
                    box.value = stops_.tree->nodes[static_cast<std::size_t>(node)].mean;
                }
                break;
            }
            --level_;
            std::int32_t octant = 0;
            for (std::size_t axis = 0; axis < 3; ++axis)
                octant |= static_cast<std::int32_t>(place[axis] >> level_ & 1u) << axis;
            path_[static_cast<std::size_t>(level_)] = stop.child + octant;
        }
        const int shift = Octree::kShift + level_;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.low[axis] = sample[axis] >> shift << shift;
            box.high[axis] = box.low[axis] + (1 << shift);
        }
        return box;
    }

 private:
    const OctreeStops& stops_;
    int level_;
    std::array<unsigned, 3> last_{};
    std::array<std::int32_t, 32> path_{};  // nodes from the root, by their level; from level_ up
};

/// The bricks that one ray comes to; those that cannot matter are passed by as many at once as lie
/// between them and one that may.
class BricksAhead {
 public:
    /// @param falls  the slope of stored numbers is negative
    BricksAhead(const BrickDistances& by, Combine rule, bool falls)
        : by_(by),
          far_(rule == Combine::max && std::isfinite(by.floor) ? BoxAhead::one_value
                                                               : BoxAhead::nothing),
          value_(falls ? -by.floor : by.floor) {}

    void begin_ray() {}
    template <class Needs>
    BoxAhead at(const std::array<int, 3>& sample, const Needs& needs) const {
        const Bricks& bricks = *by_.bricks;
        const std::int64_t i = sample[0] >> Bricks::kShift, j = sample[1] >> Bricks::kShift,
                           k = sample[2] >> Bricks::kShift;
        const auto brick =
            static_cast<std::size_t>((k * bricks.extent.y + j) * bricks.extent.x + i);
        const int distance = by_.distance[brick];
        BoxAhead box;
        if (distance > 0) {
            box.holds = far_;
            box.value = value_;
        } else if (!needs(bricks.level[brick])) {
            box.holds = BoxAhead::nothing;
        }
        const int beside = std::max(0, distance - 1);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int at = sample[axis] >> Bricks::kShift;
            box.low[axis] = (at - beside) * (1 << Bricks::kShift);
            box.high[axis] = (at + beside + 1) * (1 << Bricks::kShift);
        }
        return box;
    }

 private:
    const BrickDistances& by_;
    BoxAhead::Holds far_;  // what bricks have that never matter
    float value_;
};

}  // namespace edgewise::kernels
