#include "transitions/kernels/octree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graph/with_type.hpp"
#include "transitions/kernels/octree_rows.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kFinest = 1 << Octree::kShift;
constexpr float kNoLow = std::numeric_limits<float>::infinity();

Extent finest_nodes(const Extent& volume) noexcept {
    Extent nodes;
    for (int axis = 0; axis < 3; ++axis) nodes[axis] = (volume[axis] + kFinest - 1) / kFinest;
    return nodes;
}

Extent halved(const Extent& n) noexcept { return {(n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2}; }

bool is_one(const Extent& n) noexcept { return n.samples() == 1; }

/// Samples that a finest node reads along an axis, and their weights: half of each cell beside
/// them, and of the half sample beyond the outermost ones.
struct SamplesAlong {
    std::int64_t begin, last;  // last: included

    SamplesAlong(std::int64_t node, std::int64_t n)
        : begin(node * kFinest), last(std::min(begin + kFinest, n - 1)) {}
    double weight(std::int64_t i) const noexcept {
        return (i > begin || i == 0 ? 0.5 : 0) + (i < begin + kFinest ? 0.5 : 0);
    }
};

std::int64_t place_in(const Extent& n, std::int64_t i, std::int64_t j, std::int64_t k) noexcept {
    return (k * n.y + j) * n.x + i;
}

/// Calls use(i, j, k) for the children that a node has.
template <class Use>
void each_child(const Extent& children, std::int64_t i, std::int64_t j, std::int64_t k,
                const Use& use) {
    for (std::int64_t c = 2 * k; c < std::min(2 * k + 2, children.z); ++c)
        for (std::int64_t b = 2 * j; b < std::min(2 * j + 2, children.y); ++b)
            for (std::int64_t a = 2 * i; a < std::min(2 * i + 2, children.x); ++a) use(a, b, c);
}

void load_row(const Grid& volume, std::int64_t y, std::int64_t z, float* to) {
    const std::int64_t first = z * volume.slice_step() + y * volume.row_step();
    if (volume.type == Type::f16) {
        for (std::int64_t x = 0; x < volume.extent.x; ++x)
            to[x] = scalar_load(Type::f16)(volume.samples, first + x);
        return;
    }
    with_type(volume.type, [&](auto zero) {
        const auto* from = volume.as<decltype(zero)>() + first;
        for (std::int64_t x = 0; x < volume.extent.x; ++x) to[x] = static_cast<float>(from[x]);
    });
}

/// The first finite sample in order; none: 0. Sums are of differences from it, because squares of
/// numbers on a large offset cancel.
float origin_of(const Grid& volume, std::pmr::vector<float>& row) {
    for (std::int64_t z = 0; z < volume.extent.z; ++z)
        for (std::int64_t y = 0; y < volume.extent.y; ++y) {
            load_row(volume, y, z, row.data());
            for (const float value : row)
                if (std::isfinite(value)) return value;
        }
    return 0;
}

}  // namespace

/// What the rows of a line of finest nodes have at each x.
struct OctreeBuilder::Lines {
    std::pmr::vector<float> row, low, high, gaps;
    std::pmr::vector<double> sum, squares;

    Lines(std::int64_t n, std::pmr::memory_resource* memory)
        : row((static_cast<std::size_t>(n) + kOctreeLanes - 1) / kOctreeLanes * kOctreeLanes,
              memory),
          low(row.size(), memory),
          high(row.size(), memory),
          gaps(row.size(), memory),
          sum(row.size(), memory),
          squares(row.size(), memory) {}
    void clear() {
        std::fill(low.begin(), low.end(), kNoLow);
        std::fill(high.begin(), high.end(), -kNoLow);
        std::fill(gaps.begin(), gaps.end(), 0.0f);
        std::fill(sum.begin(), sum.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
    }
};

OctreeBuilder::OctreeBuilder(const Grid& volume, double tolerance,
                             std::pmr::memory_resource* memory)
    : volume_(volume), share_(tolerance), levels_(memory) {
    std::pmr::vector<float> row(static_cast<std::size_t>(volume.extent.x), memory);
    origin_ = origin_of(volume, row);
    for (Extent n = finest_nodes(volume.extent);; n = halved(n)) {
        const auto count = static_cast<std::size_t>(n.samples());
        levels_.push_back({.extent = n,
                           .sums = std::pmr::vector<Sums>(count, memory),
                           .leaf = std::pmr::vector<char>(count, memory)});
        if (is_one(n)) break;
    }
}

double OctreeBuilder::scratch(const Extent& volume) noexcept {
    double bytes = 0;
    for (Extent n = finest_nodes(volume);; n = halved(n)) {
        bytes += static_cast<double>(n.samples()) * (sizeof(Sums) + 1);
        if (is_one(n)) return bytes;
    }
}

double OctreeBuilder::most_nodes(const Extent& volume) noexcept {
    double nodes = 1;
    for (Extent n = finest_nodes(volume); !is_one(n);) {
        n = halved(n);
        nodes += 8 * static_cast<double>(n.samples());
    }
    return nodes;
}

void OctreeBuilder::add_row(Lines& lines, std::int64_t y, std::int64_t z, double weight) const {
    load_row(volume_, y, z, lines.row.data());
    // Without a tolerance only what is constant is a leaf.
    const bool sums = share_ > 0;
    add_octree_row(lines.row.data(), weight,
                   {.n = lines.row.size(),
                    .low = lines.low.data(),
                    .high = lines.high.data(),
                    .gaps = lines.gaps.data(),
                    .sum = sums ? lines.sum.data() : nullptr,
                    .squares = sums ? lines.squares.data() : nullptr,
                    .origin = origin_});
}

void OctreeBuilder::sum_line(Lines& lines, std::int64_t j, std::int64_t k) {
    const SamplesAlong along_y(j, volume_.extent.y), along_z(k, volume_.extent.z);
    lines.clear();
    for (std::int64_t z = along_z.begin; z <= along_z.last; ++z)
        for (std::int64_t y = along_y.begin; y <= along_y.last; ++y)
            add_row(lines, y, z, along_z.weight(z) * along_y.weight(y));
    Level& level = levels_[0];
    for (std::int64_t i = 0; i < level.extent.x; ++i) {
        const SamplesAlong along_x(i, volume_.extent.x);
        Sums sums{kNoLow, -kNoLow, 0, 0};
        float gaps = 0;
        for (std::int64_t x = along_x.begin; x <= along_x.last; ++x) {
            const auto at = static_cast<std::size_t>(x);
            const double weight = along_x.weight(x);
            sums.low = std::min(sums.low, lines.low[at]);
            sums.high = std::max(sums.high, lines.high[at]);
            sums.sum += weight * lines.sum[at];
            sums.squares += weight * lines.squares[at];
            gaps += lines.gaps[at];
        }
        if (gaps > 0 && sums.low <= sums.high)
            sums.squares = std::numeric_limits<double>::infinity();
        level.sums[static_cast<std::size_t>(place_in(level.extent, i, j, k))] = sums;
    }
}

void OctreeBuilder::sum_layers(std::int64_t begin, std::int64_t end) {
    Lines lines(volume_.extent.x, levels_.get_allocator().resource());
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < levels_[0].extent.y; ++j) sum_line(lines, j, k);
}

void OctreeBuilder::find_range() {
    float low = kNoLow, high = -kNoLow;
    for (const Sums& sums : levels_[0].sums) {
        low = std::min(low, sums.low);
        high = std::max(high, sums.high);
    }
    range_ = low <= high ? high - low : 0;
    tolerance_ = share_ * static_cast<double>(range_);
}

double OctreeBuilder::places(int level, std::int64_t i, std::int64_t j,
                             std::int64_t k) const noexcept {
    const std::int64_t side = kFinest << level, at[3] = {i, j, k};
    double volume = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double begin = at[axis] == 0 ? -0.5 : static_cast<double>(at[axis] * side);
        const double last = static_cast<double>(volume_.extent[axis]) - 0.5;
        volume *= std::min(static_cast<double>((at[axis] + 1) * side), last) - begin;
    }
    return volume;
}

bool OctreeBuilder::is_leaf(const Sums& sums, double places) const noexcept {
    if (sums.low > sums.high) return true;  // all of it is absent
    if (!std::isfinite(sums.squares)) return false;
    if (sums.low == sums.high) return true;
    if (share_ == 0) return false;
    const double off = sums.sum / places, mean = origin_ + off;
    const double farthest = std::max(sums.high - mean, mean - sums.low);
    return sums.squares / places - off * off <= tolerance_ * tolerance_ &&
           farthest <= kFarthest * tolerance_;
}

void OctreeBuilder::join_layers(int level, std::int64_t begin, std::int64_t end) {
    Level& to = levels_[static_cast<std::size_t>(level)];
    const Extent& n = to.extent;
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < n.y; ++j)
            for (std::int64_t i = 0; i < n.x; ++i) {
                const auto at = static_cast<std::size_t>(place_in(n, i, j, k));
                Sums& sums = to.sums[at];
                // What varies in a child varies here, however little that is of the whole: a small
                // bright spot is not lost in a large dark node.
                bool leaves = true;
                if (level > 0) {
                    const Level& from = levels_[static_cast<std::size_t>(level - 1)];
                    sums = {kNoLow, -kNoLow, 0, 0};
                    bool absent = false;
                    each_child(from.extent, i, j, k, [&](auto a, auto b, auto c) {
                        const auto child = static_cast<std::size_t>(place_in(from.extent, a, b, c));
                        const Sums& part = from.sums[child];
                        absent = absent || part.low > part.high;
                        leaves = leaves && from.leaf[child];
                        sums.low = std::min(sums.low, part.low);
                        sums.high = std::max(sums.high, part.high);
                        sums.sum += part.sum;
                        sums.squares += part.squares;
                    });
                    if (absent && sums.low <= sums.high)
                        sums.squares = std::numeric_limits<double>::infinity();
                }
                to.leaf[at] = leaves && is_leaf(sums, places(level, i, j, k));
            }
}

std::size_t OctreeBuilder::count() const {
    // A node has children where it and all above it are none.
    std::size_t nodes = 1;
    for (std::size_t level = 1; level < levels_.size(); ++level)
        for (const char leaf : levels_[level].leaf) nodes += leaf ? 0 : 8;
    return nodes;
}

Octree OctreeBuilder::write(std::span<OctreeNode> nodes) const {
    struct At {
        std::int32_t i, j, k;
    };
    std::pmr::memory_resource* memory = levels_.get_allocator().resource();
    std::pmr::vector<At> here({At{0, 0, 0}}, memory), below(memory);
    Octree tree{.nodes = nodes, .depth = levels() - 1, .volume = volume_.extent, .range = range_};
    std::size_t next = 0, children = 1;
    for (int l = levels() - 1; l >= 0; --l) {
        const Level& level = levels_[static_cast<std::size_t>(l)];
        below.clear();
        for (const At& at : here) {
            OctreeNode& node = nodes[next++];
            node = {0, kNoLow, -kNoLow, OctreeNode::kLeaf};
            if (at.i >= level.extent.x || at.j >= level.extent.y || at.k >= level.extent.z)
                continue;  // beyond the volume
            const auto place = static_cast<std::size_t>(place_in(level.extent, at.i, at.j, at.k));
            const Sums& sums = level.sums[place];
            node.low = sums.low;
            node.high = sums.high;
            if (!level.leaf[place]) {
                node.child = OctreeNode::kSamples;
                if (l == 0) continue;
                node.child = static_cast<std::int32_t>(children);
                children += 8;
                for (std::int32_t c = 0; c < 8; ++c)
                    below.push_back(
                        {2 * at.i + (c & 1), 2 * at.j + (c >> 1 & 1), 2 * at.k + (c >> 2)});
                continue;
            }
            if (sums.low > sums.high) continue;
            const double volume = places(l, at.i, at.j, at.k), off = sums.sum / volume;
            tree.leaves += volume;
            if (sums.low == sums.high) {
                node.mean = sums.low;
                continue;
            }
            node.mean = static_cast<float>(origin_ + off);
            tree.variance += volume * std::max(0.0, sums.squares / volume - off * off);
        }
        here.swap(below);
    }
    const auto all = static_cast<double>(volume_.extent.samples());
    tree.leaves /= all;
    tree.variance /= all;
    return tree;
}

}  // namespace edgewise::kernels
