#include "transitions/project/sliced_samples.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <tbb/parallel_for.h>

#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

/// Samples whose rows are columns of slices across x.
Array turned_to_rows(const kernels::Grid& grid, Context& context) {
    const kernels::AxisPermutation turned =
        kernels::into_place({.from = {1, 2, 0}, .sign = {1, 1, 1}}, grid.extent);
    const Extent n = kernels::permuted_extent(turned, grid.extent);
    const std::size_t bytes = bytes_of(grid.type);
    Array copy(bytes * static_cast<std::size_t>(n.samples()), context.memory);
    const std::array<std::byte, 16> beyond{};
    // Blocks of the output's last axis, which rows of the input become.
    constexpr std::int64_t kRows = 64;
    const std::int64_t blocks = (n.z + kRows - 1) / kRows;
    tbb::parallel_for(std::int64_t{0}, blocks * n.y, [&](std::int64_t i) {
        if (context.stopped()) return;
        Region part = Region::all(n);
        part.begin[2] = i % blocks * kRows;
        part.end[2] = std::min(part.begin[2] + kRows, n.z);
        part.begin[1] = i / blocks;
        part.end[1] = part.begin[1] + 1;
        kernels::copy_permuted(grid, bytes, turned, beyond.data(), copy.data(), Region::all(n),
                               part);
    });
    context.poll();
    return copy;
}

}  // namespace

SlicedSamples::SlicedSamples(const Data& in, const Request& want, int axis, const Array& turned)
    : grid_(rule_grid(in, want)) {
    if (axis == 1) {
        const std::int64_t row = grid_.slice_step(), slice = grid_.row_step();
        grid_.extent = extent_of(grid_.extent, axis);
        grid_.row = row;
        grid_.slice = slice;
    } else if (axis == 0 && turned.bytes() > 0) {
        take_turned(turned);
    }
}

SlicedSamples::SlicedSamples(const Data& in, const Request& want, int axis, Context& context)
    : SlicedSamples(in, want, axis, Array()) {
    if (axis == 0) take_turned(turned_to_rows(grid_, context));
}

void SlicedSamples::take_turned(const Array& turned) {
    turned_ = turned.shared();
    grid_.samples = turned_.data();
    grid_.extent = extent_of(grid_.extent, 0);
    grid_.row = grid_.slice = 0;
    grid_.end = 0;
    grid_.tail = {};
}

Extent SlicedSamples::extent_of(const Extent& data, int axis) {
    if (axis == 0) return {data.y, data.z, data.x};
    return axis == 1 ? Extent{data.x, data.z, data.y} : data;
}

kernels::Grid SlicedSamples::from(std::int64_t first, std::int64_t count) const {
    kernels::Grid part = grid_;
    part.row = grid_.row_step();
    part.slice = grid_.slice_step();
    part.extent.z = count;
    part.samples = grid_.as<std::byte>() +
                   first * part.slice * static_cast<std::int64_t>(bytes_of(grid_.type));
    return part;
}

}  // namespace edgewise
