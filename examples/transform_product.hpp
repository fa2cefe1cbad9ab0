// C = A B as one product of polynomials, by three real Fourier transforms of n^3 places in f64.
//
// A_ik stands at x^(n n i + k) and B_kj at x^(n j - k), so C_ij is the coefficient of
// x^(n (n i + j)): n divides no exponent of the other terms. Exponents count modulo n^3.
// Fewer places will not do, along any number of axes: an Abelian group that keeps the products
// apart has at least n^3 elements (Cohn and Umans 2003, section 3).
#pragma once

#include <fftw3.h>
#include <memory_resource>
#include <type_traits>

#include "matrices.hpp"

namespace edgewise {

inline double transform_operations(int n) {
    const double places = std::pow(n, 3);
    return 3 * 2.5 * places * std::log2(places) + 3 * places;  // a complex product a frequency
}

constexpr double kUnit = 0x1p-53;

/// RMS of the error where the factors' squares sum to `norms`^2 in all: rounding as white noise,
/// which spreads over all places, whatever rows they come from.
inline double transform_noise(int n, double norms) {
    return kUnit * (1 + std::sqrt(3 * std::log2(std::pow(n, 3)))) * norms / std::pow(n, 1.5);
}

/// No value is off by more. A transform is off by 7 u log2(n^3) of its length (Higham 2002, 24.1);
/// the polynomial's length is at most sqrt(2 n) norms.
inline double transform_bound(int n, double norms) {
    const double off = 7 * kUnit * std::log2(std::pow(n, 3));
    return norms * (off * (2 + std::sqrt(2. * n)) + 3 * kUnit);
}

inline void product_by_transform(int n, const double* a, const double* b, double* c,
                                 std::pmr::memory_resource* memory) {
    using FftwPlan = std::unique_ptr<std::remove_pointer_t<fftw_plan>, void (*)(fftw_plan)>;
    const std::int64_t side = n, places = side * side * side, frequencies = places / 2 + 1;
    std::pmr::vector<double> left(std::size_t(2 * frequencies), memory), right(left, memory);
    for (std::int64_t i = 0; i < side; ++i)
        for (std::int64_t k = 0; k < side; ++k) {
            left[std::size_t(side * side * i + k)] = a[side * i + k];
            right[std::size_t((side * i - k + places) % places)] = b[side * k + i];
        }
    auto* spectrum = reinterpret_cast<fftw_complex*>(left.data());
    auto* other = reinterpret_cast<fftw_complex*>(right.data());
    const int length = int(places);
    for (auto* factor : {spectrum, other}) {  // in place
        const FftwPlan there(fftw_plan_dft_r2c_1d(length, factor[0], factor, FFTW_ESTIMATE),
                             fftw_destroy_plan);
        fftw_execute(there.get());
    }
    for (std::int64_t f = 0; f < frequencies; ++f) {
        const double re = spectrum[f][0] * other[f][0] - spectrum[f][1] * other[f][1];
        spectrum[f][1] = spectrum[f][0] * other[f][1] + spectrum[f][1] * other[f][0];
        spectrum[f][0] = re;
    }
    const FftwPlan back(fftw_plan_dft_c2r_1d(length, spectrum, spectrum[0], FFTW_ESTIMATE),
                        fftw_destroy_plan);
    fftw_execute(back.get());
    for (std::int64_t i = 0; i < side * side; ++i)
        c[i] = left[std::size_t(side * i)] / double(places);
}

/// matrix.fourier, for factors of these lengths. Its error is that of rows and columns of length 1.
inline Transition by_transform(int n, const Lengths& of) {
    const double bytes = 16 * (std::pow(n, 3) + 2);
    Transition edge = plain_edge(
        "matrix.fourier", "matrix/factors", matrices<double>("product", n),
        {.operations = transform_operations(n), .streamed = 9 * bytes, .workspace = bytes},
        {.noise = transform_noise(n, of.norms * of.inverse)},
        [n](const Data& in, Data& out, std::pmr::memory_resource* memory) {
            const double* a = in.as<double>();
            product_by_transform(n, a, a + n * n, out.as<double>(), memory);
        });
    if (!std::isfinite(of.norms))
        edge.offer = [](const Representation&, const Ask&, const Parameters&) {
            return Offer::no("not finite: a transform would spread it over all values");
        };
    return edge;
}

}  // namespace edgewise
