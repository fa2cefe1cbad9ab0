#include "transitions/kernels/spectrum.hpp"

#include <algorithm>
#include <cstring>
#include <tbb/parallel_for.h>
#include <vector>

#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kLines = 16;        // lines a tile: 128 bytes of each row are read together
constexpr std::int64_t kLeastPeriod = 16;  // a window then never meets itself

struct Half {
    std::uint16_t bits;
};

double number(Half stored) { return float_of_half(stored.bits); }
template <class T>
double number(T stored) {
    return static_cast<double>(stored);
}

template <class T>
void load(const T* stored, std::int64_t n, double slope, double offset, const float* weights,
          float scale, float* out) {
    for (std::int64_t i = 0; i < n; ++i)
        out[i] = static_cast<float>(slope * number(stored[i]) + offset) * (weights[i] * scale);
}

/// (value - subtract) x weights x scale of n samples from the given one on.
void load_row(const Grid& volume, std::int64_t first, std::int64_t n, double subtract,
              const float* weights, float scale, float* out) {
    const auto load_as = [&](auto zero) {
        load(volume.as<decltype(zero)>() + first, n, volume.values.slope,
             volume.values.offset - subtract, weights, scale, out);
    };
    switch (volume.type) {
        case Type::u8:
            return load_as(std::uint8_t{});
        case Type::i8:
            return load_as(std::int8_t{});
        case Type::u16:
            return load_as(std::uint16_t{});
        case Type::i16:
            return load_as(std::int16_t{});
        case Type::u32:
            return load_as(std::uint32_t{});
        case Type::i32:
            return load_as(std::int32_t{});
        case Type::f16:
            return load_as(Half{});
        case Type::f64:
            return load_as(double{});
        case Type::f32:
        case Type::c64:
            return load_as(float{});  // complex volumes never get here
    }
}

/// 1 / transform of the window at each voxel of an axis.
std::vector<float> weights_along(const SpectrumShape& shape, int axis) {
    std::vector<float> weights(shape.volume[axis]);
    const auto period = static_cast<double>(shape.period[axis]);
    for (std::int64_t i = 0; i < shape.volume[axis]; ++i) {
        const auto x = static_cast<double>(i - shape.origin()[axis]);
        weights[i] = static_cast<float>(1 / shape.window.transform(x / period));
    }
    return weights;
}

/// Where voxel i of an axis stands in the period, which begins at the origin voxel.
std::int64_t wrapped(const SpectrumShape& shape, int axis, std::int64_t i) {
    const std::int64_t at = i - shape.origin()[axis];
    return at < 0 ? at + shape.period[axis] : at;
}

struct Strides {
    std::int64_t row, plane;
};

Strides strides_of(const SpectrumShape& shape) {
    const Extent stored = shape.stored();
    return {stored.x, stored.x * stored.y};
}

/// The rows of one plane of voxels: weighted, put around the origin, transformed along x.
void rows_of_plane(const Grid& volume, double subtract, const SpectrumShape& shape,
                   const std::vector<float> (&weights)[3], const Fourier& fourier, std::int64_t k,
                   Complex* out, std::pmr::memory_resource* memory) {
    const auto [row, plane] = strides_of(shape);
    const std::int64_t n = shape.volume.x, period = shape.period.x, half = period / 2 + 1;
    const std::int64_t before = shape.origin()[0];
    Block<float> line(period, memory);
    Block<Complex> spectrum(half, memory);
    std::fill_n(line.data(), period, 0.f);
    for (std::int64_t j = 0; j < shape.volume.y; ++j) {
        const std::int64_t first = (k * shape.volume.y + j) * n;
        const float scale = weights[1][j] * weights[2][k];
        load_row(volume, first, before, subtract, weights[0].data(), scale,
                 line.data() + period - before);
        load_row(volume, first + before, n - before, subtract, weights[0].data() + before, scale,
                 line.data());
        Complex* to = out + wrapped(shape, 2, k) * plane + wrapped(shape, 1, j) * row +
                      SpectrumShape::kColumnsBefore;
        const bool there = Fourier::takes(to);
        fourier.run(line.data(), there ? to : spectrum.data());
        if (!there) std::copy_n(spectrum.data(), half, to);
    }
}

/// Two complex samples, moved as two numbers of 64 bits.
typedef double Two __attribute__((vector_size(16)));

Two load_two(const Complex* from) {
    Two both;
    std::memcpy(&both, from, sizeof(both));
    return both;
}

void store(Two both, Complex* to) { std::memcpy(static_cast<void*>(to), &both, sizeof(both)); }

/// Two samples of each of two lines, from side by side to one behind the other or back.
void turn_two(const Complex* from, std::int64_t from_step, Complex* to, std::int64_t to_step) {
    const Two a = load_two(from), b = load_two(from + from_step);
    store(Two{a[0], b[0]}, to);
    store(Two{a[1], b[1]}, to + to_step);
}

// Samples of lines that lie side by side are far from each other, `stride` samples: both ways go
// through them once, two by two, which takes half of the loads and stores.

/// Samples first to last of lines side by side -> one line behind the other.
void gather_lines(const Complex* from, std::int64_t stride, std::int64_t lines, std::int64_t first,
                  std::int64_t last, Complex* tile, std::int64_t period) {
    std::int64_t i = first;
    for (; i + 1 < last; i += 2) {
        const Complex* row = from + i * stride;
        std::int64_t l = 0;
        for (; l + 1 < lines; l += 2) turn_two(row + l, stride, tile + l * period + i, period);
        if (l < lines) tile[l * period + i] = row[l], tile[l * period + i + 1] = row[stride + l];
    }
    if (i < last)
        for (std::int64_t l = 0; l < lines; ++l) tile[l * period + i] = from[i * stride + l];
}

/// The way back, of all samples; asks for those of the next lines, which no processor foresees.
void scatter_lines(const Complex* tile, std::int64_t period, std::int64_t lines, Complex* to,
                   std::int64_t stride) {
    std::int64_t i = 0;
    for (; i + 1 < period; i += 2) {
        Complex* row = to + i * stride;
        for (std::int64_t ahead = kLines; ahead <= 2 * kLines; ahead += kLines / 2) {
            __builtin_prefetch(row + ahead, 1);
            __builtin_prefetch(row + stride + ahead, 1);
        }
        std::int64_t l = 0;
        for (; l + 1 < lines; l += 2) turn_two(tile + l * period + i, period, row + l, stride);
        if (l < lines) row[l] = tile[l * period + i], row[stride + l] = tile[l * period + i + 1];
    }
    if (i < period)
        for (std::int64_t l = 0; l < lines; ++l) to[i * stride + l] = tile[l * period + i];
}

/// Transforms of kLines lines, and of those that are left over.
struct Lines {
    std::int64_t period, extent;  // of which samples around both ends of the period were written
    Fourier many, rest;

    Lines(const SpectrumShape& shape, int axis)
        : period(shape.period[axis]),
          extent(shape.volume[axis]),
          many(Fourier::along_lines(period, kLines, false)),
          rest(Fourier::along_lines(period, left_over(shape), false)) {}
    static std::int64_t left_over(const SpectrumShape& shape) {
        return std::max<std::int64_t>(1, (shape.period.x / 2 + 1) % kLines);
    }
};

/// Transforms the columns of a slab of lines `stride` apart; the samples that were not written
/// count as 0.
void transform_lines(Complex* first, std::int64_t columns, std::int64_t stride, const Lines& lines,
                     Complex* tile) {
    const std::int64_t period = lines.period, after = lines.extent - lines.extent / 2,
                       before = period - lines.extent / 2;
    for (std::int64_t column = 0; column < columns; column += kLines) {
        const std::int64_t many = std::min(kLines, columns - column);
        Complex* here = first + column;
        gather_lines(here, stride, many, 0, after, tile, period);
        for (std::int64_t l = 0; l < many; ++l)
            std::fill(tile + l * period + after, tile + l * period + before, Complex{});
        gather_lines(here, stride, many, before, period, tile, period);
        (many == kLines ? lines.many : lines.rest).run(tile);
        scatter_lines(tile, period, many, here, stride);
    }
}

/// Fills the columns beyond both ends of the half spectrum: F(-k) is the conjugate of F(k).
void repeat_columns(const SpectrumShape& shape, std::int64_t k, Complex* out) {
    const auto [row, plane] = strides_of(shape);
    const std::int64_t half = shape.period.x / 2;
    const std::int64_t opposite_plane = (shape.period.z - k) % shape.period.z;
    for (std::int64_t j = 0; j < shape.period.y; ++j) {
        const std::int64_t opposite_row = (shape.period.y - j) % shape.period.y;
        Complex* to = out + k * plane + j * row + SpectrumShape::kColumnsBefore;
        const Complex* from =
            out + opposite_plane * plane + opposite_row * row + SpectrumShape::kColumnsBefore;
        for (std::int64_t i = 1; i <= SpectrumShape::kColumnsBefore; ++i)
            to[-i] = std::conj(from[i]);
        for (std::int64_t i = 1; i <= SpectrumShape::kColumnsAfter; ++i)
            to[half + i] = std::conj(from[half - i]);
    }
}

}  // namespace

SpectrumShape::SpectrumShape(const Extent& volume_, const KaiserBessel& window_)
    : volume(volume_), window(window_) {
    for (int axis = 0; axis < 3; ++axis) {
        const double least = window.padding() * static_cast<double>(volume[axis]);
        period[axis] = good_length(std::max(kLeastPeriod, static_cast<std::int64_t>(least + 0.999)),
                                   axis == 0 ? 2 : 1);
    }
}

Extent SpectrumShape::stored_of(const Extent& period) noexcept {
    return {period.x / 2 + 1 + kColumnsBefore + kColumnsAfter, period.y, period.z};
}

Extent SpectrumShape::period_of(const Extent& stored) noexcept {
    return {2 * (stored.x - 1 - kColumnsBefore - kColumnsAfter), stored.y, stored.z};
}

void spectrum_of_volume(const Grid& volume, double subtract, const SpectrumShape& shape,
                        Complex* out, std::pmr::memory_resource* memory, const Stop& stop) {
    const auto [row, plane] = strides_of(shape);
    const std::int64_t half = shape.period.x / 2 + 1;
    const std::vector<float> weights[3] = {weights_along(shape, 0), weights_along(shape, 1),
                                           weights_along(shape, 2)};
    const Fourier along_x = Fourier::real_row(shape.period.x);
    const Lines along_y(shape, 1), along_z(shape, 2);

    tbb::parallel_for(
        std::int64_t{0}, shape.volume.z, [&, plane = plane, row = row](std::int64_t k) {
            if (stopped(stop)) return;
            rows_of_plane(volume, subtract, shape, weights, along_x, k, out, memory);
            Block<Complex> tile(kLines * shape.period.y, memory);
            transform_lines(out + wrapped(shape, 2, k) * plane + SpectrumShape::kColumnsBefore,
                            half, row, along_y, tile.data());
        });
    tbb::parallel_for(std::int64_t{0}, shape.period.y,
                      [&, plane = plane, row = row](std::int64_t j) {
                          if (stopped(stop)) return;
                          Block<Complex> tile(kLines * shape.period.z, memory);
                          transform_lines(out + j * row + SpectrumShape::kColumnsBefore, half,
                                          plane, along_z, tile.data());
                      });
    tbb::parallel_for(std::int64_t{0}, shape.period.z, [&](std::int64_t k) {
        if (!stopped(stop)) repeat_columns(shape, k, out);
    });
}

double spectrum_scratch(const SpectrumShape& shape) noexcept {
    const auto longest = static_cast<double>(std::max(shape.period.y, shape.period.z));
    const auto x = static_cast<double>(shape.period.x);
    return std::max(kLines * longest * sizeof(Complex), 3. * x * sizeof(float) + 256) + 256;
}

double spectrum_operations(const SpectrumShape& shape) noexcept {
    const auto nx = static_cast<double>(shape.volume.x), ny = static_cast<double>(shape.volume.y),
               nz = static_cast<double>(shape.volume.z);
    const auto half = static_cast<double>(shape.period.x / 2 + 1),
               rows = static_cast<double>(shape.period.y);
    return 4 * nx * ny * nz + ny * nz * fourier_operations(shape.period.x) / 2 +
           nz * half * fourier_operations(shape.period.y) +
           rows * half * fourier_operations(shape.period.z);
}

}  // namespace edgewise::kernels
