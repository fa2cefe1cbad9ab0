// The product of two matrices through the Fourier transform, which [W93] 2.3 conjectures: it can be
// done, and by the counts it never pays. Errors are those of rows and columns of length 1.
//
//   matrix/factors --backward, blas, fourier--> matrix/product
#include <random>

#include "transform_product.hpp"

using namespace edgewise;

constexpr JobTraits kMultiply{.name = "multiply", .target = "matrix/product"};

void backward(int n, const double* a, const double* b, double* c) {
    for (int i = 0; i < n * n; ++i) {
        long double sum = 0;  // the answer too: it is rounded once
        for (int k = 0; k < n; ++k) sum += (long double)(a[i / n * n + k]) * b[k * n + i % n];
        c[i] = double(sum);
    }
}

/// @param shorter  than the first row of A its last one is
bool is_as_stated(int n, double shorter) {
    MemoryBudget memory(std::size_t{64} << 20);
    const auto factors = data_of(matrices<double>("factors", n), memory);
    std::mt19937 random(n);
    for (int i = 0; i < 2 * n * n; ++i)
        factors->as<double>()[i] = (double(random()) / (1u << 31) - 1) *
                                   (i < n * n ? std::pow(shorter, -1. * (i / n) / n) : 1);
    const double *a = factors->as<double>(), *b = a + n * n, cube = std::pow(n, 3);
    std::vector<double> answer(n * n);
    backward(n, a, b, answer.data());
    const Lengths of(n, a, b);
    Catalogue edges;
    edges.push_back(matrix_edge<double>(n, "backward", "factors", "product",
                                        {.operations = 2 * cube, .gathers = cube},
                                        [n](auto... all) { backward(n, all...); }));
    add_blas<double>(edges, n);
    edges.push_back(by_transform(n, of));
    const Profile machine = default_profile(edges);
    const Scene scene;  // its range is 1
    const auto planned = [&](const std::string& via, double within) {
        PlanOptions options;
        if (!via.empty()) options.demands.via = {demand_of(via, edges)};
        Request want;
        want.job = Job(kMultiply);
        want.budget.error = within;
        return plan(edges, {want, scene}, {{factors->what, {}}}, machine, options).plan;
    };
    const auto any = planned("matrix.fourier", INFINITY), free = planned("", 4 * n * kUnit);
    const bool fits = planned("matrix.fourier", 4 * n * kUnit).has_value();
    Request want;
    want.job = Job(kMultiply);
    std::shared_ptr<const Data> made;
    run(*any, {want, scene}, factors, [&](int, auto data) { made = data; }, {.memory = &memory});
    double squares = 0, largest = 0, predicted = any->predicted.error;
    for (int i = 0; i < n * n; ++i) {
        const double off = std::abs(made->as<double>()[i] - answer[i]);
        largest = std::max(largest, off);
        squares += std::pow(off / of.rows[i / n] / of.columns[i % n] / n, 2);
    }
    std::printf("%3d x %-3d, rows to 1/%.0e: %3.0f times the operations, error %.1e (%.1e)%s\n", n,
                n, shorter, transform_operations(n) / (2 * cube), std::sqrt(squares), predicted,
                fits ? "" : ", refused within 4 n u");
    return std::sqrt(squares) <= 2 * predicted && largest <= transform_bound(n, of.norms) && free &&
           free->texts().back() != "matrix.fourier" && fits == (shorter == 1);
}

bool refuses_what_is_not_finite() {
    const double value = NAN;
    const Request want;
    const Scene scene;
    return !by_transform(1, {1, &value, &value}).offer({}, {want, scene}, {}).refused.empty();
}

int main() {
    bool right = refuses_what_is_not_finite();
    for (const int n : {1, 3, 7, 16, 33, 64, 101}) right = is_as_stated(n, 1) && right;
    for (const int n : {16, 64}) right = is_as_stated(n, 1e9) && right;
    return !right;
}
