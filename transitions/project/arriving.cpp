#include "transitions/project/arriving.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

#include "graph/shadow_start.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

template <class Body>  // of (begin, end)
void for_lines(std::int64_t count, const Context* context, const Body& body) {
    tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t line) {
        if (!context || !context->stopped()) body(line, line + 1);
    });
    if (context) context->poll();
}

/// Places look up what arrives at those which are so much nearer to the light.
/// @param start  [t]
void begin_at(kernels::LightGrid& grid, double start) {
    constexpr std::size_t kAlongShift = 4 * 2 + 3;  // of the third row, which goes along the light
    grid.to_grid[kAlongShift] -= start / grid.step;
}

}  // namespace

ArrivingGrids::ArrivingGrids(const kernels::Grid& samples, const Representation& from,
                             const Request& want, int view, std::pmr::memory_resource* memory)
    : optics_(optics_of(want, samples.values)), kept_(kept_of(from, want, view)) {
    medium_ = {.volume = samples,
               .optics = &optics_,
               .kept = kept_ ? &*kept_ : nullptr,
               .bricks = nullptr};
    Mat4 to_screen = residual(from, want, view);
    to_screen.row(0) *= want.pixel[0];
    to_screen.row(1) *= want.pixel[1];
    if (want.shading.shadows)
        for (const Light& light : want.shading.lights) {
            lights_.push_back(
                kernels::LightGrid::around(from.extent, to_screen, light.towards, memory));
            begin_at(lights_.back(), shadow_start(want, view));
        }
    for (const kernels::LightGrid& grid : lights_) lanes_.lights.push_back(&grid);
    if (want.shading.occlusion > 0) {
        ambient_.emplace(kernels::AmbientGrid::around(from.extent, to_screen.topLeftCorner<3, 3>(),
                                                      want.shading.occlusion / want.unit, memory));
        lanes_.ambient = &*ambient_;
    }
}

void ArrivingGrids::fill(const kernels::Bricks* bricks, const Context& context) {
    medium_.bricks = bricks;
    for (kernels::LightGrid& grid : lights_) {
        grid.left.resize(static_cast<std::size_t>(grid.extent.samples()));
        for_lines(grid.extent.y, &context,
                  [&](std::int64_t begin, std::int64_t end) { grid.fill(medium_, begin, end); });
    }
    if (!ambient_) return;
    ambient_->depths->resize(static_cast<std::size_t>(ambient_->extent.samples()));
    ambient_->left.resize(ambient_->depths->size());
    for_lines(ambient_->extent.z, &context, [&](std::int64_t begin, std::int64_t end) {
        ambient_->fill_depths(medium_, begin, end);
    });
    for_lines(ambient_->extent.z, &context,
              [&](std::int64_t begin, std::int64_t end) { ambient_->fill(begin, end); });
}

void ArrivingGrids::prepare(const ArrivingGrids* other) {
    if (!ambient_) return;
    if (other && !kept_ && other->ambient_->cell == ambient_->cell) {
        ambient_->depths = other->ambient_->depths;
        return;
    }
    ambient_->depths->resize(static_cast<std::size_t>(ambient_->extent.samples()));
    for_lines(ambient_->extent.z, nullptr, [&](std::int64_t begin, std::int64_t end) {
        ambient_->fill_depths(medium_, begin, end);
    });
}

Arriving ArrivingGrids::at(const Vec3& p) const {
    Arriving arriving;
    const std::array<double, 3> place{p.x(), p.y(), p.z()};
    for (std::size_t i = 0; i < lights_.size(); ++i)
        arriving.lights[i] = lights_[i].at(medium_, place);
    if (ambient_) arriving.ambient = ambient_->at(place);
    return arriving;
}

double ArrivingGrids::operations() const {
    // These loops have no vectors: one of their operations takes as long as eight.
    constexpr double kPlain = 8;
    const auto ramps = static_cast<double>(optics_.ramps.size());
    const double opacity = 20 + 4 * ramps;
    double operations = 0;
    for (const kernels::LightGrid& grid : lights_)
        operations += (40 + opacity) * static_cast<double>(grid.extent.samples());
    if (ambient_) {
        const auto cells = static_cast<double>(ambient_->extent.samples());
        operations += 80.0 * kernels::AmbientGrid::kDirections * ambient_->steps * cells;
        operations += (40 + opacity) * static_cast<double>(medium_.volume.extent.samples());
    }
    return kPlain * operations;
}

double ArrivingGrids::bytes() const {
    double bytes = ambient_ ? ambient_->bytes() : 0;
    for (const kernels::LightGrid& grid : lights_) bytes += grid.bytes();
    return bytes;
}

}  // namespace edgewise
