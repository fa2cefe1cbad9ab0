#pragma once

#include <cstdint>
#include <span>

namespace edgewise {

/// A range that holds the true number in at least 95 of 100 seeds.
struct Interval {
    double low = 0, high = 0;
};

/// The root of the mean of a population, from squares drawn from it at random. Squares of errors
/// have heavy tails (a few pixels at edges carry them), where the normal interval is too short and
/// ends too low; the bootstrap of Student's t follows the skew (Efron, Tibshirani 1993, ch. 12).
/// The wider end of both is taken on each side.
/// @param seed  of the resampling; the same squares and seed give the same interval
Interval root_mean_interval(std::span<const double> squares, std::uint64_t seed);

/// The root of a share, from `hits` of `samples` draws (Wilson's score interval).
Interval root_share_interval(std::int64_t hits, std::int64_t samples);

}  // namespace edgewise
