#pragma once

#include <cstdint>

#include "graph/radon.hpp"
#include "transitions/radon/radon_edge.hpp"

namespace edgewise {

/// Integrals along the lines of one angle, from strip to strip between rows of samples (or columns,
/// where these are crossed less steeply). Between two grid lines the bilinear field is a parabola
/// along the line, whose integral is known: nothing is left out.
class LineWalk {
 public:
    LineWalk(const RadonLines& lines, const RadonPlane& plane, int k) noexcept;

    /// Integral along line m [value x file unit].
    double along(std::int64_t m) const noexcept;

 private:
    template <bool kFinite>
    double summed(double first) const noexcept;

    const float* samples_;
    bool finite_;
    std::int64_t strips_, cells_;          // samples across the strips, and along them
    std::int64_t strip_step_, cell_step_;  // between these in memory
    double slope_;                         // samples along a strip, from one strip to the next
    double zero_, apart_;                  // place along strip 0 of line 0; from line to line
    double weight_;                        // length of a line in one strip [file unit]
};

}  // namespace edgewise
