#pragma once

#include <memory>
#include <optional>

#include "graph/transition.hpp"
#include "transitions/kernels/octree.hpp"

namespace edgewise {

/// Lays an octree beside the samples, once for all views: a node is a leaf where the samples differ
/// so little from their mean that rays may take the mean for all of it.
///
/// A leaf's samples have a standard deviation of at most `tolerance`, and none is farther than four
/// times that from their mean. They are all that cells at its places read, those of its neighbours
/// at its faces too: what is approximated is the trilinear field. A parent is a leaf only where
/// all its children are, so that a small spot is not lost in a large node. With a tolerance of 0
/// leaves are constant.
/// Edge    object/scalar -> object/octree: the same samples with a facet; a content of its own, as
///         only project.octree_cast reads it. Only by --via
/// Shape   [nz, ny, nx], x fastest, any real type; nodes of 16 bytes, finest nodes of 4^3 places
/// Needs   all samples in memory; at most 2^31 nodes
/// Work    a sample: extremes 3 and sums 5, those on faces of nodes once more for each
/// Error   so far the field lies from what rays take for it (RMS): the tolerance, times the root of
///         the share of places in leaves that differ, counted on 512 finest nodes. Of a maximum
///         the tolerance
/// Source  [W93] FIGURE 60; Levoy 1990; Laur and Hanrahan 1991 (variance)
Transition octree();

/// What the facet holds.
struct OctreeBeside {
    Array room;
    kernels::Octree tree;  // of `room`
};

inline constexpr const char* kOctree = "octree";  // the content, and the facet
/// The octree of data that have one.
std::shared_ptr<const OctreeBeside> octree_of(const Data& data);

}  // namespace edgewise
