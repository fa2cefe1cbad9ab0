#pragma once

#include "graph/data.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// The samples of data as kernels read them.
inline Grid grid_of(const Data& data) noexcept {
    return {data.samples.data(), data.what.type, data.what.extent, data.what.channels,
            data.what.values};
}

/// The upper three rows of a map between index spaces. It must be affine.
inline Affine affine_of(const Mat4& map) noexcept {
    Affine affine;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) affine[4 * row + column] = map(row, column);
    return affine;
}

}  // namespace edgewise::kernels
