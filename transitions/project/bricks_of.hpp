#pragma once

#include <functional>
#include <memory>

#include "graph/data.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Levels of all bricks, made in parallel.
/// @param memory   lives longer than they do
/// @param stopped  asked now and then: levels stay unfinished where it says so; null: never
std::shared_ptr<kernels::Bricks> bricks_of(const kernels::Grid& volume, const kernels::LevelsOf& of,
                                           std::pmr::memory_resource* memory,
                                           const std::function<bool()>& stopped);
/// The same of samples that may have them already; else they are kept there (Data::worked_out).
/// What is counted for the choice of a path is so found by its runs, and by all frames.
/// @param volume  of the data's samples
std::shared_ptr<const kernels::Bricks> bricks_beside(const Data& data, const kernels::Grid& volume,
                                                     const kernels::LevelsOf& of,
                                                     std::pmr::memory_resource* memory,
                                                     const std::function<bool()>& stopped);

}  // namespace edgewise
