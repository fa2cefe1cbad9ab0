#pragma once

#include <array>
#include <cstdint>

namespace edgewise::kernels {

/// So many lines are worked off side by side: value i of line l is at [i * kWaveLines + l].
inline constexpr std::int64_t kWaveLines = 16;
inline constexpr int kWaves = 2;

/// Responses to an impulse n samples ago: the real part of amplitude x pole^n, summed over waves.
struct Waves {
    /// By wave, real and imaginary parts. `settled` is the response to samples of 1 all along,
    /// amplitude / (1 - pole).
    std::array<float, kWaves> pole_real, pole_imaginary, real, imaginary, settled_real,
        settled_imaginary;
};

/// out = the response to all samples up to each one, itself included. Those before the first are
/// equal to it.
void waves_forward(const Waves& waves, const float* in, float* out, std::int64_t n);
/// out += the response to all samples behind each one, itself left out. Those behind the last are
/// equal to it.
void waves_backward(const Waves& waves, const float* in, float* out, std::int64_t n);

}  // namespace edgewise::kernels
