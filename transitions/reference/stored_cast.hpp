#pragma once

// Rays through the stored numbers themselves, without lattices and blocks: cheap enough for a
// thousand rays where it is only to be known which of them to look at more closely.

#include <algorithm>
#include <array>
#include <cmath>

#include "transitions/reference/answer.hpp"
#include "transitions/reference/stored.hpp"

namespace edgewise {

/// The nearest sample, channel 0, mapped; beyond the outermost samples these.
template <class T>
class NearestStored {
 public:
    explicit NearestStored(const Data& data) : data_(data), stored_(data.as<T>()) {}

    double operator()(const Vec3& p) const {
        const Extent& n = data_.what.extent;
        std::int64_t at = 0;
        for (int axis = data_.what.axes - 1; axis >= 0; --axis)
            at = at * n[axis] + std::clamp<std::int64_t>(std::llround(p[axis]), 0, n[axis] - 1);
        return data_.what.values(as_double(stored_[at * data_.what.channels]));
    }

 private:
    const Data& data_;
    const T* stored_;
};

/// As NearestStored, linear between samples.
template <class T>
class LinearStored {
 public:
    explicit LinearStored(const Data& data) : data_(data), stored_(data.as<T>()) {
        std::int64_t stride = data.what.channels;
        for (int axis = 0; axis < 3; ++axis) {
            stride_[axis] = axis < data.what.axes ? stride : 0;
            stride *= data.what.extent[axis];
        }
    }

    double operator()(const Vec3& p) const {
        std::int64_t low = 0;
        std::array<std::int64_t, 3> step{};
        std::array<double, 3> f{};
        for (int axis = 0; axis < data_.what.axes; ++axis) {
            const std::int64_t last = data_.what.extent[axis] - 1;
            const double at = std::clamp(p[axis], 0.0, static_cast<double>(last));
            const auto cell = static_cast<std::int64_t>(at);  // the floor: not negative
            f[axis] = at - static_cast<double>(cell);
            low += cell * stride_[axis];
            step[axis] = cell < last ? stride_[axis] : 0;
        }
        const auto along = [&](std::int64_t at) {
            const double a = as_double(stored_[at]), b = as_double(stored_[at + step[0]]);
            return a + f[0] * (b - a);
        };
        const auto across = [&](std::int64_t at) {
            const double a = along(at), b = along(at + step[1]);
            return a + f[1] * (b - a);
        };
        const double a = across(low), b = across(low + step[2]);
        return data_.what.values(a + f[2] * (b - a));
    }

 private:
    const Data& data_;
    const T* stored_;
    std::array<std::int64_t, 3> stride_{};
};

}  // namespace edgewise
