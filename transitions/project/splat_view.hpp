#pragma once

#include <array>
#include <string>

#include "graph/transition.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/splat.hpp"

namespace edgewise {

// What edges that splat share.

/// What footprints are integrals of.
const Filter& splat_kernel();

/// One view, without samples and footprints.
struct SplatView {
    kernels::Splat splat;
    kernels::Footprints::Shape shape;
    double slice = 1;              // of a ray from one voxel of shape.along to the next [t]
    std::array<double, 2> step{};  // from a pixel to its neighbours, the longest [voxel]

    /// Pixels that vectors may write for one footprint.
    double pixels_written() const noexcept;
};

/// @param cells  of a voxel, in tables
SplatView splat_view_of(const Representation& from, const Request& want, int view, int cells,
                        kernels::Footprints::Depth depth);

/// Places of rays in fixed point.
std::uint32_t fixed_place(double voxels) noexcept;

/// Why samples cannot be splatted whatever the mode, or "".
std::string no_splatting(const Representation& from, const Ask& ask);

/// The spans of all rows of a splat's volume, found on all threads.
class SplatSpans {
 public:
    SplatSpans(const kernels::Splat& splat, const Context& context);
    const kernels::SplatSpan* data() noexcept { return spans_.data(); }
    static double bytes(const Extent& volume) noexcept;

 private:
    kernels::Block<kernels::SplatSpan> spans_;
};

/// Samples that are not of the commonest value. What was cropped away was.
double samples_splatted(const Representation& from, const Ask& ask);

/// The stored number that is passed over, and what it stands for.
struct EmptySample {
    float stored = 0;
    double value = 0;
};
EmptySample empty_sample(const ValueMap& values, const Scene& scene);

}  // namespace edgewise
