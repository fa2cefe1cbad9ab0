#pragma once

#include <functional>
#include <memory_resource>
#include <vector>

#include "graph/data.hpp"

namespace edgewise::surface {

/// Labels by their place among all that there are, within a frame of background.
struct LabelGroups {
    /// [nz + 2, ny + 2, nx + 2] of u8, u16 or u32: 0 is background, 1 the least label.
    Data samples;
    std::vector<double> labels;  // values, ascending: of 1, 2, ...
};

/// Of any type of number. What is not finite is background.
/// @param background  the value that is no label
/// @param poll        called once a slice; may throw
/// @throws std::bad_alloc
LabelGroups groups_of(const Data& labels, double background, std::pmr::memory_resource* memory,
                      const std::function<void()>& poll);

/// Bytes that the samples of so many labels take, where nobody has counted them.
double group_bytes(const Representation& labels) noexcept;

}  // namespace edgewise::surface
