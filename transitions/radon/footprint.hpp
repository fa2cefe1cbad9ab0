#pragma once

#include <algorithm>
#include <cmath>

namespace edgewise {

/// What one sample of the bilinear field adds to lines beside it: the projection of its pyramid, as
/// a function of the distance from the line, with an integral of 1.
///
/// It is a triangle of half width p, smoothed by one of half width q <= p: cos and sin times the
/// distance of samples. Smoothing changes a piecewise linear function at its kinks alone, each by
/// its change of slope times (q - |x|)^3 / (6 q^2).
class Footprint {
 public:
    /// @param a,b  what one sample to the right, and one row down, add to an offset [step]
    Footprint(double a, double b) noexcept
        : p_(std::max(std::abs(a), std::abs(b))),
          q_(std::min(std::abs(a), std::abs(b))),
          steep_(1 / (p_ * p_)),
          bend_(q_ > 0 ? steep_ / (6 * q_ * q_) : 0) {}

    /// It is 0 from this distance on.
    double reach() const noexcept { return p_ + q_; }
    double operator()(double u) const noexcept {
        const double x = std::abs(u);
        return steep_ * std::max(0.0, p_ - x) + bend_ * (cubed(x - p_) - 2 * cubed(x));
    }

 private:
    double cubed(double x) const noexcept {
        const double left = std::max(0.0, q_ - std::abs(x));
        return left * left * left;
    }

    double p_, q_, steep_, bend_;
};

}  // namespace edgewise
