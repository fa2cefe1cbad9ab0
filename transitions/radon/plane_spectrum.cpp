#include "transitions/radon/plane_spectrum.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace edgewise {
namespace {

kernels::KaiserBessel window_of_plane() { return {PlaneSpectrum::kWidth, PlaneSpectrum::kPadding}; }

std::size_t frequencies_of(const Extent& period) noexcept {
    return static_cast<std::size_t>((period.x / 2 + 1) * period.y);
}

/// What divides samples along an axis: the window's transform.
std::vector<double> fading(std::int64_t n, std::int64_t period) {
    const kernels::KaiserBessel window = window_of_plane();
    std::vector<double> by;
    for (std::int64_t i = 0; i < n; ++i)
        by.push_back(
            1 / window.transform(static_cast<double>(i - n / 2) / static_cast<double>(period)));
    return by;
}

std::int64_t wrapped(std::int64_t i, std::int64_t n) noexcept {
    const std::int64_t rest = i % n;
    return rest < 0 ? rest + n : rest;
}

/// Taps of the window around a place in the spectrum.
struct TapsAt {
    std::int64_t first;
    std::array<float, PlaneSpectrum::kWidth> weights;

    TapsAt(double at, const kernels::TapTable& table) noexcept {
        const double below = std::floor(at);
        first = static_cast<std::int64_t>(below) - PlaneSpectrum::kWidth / 2 + 1;
        const double place = (at - below) * kernels::TapTable::kFractions;
        const int row = std::min(static_cast<int>(place), kernels::TapTable::kFractions - 1);
        const auto between = static_cast<float>(place - row);
        const float* taps = table.taps.data() + row * kernels::TapTable::kMostTaps;
        for (int i = 0; i < PlaneSpectrum::kWidth; ++i)
            weights[static_cast<std::size_t>(i)] =
                taps[i] + between * (taps[i + kernels::TapTable::kMostTaps] - taps[i]);
    }
};

}  // namespace

Extent PlaneSpectrum::period_of(const Extent& input) noexcept {
    constexpr std::int64_t kLeast = 8;
    const auto padded = [&](std::int64_t n) {
        return std::max(kLeast, static_cast<std::int64_t>(kPadding) * n);
    };
    return {kernels::good_length(padded(input.x), 2), kernels::good_length(padded(input.y)), 1};
}

double PlaneSpectrum::bytes(const Extent& input) noexcept {
    const Extent period = period_of(input);
    return static_cast<double>(frequencies_of(period)) * sizeof(kernels::Complex) +
           static_cast<double>(period.samples()) * sizeof(float);
}

PlaneSpectrum::PlaneSpectrum(const Extent& input, const RadonPlane& plane,
                             std::pmr::memory_resource* memory)
    : period_(period_of(input)),
      row_(period_.x / 2 + 1),
      block_(frequencies_of(period_), memory),
      samples_(block_.data()),
      taps_(kernels::TapTable::of(window_of_plane())) {
    const auto n = static_cast<std::size_t>(period_.samples());
    kernels::Block<float> padded(n, memory);
    std::fill_n(padded.data(), n, 0.0f);
    const std::vector<double> across = fading(input.x, period_.x),
                              down = fading(input.y, period_.y);
    for (std::int64_t y = 0; y < input.y; ++y) {
        float* to = padded.data() + period_.x * wrapped(y - input.y / 2, period_.y);
        for (std::int64_t x = 0; x < input.x; ++x)
            to[wrapped(x - input.x / 2, period_.x)] =
                static_cast<float>(plane.row(y)[x] * across[static_cast<std::size_t>(x)] *
                                   down[static_cast<std::size_t>(y)]);
    }
    kernels::Fourier::real_box(period_).run(padded.data(), block_.data());
}

std::complex<double> PlaneSpectrum::at(double fx, double fy) const noexcept {
    // Into the half that is stored: samples are real.
    fx -= std::round(fx), fy -= std::round(fy);
    const bool other_half = fx < 0;
    if (other_half) fx = -fx, fy = -fy;
    const TapsAt x(fx * static_cast<double>(period_.x), taps_),
        y(fy * static_cast<double>(period_.y), taps_);
    float real = 0, imaginary = 0;
    const bool inside = x.first >= 0 && x.first + kWidth <= row_;
    // Taps are less than a period away.
    const auto within = [](std::int64_t i, std::int64_t n) { return i < 0 ? i + n : i; };
    for (int j = 0; j < kWidth; ++j) {
        const std::int64_t ky = within(y.first + j, period_.y);
        const kernels::Complex* row = samples_ + row_ * ky;
        const kernels::Complex* mirrored = samples_ + row_ * (ky == 0 ? 0 : period_.y - ky);
        float re = 0, im = 0;
        if (inside) {
            for (int i = 0; i < kWidth; ++i) {
                re += x.weights[i] * row[x.first + i].real();
                im += x.weights[i] * row[x.first + i].imag();
            }
        } else {
            for (int i = 0; i < kWidth; ++i) {
                const std::int64_t kx = within(x.first + i, period_.x);
                const bool stored = kx < row_;
                const kernels::Complex sample = stored ? row[kx] : mirrored[period_.x - kx];
                re += x.weights[i] * sample.real();
                im += x.weights[i] * (stored ? sample.imag() : -sample.imag());
            }
        }
        real += y.weights[j] * re;
        imaginary += y.weights[j] * im;
    }
    return {real, other_half ? -imaginary : imaginary};
}

}  // namespace edgewise
