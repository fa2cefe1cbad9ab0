#pragma once

#include "graph/spread.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Permutation warp and parallel product on the threads of one machine: the screen is cut into
/// cubes, each is sent its samples and combined to a subframe, and the subframes behind one another
/// are joined two by two. No volume in screen space is kept, only subframes.
/// Edge    object/scalar or scaled/scalar -> screen/picture
/// Filter  that of warp.permutation
/// Needs   what warp.permutation and project.combine need, in one memory
/// Work    the sum of these two; the rows that cubes look through for their samples; the tree
/// Error   that of these two, one after the other
/// Source  [W93] 4.5, FIGURE 70 to 74; max, + and over are associative (Lemma 4.1)
Transition parallel_product();

// Combining over ranks ([W93] 4.4 and 4.5): every rank combines the samples of its own box, then
// boxes along a ray are joined two by two, while each of a pair keeps half of their pixels.

/// Bytes of a pixel's state in a subframe until it is finished.
double state_bytes(Mode mode) noexcept;

/// Makes the work of casting rays through a volume that of casting them through its boxes: every
/// rank casts the rays that meet its own, with a halo of one sample, sends the parts of its
/// subframe to the ranks whose screen they lie on (4.5.2: a turned box meets at most 18 of its
/// kind), and these join them along every ray.
void add_subframes(Work& work, const Offer& offer, const Ask& ask, int view);

/// Pixels that parallel rays through a rank's box meet.
double shadow_of_box(const Mat4& map, const Extent& extent, const Cut& cut);

/// Adds the tree of cut[2] boxes along every ray: operations over all ranks, and the messages,
/// bytes and memory of one rank.
void add_parallel_product(Work& work, Mode mode, const Cut& cut, double pixels);

}  // namespace edgewise
