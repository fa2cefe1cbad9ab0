#pragma once

#include <cstdint>
#include <vector>

namespace edgewise {

/// A range that holds the true number in at least 95 of 100 seeds.
struct Interval {
    double low = 0, high = 0;
};

/// What one draw adds to an estimated sum.
struct Part {
    double value = 0;    // the square, over the probability that it was drawn
    double missing = 1;  // probability that the second phase did not draw it; 0: it was certain
    double square = 0;   // what was drawn there
    double looks = 0;    // random samples of the first phase that it stands for; 0: it was certain
};

/// What else is known of a sum whose parts were drawn.
struct AroundParts {
    double looked = 0;           // how many were looked at by chance
    double seen = 1;             // their share of all that could have been
    double least = 0, most = 0;  // limits of the sum
};

/// The root of a sum, from parts that were drawn without replacement in two phases: some are looked
/// at, all alike, and of these some are drawn with known chances. Squares of errors have heavy
/// tails (a few pixels at edges carry them), where the normal interval is too short and ends too
/// low; the bootstrap of Student's t follows the skew (Efron, Tibshirani 1993, ch. 12). It draws
/// anew in both phases, in the first by how often (Poisson) what a part stands for would be looked
/// at again. The wider end of both is taken on each side. The spread of the second phase is that of
/// draws with replacement, each times how likely it was not drawn (Brewer, Hanif 1983, ch. 4): too
/// large rather than too small where draws were spread along an order.
/// @param seed  of the resampling; the same parts and seed give the same interval
Interval root_sum_interval(std::vector<Part> parts, const AroundParts& around, std::uint64_t seed);

/// The root of a share, from `hits` of `samples` draws (Wilson's score interval).
Interval root_share_interval(std::int64_t hits, std::int64_t samples);

}  // namespace edgewise
