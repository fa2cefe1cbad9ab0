#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "graph/small_objects.hpp"
#include "graph/transition.hpp"
#include "transitions/kernels/arriving.hpp"

namespace edgewise {

/// What keeps light away from samples, for one view of a request that asks for it.
class ArrivingGrids {
 public:
    /// The grids without their numbers.
    /// @param samples  that lie like `from`; both and the request must stay alive
    ArrivingGrids(const kernels::Grid& samples, const Representation& from, const Request& want,
                  int view, std::pmr::memory_resource* memory);
    ArrivingGrids(const ArrivingGrids&) = delete;
    ArrivingGrids& operator=(const ArrivingGrids&) = delete;

    /// Works the numbers out, in parallel.
    /// @param bricks  of opacities, or null
    void fill(const kernels::Bricks* bricks, const Context& context);
    /// What arrives at an input index, from numbers that are worked out for it where there are none
    /// yet, but for the mean depths around, which prepare() makes.
    /// @param other  of another view, whose depths are taken if they are the same
    void prepare(const ArrivingGrids* other = nullptr);
    Arriving at(const Vec3& p) const;
    const kernels::RayArriving& lanes() const noexcept { return lanes_; }
    /// Operations that the numbers take, one after another, and their bytes.
    double operations() const;
    double bytes() const;

 private:
    kernels::Optics optics_;
    std::optional<kernels::Kept> kept_;
    kernels::Medium medium_;
    SmallVector<kernels::LightGrid> lights_;
    std::optional<kernels::AmbientGrid> ambient_;
    kernels::RayArriving lanes_;
};

}  // namespace edgewise
