#pragma once

#include <cstdint>

#include "graph/data.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// The samples of data as kernels read them: of a caller's those that with_slack() made of them.
inline Grid grid_of(const Data& data) noexcept {
    Grid grid{.samples = data.samples.data(),
              .type = data.what.type,
              .extent = data.what.extent,
              .channels = data.what.channels,
              .values = data.what.values};
    if (data.samples.bytes() > 0 && !data.samples.has_slack()) {
        grid.end = reinterpret_cast<std::uintptr_t>(grid.samples) + data.samples.bytes();
        grid.tail = {.first = grid.end - data.tail.bytes(),
                     .bytes = data.tail.bytes(),
                     .copy = reinterpret_cast<std::uintptr_t>(data.tail.data())};
    }
    if (data.box.empty()) return grid;
    const Extent held = data.box.extent();
    grid.row = held.x;
    grid.slice = held.x * held.y;
    const std::int64_t first =
        data.box.begin[0] + grid.row * data.box.begin[1] + grid.slice * data.box.begin[2];
    // Through an integer: the place may lie outside of what was allocated.
    const auto bytes =
        first * data.what.channels * static_cast<std::int64_t>(bytes_of(data.what.type));
    grid.samples = reinterpret_cast<const void*>(  // NOLINT: see above
        reinterpret_cast<std::uintptr_t>(grid.samples) - static_cast<std::uintptr_t>(bytes));
    return grid;
}

/// The upper three rows of a map between index spaces. It must be affine.
inline Affine affine_of(const Mat4& map) noexcept {
    Affine affine;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) affine[4 * row + column] = map(row, column);
    return affine;
}

}  // namespace edgewise::kernels
