#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "transitions/kernels/spectrum.hpp"
#include "transitions/kernels/spectrum_picture.hpp"
#include "transitions/kernels/spectrum_slice.hpp"

namespace edgewise::kernels {

inline constexpr double kPi = std::numbers::pi;
inline std::pmr::memory_resource* const kMemory = std::pmr::new_delete_resource();

struct PlainVolume {
    Extent extent;
    std::vector<float> samples;

    explicit PlainVolume(const Extent& e) : extent(e), samples(e.samples() + 16) {}
    float& at(std::int64_t x, std::int64_t y, std::int64_t z) {
        return samples[(z * extent.y + y) * extent.x + x];
    }
    float at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return samples[(z * extent.y + y) * extent.x + x];
    }
    Grid grid() const { return {samples.data(), Type::f32, extent, 1, {}}; }
};

/// Seeded noise, 0 within `margin` of the faces.
inline PlainVolume noise(const Extent& extent, std::int64_t margin, unsigned seed = 1) {
    PlainVolume volume(extent);
    std::mt19937 random(seed);
    for (std::int64_t z = margin; z < extent.z - margin; ++z)
        for (std::int64_t y = margin; y < extent.y - margin; ++y)
            for (std::int64_t x = margin; x < extent.x - margin; ++x)
                volume.at(x, y, z) = static_cast<float>(random()) * 0x1p-32f;
    return volume;
}

/// Rz(c) Ry(b) Rx(a) of what `scale` makes of the voxels, the volume's centre put onto (at_x,
/// at_y).
inline Affine turned(const Extent& extent, std::array<double, 3> angles,
                     std::array<double, 3> scale, double at_x, double at_y) {
    const auto [a, b, c] = angles;
    const double rotation[3][3] = {
        {std::cos(c) * std::cos(b),
         std::cos(c) * std::sin(b) * std::sin(a) - std::sin(c) * std::cos(a),
         std::cos(c) * std::sin(b) * std::cos(a) + std::sin(c) * std::sin(a)},
        {std::sin(c) * std::cos(b),
         std::sin(c) * std::sin(b) * std::sin(a) + std::cos(c) * std::cos(a),
         std::sin(c) * std::sin(b) * std::cos(a) - std::cos(c) * std::sin(a)},
        {-std::sin(b), std::cos(b) * std::sin(a), std::cos(b) * std::cos(a)}};
    const double at[3] = {at_x, at_y, 0};
    Affine m{};
    for (int row = 0; row < 3; ++row) {
        m[4 * row + 3] = at[row];
        for (int axis = 0; axis < 3; ++axis) {
            m[4 * row + axis] = rotation[row][axis] * scale[axis];
            m[4 * row + 3] -= m[4 * row + axis] * static_cast<double>(extent[axis] - 1) / 2;
        }
    }
    return m;
}

struct Options {
    int width = 6;
    double padding = 2;
    Between between = Between::spline;
    bool folded = true;
    std::int64_t period = 0;  // of the picture on both axes; 0: the least
    double value = 1;
    std::array<double, 3> derivative{};
};

inline std::vector<Complex> spectrum_of(const PlainVolume& volume, const SpectrumShape& shape) {
    std::vector<Complex> spectrum(shape.stored().samples() + 8);
    spectrum_of_volume(volume.grid(), 0, shape, spectrum.data(), kMemory, {});
    return spectrum;
}

/// Integral along screen z [value x pixel] through the spectrum.
inline std::vector<float> project(const PlainVolume& volume, const Affine& to_screen,
                                  const Extent& picture, const Options& options) {
    const SpectrumShape shape(volume.extent, KaiserBessel(options.width, options.padding));
    const std::vector<Complex> spectrum = spectrum_of(volume, shape);
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (int corner = 0; corner < 8; ++corner) {
        const auto at = apply(to_screen, (corner & 1) * static_cast<double>(volume.extent.x - 1),
                              (corner >> 1 & 1) * static_cast<double>(volume.extent.y - 1),
                              (corner >> 2) * static_cast<double>(volume.extent.z - 1));
        for (int axis = 0; axis < 2; ++axis) {
            low[axis] = std::min(low[axis], at[axis]);
            high[axis] = std::max(high[axis], at[axis]);
        }
    }
    SliceView view;
    view.to_screen = to_screen;
    const auto origin = shape.origin();
    const auto at = apply(to_screen, static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                          static_cast<double>(origin[2]));
    for (int axis = 0; axis < 3; ++axis) view.to_screen[4 * axis + 3] = at[axis];
    view.width = picture_period(picture.x, low[0], high[0]);
    view.height = picture_period(picture.y, low[1], high[1]);
    if (options.period) view.width = view.height = options.period;
    view.between = options.between;
    view.folded = options.folded;
    view.value = options.value;
    view.derivative = options.derivative;
    view.scale = 1 / static_cast<double>(view.width * view.height);
    std::vector<Complex> slice(view.stored().samples());
    const Region all = Region::all(view.stored());
    slice_of_spectrum({spectrum.data(), Type::c64, shape.stored(), 1, {}}, shape.period,
                      shape.window, view, slice.data(), all, all, kMemory, {});
    std::vector<float> pixels(picture.samples());
    picture_of_slice(slice.data(), {view.width, view.height, 1}, picture, pixels.data(), kMemory,
                     {});
    return pixels;
}

inline double nrmse(const std::vector<float>& got, const std::vector<double>& want) {
    double squares = 0, low = want[0], high = want[0];
    for (std::size_t i = 0; i < want.size(); ++i) {
        squares += std::pow(got[i] - want[i], 2);
        low = std::min(low, want[i]);
        high = std::max(high, want[i]);
    }
    return std::sqrt(squares / static_cast<double>(want.size())) / (high - low);
}

/// Cubic B-spline coefficients in f64 of samples that are 0 outside, along one axis of an array:
/// the coefficients are the samples convolved with sqrt(3) (sqrt(3) - 2)^|k|.
inline std::vector<double> coefficients(const PlainVolume& volume) {
    const Extent e = volume.extent;
    std::vector<double> c(volume.samples.begin(), volume.samples.begin() + e.samples());
    const std::int64_t strides[3] = {1, e.x, e.x * e.y};
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> from = c;
        for (std::int64_t i = 0; i < e.samples(); ++i) {
            const std::int64_t here = i / strides[axis] % e[axis];
            c[i] = 0;
            for (std::int64_t k = 0; k < e[axis]; ++k)
                c[i] += from[i + (k - here) * strides[axis]] * std::sqrt(3.) *
                        std::pow(std::sqrt(3.) - 2, std::abs(static_cast<double>(k - here)));
        }
    }
    return c;
}

inline double cubic(double t) {
    t = std::abs(t);
    return t < 1 ? (4 - 6 * t * t + 3 * t * t * t) / 6 : t < 2 ? std::pow(2 - t, 3) / 6 : 0;
}
inline double hat(double t) { return std::max(0., 1 - std::abs(t)); }

inline double field_at(const std::vector<double>& c, const Extent& e,
                       const std::array<double, 3>& p, double (*basis)(double)) {
    double sum = 0;
    const auto base = [](double v) { return static_cast<std::int64_t>(std::floor(v)) - 1; };
    for (std::int64_t z = base(p[2]); z < base(p[2]) + 4; ++z)
        for (std::int64_t y = base(p[1]); y < base(p[1]) + 4; ++y)
            for (std::int64_t x = base(p[0]); x < base(p[0]) + 4; ++x)
                if (x >= 0 && y >= 0 && z >= 0 && x < e.x && y < e.y && z < e.z)
                    sum += c[(z * e.y + y) * e.x + x] * basis(p[0] - static_cast<double>(x)) *
                           basis(p[1] - static_cast<double>(y)) *
                           basis(p[2] - static_cast<double>(z));
    return sum;
}

/// Direct integration along screen z in f64, midpoints 1/8 pixel apart. `back` is screen -> object.
inline std::vector<double> integrated(const std::vector<double>& c, const Extent& e,
                                      const Affine& back, const Extent& picture, double reach,
                                      double (*basis)(double)) {
    std::vector<double> pixels(picture.samples());
    for (std::int64_t y = 0; y < picture.y; ++y)
        for (std::int64_t x = 0; x < picture.x; ++x)
            for (double z = -reach + 1. / 16; z < reach; z += 1. / 8)
                pixels[y * picture.x + x] +=
                    field_at(c, e, apply(back, static_cast<double>(x), static_cast<double>(y), z),
                             basis) /
                    8;
    return pixels;
}

/// The inverse of `turned`.
inline Affine back_of(const Affine& m, const std::array<double, 3>& scale) {
    Affine back{};
    for (int axis = 0; axis < 3; ++axis)
        for (int row = 0; row < 3; ++row) {
            back[4 * axis + row] = m[4 * row + axis] / (scale[axis] * scale[axis]);
            back[4 * axis + 3] -= back[4 * axis + row] * m[4 * row + 3];
        }
    return back;
}

}  // namespace edgewise::kernels
