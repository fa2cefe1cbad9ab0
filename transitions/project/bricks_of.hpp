#pragma once

#include <functional>
#include <memory>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Levels of all bricks, made in parallel.
/// @param memory   lives longer than they do
/// @param stopped  asked now and then: levels stay unfinished where it says so; null: never
std::shared_ptr<kernels::Bricks> bricks_of(const kernels::Grid& volume, const kernels::LevelsOf& of,
                                           std::pmr::memory_resource* memory,
                                           const std::function<bool()>& stopped);

}  // namespace edgewise
