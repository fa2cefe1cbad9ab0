#include "transitions/spectrum/depth_polynomial.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// exp(-a) Ik(a); all terms of the series are positive.
double faded_bessel(int k, double a) noexcept {
    double term = std::exp(-a);
    for (int i = 1; i <= k; ++i) term *= a / (2 * i);
    double sum = term;
    for (int m = 1; m < 400 && term > 1e-18 * sum; ++m) sum += term *= a * a / (4. * m * (m + k));
    return sum;
}

double factorial(int n) noexcept { return n < 2 ? 1 : n * factorial(n - 1); }
double power(double x, int n) noexcept { return n == 0 ? 1 : x * power(x, n - 1); }

}  // namespace

DepthPolynomial::DepthPolynomial(const DepthCue& cue, double depth, int degree) {
    const double a = cue.per_length * depth / 2;
    if (cue.linear) {
        of_s = {1 - a, -a, 0, 0};
        return;
    }
    // T0 to T3 as powers of s.
    constexpr double kChebyshev[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {-1, 0, 2, 0}, {0, -3, 0, 4}};
    constexpr int kTail = 80;  // terms beyond are below 1e-25 of the first for a <= 50
    for (int k = 0; k <= degree; ++k) {
        const double weight = faded_bessel(k, a) * (k == 0 ? 1 : k % 2 ? -2 : 2);
        for (std::size_t n = 0; n < of_s.size(); ++n) of_s[n] += weight * kChebyshev[k][n];
    }
    for (int k = degree + kTail; k > degree; --k) bound += 2 * faded_bessel(k, a);
}

double DepthPolynomial::operator()(double s) const noexcept {
    return of_s[0] + s * (of_s[1] + s * (of_s[2] + s * of_s[3]));
}

double depth_of(const Request& want, int view) {
    const Mat4& map = want.views.at(view).matrix();
    double depth = 0;
    for (int axis = 0; axis < 3; ++axis)
        depth += std::abs(map(2, axis)) * static_cast<double>(want.input[axis]);
    return depth * want.unit;
}

double deepest(const Request& want) {
    double depth = 0;
    for (int variant = 0; variant < want.views.different(); ++variant)
        depth = std::max(depth, depth_of(want, want.views.first_view(variant)));
    return depth;
}

std::vector<Moment> moments_up_to(int degree) {
    std::vector<Moment> all;
    for (int sum = 0; sum <= degree; ++sum)
        for (int z = 0; z <= sum; ++z)
            for (int y = 0; y + z <= sum; ++y) all.push_back({{sum - y - z, y, z}});
    return all;
}

std::vector<double> moment_weights(const DepthPolynomial& light, const DepthAxis& depth,
                                   int degree) {
    std::vector<double> weights;
    for (const Moment& moment : moments_up_to(degree)) {
        const auto [x, y, z] = moment.power;
        const int own = x + y + z;
        double sum = 0;  // over powers of s that have this moment
        for (int n = own; n <= degree; ++n)
            sum += light.of_s[static_cast<std::size_t>(n)] * factorial(n) / factorial(n - own) *
                   power(depth.at_origin, n - own);
        weights.push_back(sum / (factorial(x) * factorial(y) * factorial(z)) *
                          power(depth.along[0], x) * power(depth.along[1], y) *
                          power(depth.along[2], z));
    }
    return weights;
}

}  // namespace edgewise
