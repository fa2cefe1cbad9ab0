#pragma once

#include <cstddef>

#include "graph/transition.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Combines samples that already lie in screen space, along z: the second half of warp and project.
/// Edge    screen/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, f32; one f32 a pixel, four of composite
/// Needs   parallel rays. Only samples from inside the input count, whatever the warp wrote
/// elsewhere Work    a sample: 1 operation, of composite its optics and EQ 63 Error   of a step of
/// 1, measured on the preview; errors of the samples pass with the rule's gain Source  [W93] 4.3,
/// EQ 62 and 63; Lemma 4.1
Transition combine();

/// The part of each ray of a view that lies inside the input [z of the screen].
class InputSpans {
 public:
    InputSpans(const Request& want, int view);
    /// Of the pixels of a tile, rows of `pitch`; low > high: none of a ray.
    void fill(const Region& tile, std::ptrdiff_t pitch, float* low, float* high) const;

 private:
    kernels::RayCast geometry_;
};

}  // namespace edgewise
