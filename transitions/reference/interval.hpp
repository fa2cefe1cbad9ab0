#pragma once

#include <cstdint>
#include <span>

namespace edgewise {

/// A range that holds the true number in at least 95 of 100 seeds.
struct Interval {
    double low = 0, high = 0;
};

/// What one draw adds to an estimated sum.
struct Part {
    double value = 0;    // what was drawn there, over how likely it was to be drawn
    double missing = 1;  // how likely it was not to be drawn
};

/// What else is known of a sum whose parts were drawn.
struct AroundParts {
    double sure = 0;             // what is part of it for certain, besides the draws
    double variance = 0;         // of the sum over all that could have been drawn
    double least = 0, most = 0;  // limits of the sum
};

/// The root of a sum, from parts that were drawn without replacement with known chances. Squares of
/// errors have heavy tails (a few pixels at edges carry them), where the normal interval is too
/// short and ends too low; the bootstrap of Student's t follows the skew (Efron, Tibshirani 1993,
/// ch. 12). The wider end of both is taken on each side. The spread of parts is that of draws with
/// replacement, each times how likely it was not drawn (Brewer, Hanif 1983, ch. 4): too large
/// rather than too small where draws were spread along an order.
/// @param seed  of the resampling; the same parts and seed give the same interval
Interval root_sum_interval(std::span<const Part> parts, const AroundParts& around,
                           std::uint64_t seed);

/// The root of a share, from `hits` of `samples` draws (Wilson's score interval).
Interval root_share_interval(std::int64_t hits, std::int64_t samples);

}  // namespace edgewise
