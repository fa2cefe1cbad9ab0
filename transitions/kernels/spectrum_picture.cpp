#include "transitions/kernels/spectrum_picture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tbb/parallel_for.h>

#include "transitions/kernels/pmr_block.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kLines = 16;  // columns a tile
constexpr double kMargin = 4;        // pixels that ringing and the field's own width may take
constexpr double kParallel =
    1e-12;  // a ray whose step along an axis is smaller [voxel] runs across

/// One tile of columns of the slice, transformed along y; only the picture's rows are kept.
void columns_of_slice(const Complex* slice, const Extent& period, const Extent& picture,
                      std::int64_t first, const Fourier& fourier, Complex* tile, Complex* out) {
    const std::int64_t half = period.x / 2 + 1, lines = std::min(kLines, half - first);
    std::fill_n(tile + lines * period.y, (kLines - lines) * period.y, Complex{});
    for (std::int64_t y = 0; y < period.y; ++y)
        for (std::int64_t l = 0; l < lines; ++l)
            tile[l * period.y + y] = slice[y * half + first + l];
    fourier.run(tile);
    for (std::int64_t y = 0; y < picture.y; ++y)
        for (std::int64_t l = 0; l < lines; ++l) out[y * half + first + l] = tile[l * period.y + y];
}

}  // namespace

std::int64_t picture_period(std::int64_t extent, double from, double to, std::int64_t multiple) {
    const double last = static_cast<double>(extent - 1);
    if (to + kMargin < 0 || from - kMargin > last) return good_length(extent, multiple);  // nothing
    // Repeated one period earlier the volume ends before the picture; one later it begins after.
    const double least = std::max(to + kMargin, last - from + kMargin);
    return good_length(std::max(extent, static_cast<std::int64_t>(std::ceil(least))), multiple);
}

void picture_of_slice(const Complex* slice, const Extent& period, const Extent& picture, float* out,
                      std::pmr::memory_resource* memory, const Stop& stop) {
    const std::int64_t half = period.x / 2 + 1, tiles = (half + kLines - 1) / kLines;
    const Fourier along_y = Fourier::along_lines(period.y, kLines, true);
    const Fourier along_x = Fourier::to_real_row(period.x);
    Block<Complex> rows(picture.y * half, memory);
    tbb::parallel_for(std::int64_t{0}, tiles, [&](std::int64_t t) {
        if (stopped(stop)) return;
        Block<Complex> tile(kLines * period.y, memory);
        columns_of_slice(slice, period, picture, t * kLines, along_y, tile.data(), rows.data());
    });
    tbb::parallel_for(std::int64_t{0}, picture.y, [&](std::int64_t y) {
        if (stopped(stop)) return;
        Block<Complex> line(half, memory);
        Block<float> pixels(period.x, memory);
        std::copy_n(rows.data() + y * half, half, line.data());
        along_x.run(line.data(), pixels.data());
        std::copy_n(pixels.data(), picture.x, out + y * picture.x);
    });
}

double picture_workspace(const Extent& period, const Extent& picture) noexcept {
    return static_cast<double>((period.x / 2 + 1) * picture.y) * sizeof(Complex);
}

double picture_scratch(const Extent& period) noexcept {
    return static_cast<double>(std::max(kLines * period.y, period.x + 16)) * sizeof(Complex);
}

double picture_operations(const Extent& period, const Extent& picture) noexcept {
    return static_cast<double>(period.x / 2 + 1) * fourier_operations(period.y) +
           static_cast<double>(picture.y) * fourier_operations(period.x) / 2;
}

Chord::Chord(const Extent& volume, const Affine& m) {
    // Rows of the adjugate over the determinant: screen -> object space.
    const double det = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                       m[2] * (m[4] * m[9] - m[5] * m[8]);
    const auto minor = [&](int row, int column) {
        const int a = (row + 1) % 3, b = (row + 2) % 3, c = (column + 1) % 3, d = (column + 2) % 3;
        return (m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c]) / det;
    };
    for (int axis = 0; axis < 3; ++axis) {
        per_x_[axis] = minor(0, axis);
        per_y_[axis] = minor(1, axis);
        along_[axis] = minor(2, axis);
        from_[axis] = -(per_x_[axis] * m[3] + per_y_[axis] * m[7] + along_[axis] * m[11]);
        extent_[axis] = static_cast<double>(volume[axis]);
    }
}

double Chord::at(double x, double y) const noexcept {
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = from_[axis] + x * per_x_[axis] + y * per_y_[axis];
        if (std::abs(along_[axis]) < kParallel) {
            if (at < -0.5 || at > extent_[axis] - 0.5) return 0;
            continue;
        }
        const double a = (-0.5 - at) / along_[axis], b = (extent_[axis] - 0.5 - at) / along_[axis];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    return std::max(0., leave - enter);
}

}  // namespace edgewise::kernels
