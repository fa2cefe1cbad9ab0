// The numbers behind backprojection.cpp: what becomes of samples, and nothing of edges or plans.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory_resource>

#include "graph/data.hpp"
#include "transitions/kernels/fourier.hpp"

namespace edgewise::tomography {

using kernels::Complex, kernels::Fourier;

constexpr int kSide = 255, kLine = 363;                 // of the image; of X-rays: its diagonal
constexpr int kAngles = 384;                            // directions of X-rays in half a turn
constexpr int kPeriod = 2048, kHalf = kPeriod / 2 + 1;  // of a line's spectrum, much padded
constexpr int kGrid = 512, kColumns = kGrid / 2 + 1;    // of the image's spectrum
constexpr double kPi = 3.14159265358979323846;

/// Of the phantom: a normal distribution, whose X-rays are ones too.
struct Blob {
    double x, y, width, height;

    double image(double px, double py) const { return height * normal(std::hypot(px - x, py - y)); }
    double line(double angle, double s) const {
        const double centre = x * std::cos(angle) + y * std::sin(angle);
        return height * width * std::sqrt(2 * kPi) * normal(s - centre);
    }
    double normal(double distance) const {
        return std::exp(-distance * distance / (2 * width * width));
    }
};
constexpr Blob kBlobs[] = {{0, 0, 30, .6}, {-40, 20, 6, .4}, {35, -30, 8, .3}, {20, 45, 10, -.3}};

/// The middle of n samples goes to place 0 of a period, so that spectra need no phases.
inline int wrapped(int place, int n, int period) { return (place - n / 2 + period) % period; }

/// The ramp |frequency|, as a filter of samples (Ramachandran and Lakshminarayanan 1971).
inline void convolve(const Data& in, Data& out, std::pmr::memory_resource*) {
    for (int i = 0; i < kAngles * kLine; ++i) {
        const float* line = in.as<float>() + i / kLine * kLine;
        const int s = i % kLine;
        double sum = line[s] / 4;
        for (int t = 1 - s % 2; t < kLine; t += 2) sum -= line[t] / (kPi * kPi * (s - t) * (s - t));
        out.as<float>()[i] = static_cast<float>(sum);
    }
}

/// Each pixel is the sum over all directions of the filtered line, where the pixel projects to.
inline void backproject(const Data& in, Data& out, std::pmr::memory_resource*) {
    std::fill_n(out.as<float>(), kSide * kSide, 0.f);
    for (int a = 0; a < kAngles; ++a) {
        const float* line = in.as<float>() + a * kLine;
        const double cosine = std::cos(kPi * a / kAngles), sine = std::sin(kPi * a / kAngles);
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const double s = kLine / 2 + (x - kSide / 2) * cosine + (y - kSide / 2) * sine;
                const int left = static_cast<int>(s);
                const float between = static_cast<float>(s - left);
                out.as<float>()[y * kSide + x] +=
                    line[left] + between * (line[left + 1] - line[left]);
            }
    }
    for (int i = 0; i < kSide * kSide; ++i) out.as<float>()[i] *= static_cast<float>(kPi / kAngles);
}

/// The spectrum of each line.
inline void transform(const Data& in, Data& out, std::pmr::memory_resource* memory) {
    const Fourier fourier = Fourier::real_row(kPeriod);
    Array padded(kPeriod * sizeof(float), memory), spectrum(kHalf * sizeof(Complex), memory);
    float* line = static_cast<float*>(padded.data());
    for (int a = 0; a < kAngles; ++a) {
        std::fill_n(line, kPeriod, 0.f);
        for (int s = 0; s < kLine; ++s)
            line[wrapped(s, kLine, kPeriod)] = in.as<float>()[a * kLine + s];
        fourier.run(line, static_cast<Complex*>(spectrum.data()));
        std::copy_n(static_cast<Complex*>(spectrum.data()), kHalf, out.as<Complex>() + a * kHalf);
    }
}

/// Filters by the ramp in the spectrum.
inline void ramp(const Data& in, Data& out, std::pmr::memory_resource* memory) {
    const Fourier fourier = Fourier::to_real_row(kPeriod);
    Array spectrum(kHalf * sizeof(Complex), memory), padded(kPeriod * sizeof(float), memory);
    auto* values = static_cast<Complex*>(spectrum.data());
    for (int a = 0; a < kAngles; ++a) {
        for (int k = 0; k < kHalf; ++k)  // a transform forth and back is kPeriod times the line
            values[k] = in.as<Complex>()[a * kHalf + k] * (float(k) / kPeriod / kPeriod);
        fourier.run(values, static_cast<float*>(padded.data()));
        for (int s = 0; s < kLine; ++s)
            out.as<float>()[a * kLine + s] =
                static_cast<const float*>(padded.data())[wrapped(s, kLine, kPeriod)];
    }
}

/// Slice theorem (Bracewell 1956): spectra of lines are the image's spectrum along rays from its
/// origin. It is interpolated from them, linearly in angle and radius.
inline void to_grid(const Data& in, Data& out, std::pmr::memory_resource*) {
    const auto at = [&](int a, int k) {  // angles below 0: the other end of a line, conjugate
        const Complex value = in.as<Complex>()[(a + kAngles) % kAngles * kHalf + k];
        return a < 0 ? std::conj(value) : value;
    };
    for (int i = 0; i < kGrid * kColumns; ++i) {
        const int x = i % kColumns, y = (i / kColumns + kGrid / 2) % kGrid - kGrid / 2;
        const double radius = std::hypot(x, y) * kPeriod / kGrid;
        const double angle = std::atan2(y, x) * kAngles / kPi;
        const int a = static_cast<int>(std::floor(angle)), k = static_cast<int>(radius);
        const float da = static_cast<float>(angle - a), dk = static_cast<float>(radius - k);
        out.as<Complex>()[i] = k + 1 >= kHalf
                                   ? Complex()
                                   : (1 - da) * ((1 - dk) * at(a, k) + dk * at(a, k + 1)) +
                                         da * ((1 - dk) * at(a + 1, k) + dk * at(a + 1, k + 1));
    }
}

/// The image of a spectrum.
inline void invert(const Data& in, Data& out, std::pmr::memory_resource* memory) {
    Array spectrum(kGrid * kColumns * sizeof(Complex), memory);
    Array periodic(kGrid * kGrid * sizeof(float), memory);
    std::copy_n(in.as<Complex>(), kGrid * kColumns, static_cast<Complex*>(spectrum.data()));
    Fourier::to_real_box({kGrid, kGrid, 1})
        .run(static_cast<Complex*>(spectrum.data()), static_cast<float*>(periodic.data()));
    for (int i = 0; i < kSide * kSide; ++i) {
        const int from =
            wrapped(i / kSide, kSide, kGrid) * kGrid + wrapped(i % kSide, kSide, kGrid);
        out.as<float>()[i] = static_cast<const float*>(periodic.data())[from] / (kGrid * kGrid);
    }
}

}  // namespace edgewise::tomography
