#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// A node of an octree. `low` > `high`: no sample of it is finite.
struct OctreeNode {
    float mean = 0, low = 0, high = 0;  // of the trilinear field at its places [stored number]
    /// The first of its eight children, which follow one another, x fastest; or one of these.
    std::int32_t child = 0;

    static constexpr std::int32_t kLeaf = 0;      // the field is the mean, as far as is tolerated
    static constexpr std::int32_t kSamples = -1;  // a finest node whose samples differ
};

/// An octree over the places of a volume. A node of level l that begins at sample b along an axis
/// has the places b <= p < b + 4 * 2^l; the cells around them read sample b + 4 * 2^l too. Half a
/// sample beyond the outermost ones belongs to the nodes beside it.
struct Octree {
    static constexpr int kShift = 2;  // finest nodes have 4^3 places of samples

    std::span<const OctreeNode> nodes;  // the root first; level by level
    int depth = 0;                      // levels below the root
    Extent volume;                      // samples
    float range = 0;                    // of the finite samples [stored number]
    double leaves = 0;                  // share of all places that lie in leaves with a mean
    /// Mean over all places of an upper bound of (field - mean of the leaf)^2; 0 beside leaves.
    double variance = 0;
};

/// Builds an octree: sums of the finest nodes, layer by layer; their range; then level by level
/// from the finest one up; then the nodes themselves. Layers of one level may be made in parallel.
///
/// Samples weigh as in the trapezoidal rule, so that the mean of a node is that of the trilinear
/// field over it, and the variance is no less than the field's: a square is convex. Both of a
/// parent are made of its children's sums.
class OctreeBuilder {
 public:
    /// No sample of a leaf is farther from its mean than so many times what is tolerated.
    static constexpr double kFarthest = 4;

    /// @param tolerance  standard deviation of a leaf, share of the range
    OctreeBuilder(const Grid& volume, double tolerance, std::pmr::memory_resource* memory);

    int levels() const noexcept { return static_cast<int>(levels_.size()); }
    Extent extent(int level) const noexcept { return levels_[level].extent; }
    void sum_layers(std::int64_t begin, std::int64_t end);
    void find_range();
    void join_layers(int level, std::int64_t begin, std::int64_t end);
    std::size_t count() const;
    /// @param nodes  count() of them
    Octree write(std::span<OctreeNode> nodes) const;

    /// Bytes of scratch, and nodes at most, of a volume.
    static double scratch(const Extent& volume) noexcept;
    static double most_nodes(const Extent& volume) noexcept;

 private:
    /// Of samples less the origin; `squares` is infinite where some are not finite.
    struct Sums {
        float low, high;
        double sum, squares;
    };
    struct Level {
        Extent extent;
        std::pmr::vector<Sums> sums;
        std::pmr::vector<char> leaf;
    };
    struct Lines;

    void sum_line(Lines& lines, std::int64_t j, std::int64_t k);
    void add_row(Lines& lines, std::int64_t y, std::int64_t z, double weight) const;
    double places(int level, std::int64_t i, std::int64_t j, std::int64_t k) const noexcept;
    bool is_leaf(const Sums& sums, double places) const noexcept;

    Grid volume_;
    double share_, tolerance_ = 0;  // of the range; [stored number]
    float origin_ = 0, range_ = 0;
    std::pmr::vector<Level> levels_;
};

}  // namespace edgewise::kernels
