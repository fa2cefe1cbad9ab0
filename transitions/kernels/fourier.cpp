#include "transitions/kernels/fourier.hpp"

#include <cmath>
#include <fftw3.h>
#include <mutex>
#include <new>

namespace edgewise::kernels {
namespace {

std::mutex& planner_lock() {
    static std::mutex lock;
    return lock;
}

bool is_smooth(std::int64_t n) {
    for (std::int64_t prime : {2, 3, 5, 7})
        while (n % prime == 0) n /= prime;
    return n == 1;
}

/// An array of FFTW's alignment, for planning only.
template <class T>
struct Blank {
    explicit Blank(std::int64_t n)
        : data(static_cast<T*>(fftwf_malloc(sizeof(T) * static_cast<std::size_t>(n)))) {
        if (!data) throw std::bad_alloc();
    }
    ~Blank() { fftwf_free(data); }
    Blank(const Blank&) = delete;
    Blank& operator=(const Blank&) = delete;
    T* data;
};

fftwf_complex* fftw(Complex* samples) { return reinterpret_cast<fftwf_complex*>(samples); }

}  // namespace

std::int64_t good_length(std::int64_t n, std::int64_t multiple) {
    std::int64_t length = (n + multiple - 1) / multiple * multiple;
    while (!is_smooth(length)) length += multiple;
    return length;
}

double fourier_operations(std::int64_t n) noexcept {
    return n > 1 ? 5. * static_cast<double>(n) * std::log2(static_cast<double>(n)) : 0;
}

Fourier::Fourier(fftwf_plan_s* plan) : plan_(plan) {
    if (!plan) throw std::bad_alloc();  // the only way in which these plans fail
}

void Fourier::Destroy::operator()(fftwf_plan_s* plan) const {
    const std::lock_guard lock(planner_lock());
    fftwf_destroy_plan(plan);
}

Fourier Fourier::along_lines(std::int64_t n, std::int64_t lines, bool inverse) {
    const int length = static_cast<int>(n), count = static_cast<int>(lines);
    const std::lock_guard lock(planner_lock());
    const Blank<fftwf_complex> tile(n * lines);
    return Fourier(fftwf_plan_many_dft(1, &length, count, tile.data, nullptr, 1, length, tile.data,
                                       nullptr, 1, length, inverse ? FFTW_BACKWARD : FFTW_FORWARD,
                                       FFTW_ESTIMATE));
}

Fourier Fourier::real_row(std::int64_t n) {
    const std::lock_guard lock(planner_lock());
    const Blank<float> in(n);
    const Blank<fftwf_complex> out(n / 2 + 1);
    return Fourier(fftwf_plan_dft_r2c_1d(static_cast<int>(n), in.data, out.data,
                                         FFTW_ESTIMATE | FFTW_PRESERVE_INPUT));
}

Fourier Fourier::to_real_row(std::int64_t n) {
    const std::lock_guard lock(planner_lock());
    const Blank<fftwf_complex> in(n / 2 + 1);
    const Blank<float> out(n);
    return Fourier(fftwf_plan_dft_c2r_1d(static_cast<int>(n), in.data, out.data, FFTW_ESTIMATE));
}

Fourier Fourier::real_box(const Extent& n) {
    const int lengths[] = {static_cast<int>(n.z), static_cast<int>(n.y), static_cast<int>(n.x)};
    const std::lock_guard lock(planner_lock());
    const Blank<float> in(n.samples());
    const Blank<fftwf_complex> out((n.x / 2 + 1) * n.y * n.z);
    return Fourier(
        fftwf_plan_dft_r2c(3, lengths, in.data, out.data, FFTW_ESTIMATE | FFTW_PRESERVE_INPUT));
}

Fourier Fourier::to_real_box(const Extent& n) {
    const int lengths[] = {static_cast<int>(n.z), static_cast<int>(n.y), static_cast<int>(n.x)};
    const std::lock_guard lock(planner_lock());
    const Blank<fftwf_complex> in((n.x / 2 + 1) * n.y * n.z);
    const Blank<float> out(n.samples());
    return Fourier(fftwf_plan_dft_c2r(3, lengths, in.data, out.data, FFTW_ESTIMATE));
}

bool Fourier::takes(const Complex* samples) noexcept {
    auto* at = const_cast<float*>(reinterpret_cast<const float*>(samples));
    return fftwf_alignment_of(at) == 0;  // as of fftwf_malloc, with which all are planned
}

void Fourier::run(Complex* tile) const { fftwf_execute_dft(plan_.get(), fftw(tile), fftw(tile)); }

void Fourier::run(const float* in, Complex* out) const {
    fftwf_execute_dft_r2c(plan_.get(), const_cast<float*>(in), fftw(out));
}

void Fourier::run(Complex* in, float* out) const {
    fftwf_execute_dft_c2r(plan_.get(), fftw(in), out);
}

}  // namespace edgewise::kernels
