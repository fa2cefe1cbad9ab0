#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <span>

#include "surface/mesh.hpp"

namespace edgewise::surface {

using Quad = std::array<std::uint32_t, 4>;

/// Moves vertices towards the mean of their neighbours, in indices of samples. Each stays in its
/// cell; those on an open rim stay where they are.
/// @param places  of vertices, relative to the first corner of their cells: 0 to 1
/// @param cells   first corners of these cells
void smooth_net(std::span<const Quad> quads, std::span<const std::array<std::int32_t, 3>> cells,
                std::span<Eigen::Vector3f> places, int steps, std::pmr::memory_resource* memory,
                const std::function<void()>& poll);

}  // namespace edgewise::surface
