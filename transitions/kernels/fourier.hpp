#pragma once

#include <complex>
#include <cstdint>
#include <memory>

#include "graph/samples.hpp"

struct fftwf_plan_s;

namespace edgewise::kernels {

using Complex = std::complex<float>;

/// Smallest length >= n that is a multiple of `multiple` (1, 2 or 4) with no prime factor above 7:
/// lengths that FFTW has hard-coded steps for
std::int64_t good_length(std::int64_t n, std::int64_t multiple = 1);

/// Operations of a complex transform of length n: 5 n log2 n, FFTW's convention; a real one takes
/// half.
double fourier_operations(std::int64_t n) noexcept;

/// A planned transform, in f32 and not normalised. Planning takes a lock (FFTW's planner is not
/// thread-safe) and estimates, so equal lengths give equal bytes in every process; running needs no
/// lock. Threads share a plan and run it on arrays of their own.
class Fourier {
 public:
    /// Complex lines in place, one behind the other: sample i of line l is tile[l * n + i]. Tiles
    /// lie aligned to 64 bytes.
    static Fourier along_lines(std::int64_t n, std::int64_t lines, bool inverse);
    /// n real samples -> n / 2 + 1 complex ones; the input is kept. Both aligned to 64 bytes.
    static Fourier real_row(std::int64_t n);
    /// n / 2 + 1 complex samples -> n real ones; the input is overwritten. Both aligned.
    static Fourier to_real_row(std::int64_t n);

    /// Real samples of a box, x fastest -> n.x / 2 + 1 complex ones a row. Both aligned.
    static Fourier real_box(const Extent& n);
    /// The way back; the input is overwritten. Both aligned.
    static Fourier to_real_box(const Extent& n);

    /// Whether a plan may run on samples from here on, though they do not begin at 64 bytes.
    static bool takes(const Complex* samples) noexcept;
    void run(Complex* tile) const;
    void run(const float* in, Complex* out) const;
    void run(Complex* in, float* out) const;

 private:
    struct Destroy {
        void operator()(fftwf_plan_s* plan) const;
    };
    explicit Fourier(fftwf_plan_s* plan);
    std::unique_ptr<fftwf_plan_s, Destroy> plan_;
};

}  // namespace edgewise::kernels
