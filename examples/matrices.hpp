// What the examples of a matrix product share: an edge between matrices of n x n, and the product
// by a kept BLAS, where CMake found one.
#pragma once

#include <limits>

#include "own_graph.hpp"
#ifdef EDGEWISE_OPENBLAS
#include <cblas.h>
#endif

namespace edgewise {

/// Two factors (or blocks of them), one behind the other; or one product.
template <class Number>
Kind matrices(const std::string& content, int n) {
    constexpr Type type = sizeof(Number) == sizeof(float) ? Type::f32 : Type::f64;
    return {"matrix", content, {n, n, content == "product" ? 1 : 2}, type};
}

template <class Number>
using MatrixKernel = std::function<void(const Number* a, const Number* b, Number* made)>;

template <class Number>
Transition matrix_edge(int n, const std::string& name, const std::string& from,
                       const std::string& to, const Work& work,
                       const MatrixKernel<Number>& kernel) {
    // Sums of n products are rounded as often; to lay them out rounds nothing.
    const double unit = std::numeric_limits<Number>::epsilon() / 2;
    return plain_edge("matrix." + name, "matrix/" + from, matrices<Number>(to, n), work,
                      {.noise = to == "product" ? std::sqrt(n) * unit : 0},
                      [=](const Data& in, Data& out, auto*) {
                          const Number* factors = in.as<Number>();
                          kernel(factors, factors + std::int64_t{n} * n, out.as<Number>());
                      });
}

#ifdef EDGEWISE_OPENBLAS
inline void blas(int n, const float* a, const float* b, float* c) {
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1, a, n, b, n, 0, c, n);
}

inline void blas(int n, const double* a, const double* b, double* c) {
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1, a, n, b, n, 0, c, n);
}
#endif

/// Adds matrix.blas. @return whether there is a BLAS
template <class Number>
bool add_blas([[maybe_unused]] Catalogue& edges, [[maybe_unused]] int n) {
#ifdef EDGEWISE_OPENBLAS
    const double cube = double(n) * n * n, block = 64;  // those of a BLAS are no smaller
    edges.push_back(matrix_edge<Number>(
        n, "blas", "factors", "product",
        {.operations = 2 * cube, .streamed = 3 * sizeof(Number) * cube / block},
        [n](const Number* a, const Number* b, Number* c) { blas(n, a, b, c); }));
    return true;
#else
    return false;
#endif
}

/// Lengths of A's rows and of B's columns.
struct Lengths {
    std::vector<double> rows, columns;
    double norms = 1;    // of A (root of the sum of squares) times that of B
    double inverse = 1;  // RMS of 1 / (row column)

    Lengths(int n, const double* a, const double* b) : rows(n), columns(n) {
        for (int i = 0; i < n * n; ++i) rows[i / n] += a[i] * a[i], columns[i % n] += b[i] * b[i];
        for (std::vector<double>* of : {&rows, &columns}) {
            double squares = 0, inverses = 0;
            for (double& length : *of) {
                squares += length, inverses += 1 / length / n;
                length = std::sqrt(length);
            }
            norms *= std::sqrt(squares), inverse *= std::sqrt(inverses);
        }
    }
};

}  // namespace edgewise
