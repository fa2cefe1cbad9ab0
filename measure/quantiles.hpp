#pragma once

#include <vector>

namespace edgewise {

/// The value that a share of the others lies below, between two values by their distance; not a
/// number of none.
double quantile(std::vector<double> values, double share);
double median(std::vector<double> values);
/// exp of the mean logarithm.
double geometric_mean(const std::vector<double>& values);
/// Kendall's tau-b of pairs: 1 where both grow together, -1 where one falls as the other grows.
double kendall_tau(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace edgewise
