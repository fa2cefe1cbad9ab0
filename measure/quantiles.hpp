#pragma once

#include <vector>

namespace edgewise {

/// The value that a share of the others lies below, between two values by their distance; not a
/// number of none.
double quantile(std::vector<double> values, double share);
double median(std::vector<double> values);
/// exp of the mean logarithm.
double geometric_mean(const std::vector<double>& values);
/// The standard error of an estimate, by the jackknife: the estimate without each of the equal
/// parts of what was drawn (Efron and Stein, "The jackknife estimate of variance", Annals of
/// Statistics 9(3), 1981); 0 of less than two.
double jackknife_error(const std::vector<double>& without);
/// Kendall's tau-b of pairs: 1 where both grow together, -1 where one falls as the other grows.
double kendall_tau(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace edgewise
