#pragma once

#include <Eigen/LU>

namespace edgewise {

/// The derivative of the cubic spline through samples at these, mirrored at the ends.
inline Eigen::VectorXd spline_slopes(const Eigen::VectorXd& samples) {
    const Eigen::Index n = samples.size();
    Eigen::VectorXd slopes = Eigen::VectorXd::Zero(n);
    if (n == 1) return slopes;
    const auto mirrored = [&](Eigen::Index i) { return i < 0 ? -i : i < n ? i : 2 * (n - 1) - i; };
    Eigen::MatrixXd values = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        values(i, i) += 4. / 6;
        values(i, mirrored(i - 1)) += 1. / 6;
        values(i, mirrored(i + 1)) += 1. / 6;
    }
    const Eigen::VectorXd c = values.partialPivLu().solve(samples);
    for (Eigen::Index i = 0; i < n; ++i) slopes[i] = (c[mirrored(i + 1)] - c[mirrored(i - 1)]) / 2;
    return slopes;
}

}  // namespace edgewise
