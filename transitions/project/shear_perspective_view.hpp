#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/shear_perspective.hpp"

namespace edgewise {

// Where the slices lie that rays from an eye cross one by one: see kernels::PerspectiveSlices.

/// Two axes in the order in which rows and columns of a slice of the third lie.
constexpr std::array<int, 2> axes_across(int axis) {
    if (axis == 0) return {1, 2};
    return {0, axis == 1 ? 2 : 1};
}

/// The way along an axis in which a ray advances fastest.
struct Way {
    int axis = 2;
    bool backwards = false;

    std::size_t index() const { return static_cast<std::size_t>(2 * axis + (backwards ? 1 : 0)); }
};
inline constexpr std::array<Way, 6> kWays = {
    {{0, false}, {0, true}, {1, false}, {1, true}, {2, false}, {2, true}}};

/// The slices along one way, from the first that its rays may meet, and their image.
struct SlicedView {
    kernels::PerspectiveSlices slices;  // without samples
    Extent image;
    std::int64_t first = 0;  // slice of the lowest index
};

struct PerspectiveView {
    kernels::Rays rays;
    std::array<std::optional<SlicedView>, kWays.size()> along;  // none: no ray needs it
    std::string refused;                                        // why there is none

    const std::array<double, 3>& eye() const { return rays.origin.base; }
};

/// @param density  pixels on a voxel of the first slice that rays may meet
PerspectiveView perspective_view(const Representation& from, const Request& want, int view,
                                 double density);

/// The box of an image that a box of the picture is read from.
Region box_of_slices(const SlicedView& of, const kernels::Rays& rays, const Region& picture,
                     const Way& way);

/// The axes along which the views of a request have slices.
struct SlicedAxes {
    std::array<bool, 3> needed{};
    std::string refused = {};  // why a view has none
};
SlicedAxes sliced_axes(const Representation& from, const Request& want);

}  // namespace edgewise
