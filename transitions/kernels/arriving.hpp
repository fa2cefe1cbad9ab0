#pragma once

#include <array>
#include <functional>
#include <memory>
#include <memory_resource>
#include <vector>

#include "graph/small_objects.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

// How much light arrives at a sample through what lies on its way: lights by their shadows, ambient
// light by what lies around. Both are worked out on grids and interpolated linearly between their
// points.

/// What takes light away: the opacities of a volume, where it is kept.
struct Medium {
    Grid volume;  // one channel
    const Optics* optics = nullptr;
    const Kept* kept = nullptr;      // null: all of it
    const Bricks* bricks = nullptr;  // of opacities; what they say is transparent is not read

    /// Optical depth per t at an input index, of trilinear samples; 0 outside and where one is not
    /// finite.
    double depth_at(const std::array<double, 3>& p) const;
};

/// What is left of a light at the points of a grid whose columns are the light's rays (Lokovic and
/// Veach, "Deep shadow maps", SIGGRAPH 2000).
struct LightGrid {
    Extent extent;                  // across the light twice, and along it
    double step = 1;                // between points [t]
    std::array<double, 3> origin;   // input index of point (0, 0, 0)
    std::array<double, 3> axes[3];  // from one point to the next [input index]
    Affine to_grid;                 // input index -> point
    std::pmr::vector<float> left;   // by point; empty: nothing is kept

    /// The grid for light that falls on a volume, about as fine as its samples; coarser where it
    /// would have more than four points a sample.
    /// @param to_screen  input index -> screen space whose axes are equally long [t]
    /// @param towards    the light, unit length, in that space
    static LightGrid around(const Extent& volume, const Eigen::Matrix4d& to_screen,
                            const Eigen::Vector3d& towards, std::pmr::memory_resource* memory);
    double bytes() const { return 4 * static_cast<double>(extent.samples()); }

    /// What is left at points 0 to last of one column.
    void march(const Medium& medium, std::int64_t i, std::int64_t j, std::int64_t last,
               float* left_at) const;
    /// Fills columns [begin, end) of lines of the second axis.
    void fill(const Medium& medium, std::int64_t begin, std::int64_t end);
    /// Interpolated at an input index; without `left` from columns that are marched for it.
    double at(const Medium& medium, const std::array<double, 3>& p) const;
};

/// What is left of ambient light: the mean, over all directions, of the transparency of a length.
struct AmbientGrid {
    static constexpr int kDirections = 32;

    Extent extent;                                  // of cells
    std::array<int, 3> cell;                        // samples along each axis of one
    double radius = 0;                              // [t]
    int steps = 1;                                  // of a direction
    SmallVector<std::array<double, 3>> directions;  // one step [cell]
    /// Optical depth per t, mean of each cell; shared between views.
    std::shared_ptr<std::pmr::vector<float>> depths;
    std::pmr::vector<float> left;  // by cell; empty: nothing is kept

    /// Cells of about a quarter of the radius.
    /// @param to_screen  input index -> screen space whose axes are equally long [t]
    static AmbientGrid around(const Extent& volume, const Eigen::Matrix3d& to_screen, double radius,
                              std::pmr::memory_resource* memory);
    double bytes() const { return 8 * static_cast<double>(extent.samples()); }

    /// Fills the depths of slices [begin, end) of cells, then what is left there.
    void fill_depths(const Medium& medium, std::int64_t begin, std::int64_t end);
    void fill(std::int64_t begin, std::int64_t end);
    /// Whether samples whose light is interpolated from a cell may be seen.
    bool is_seen(std::int64_t i, std::int64_t j, std::int64_t k) const;
    double left_of(std::int64_t i, std::int64_t j, std::int64_t k) const;
    /// Interpolated at an input index; without `left` from cells that are worked out for it.
    double at(const std::array<double, 3>& p) const;
};

/// Directions spread evenly over the sphere, unit length.
SmallVector<Eigen::Vector3d> even_directions(int count);

}  // namespace edgewise::kernels
