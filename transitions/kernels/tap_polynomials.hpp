#pragma once

#include <array>

#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// The weights of a filter's taps as polynomials of the place between two samples: what vectors can
/// work out for any filter. Each is within 2^-24 of the filter's own (of some 1), by the least
/// degree that does it.
class TapPolynomials {
 public:
    static constexpr int kMostTaps = 8, kMostDegree = 15;

    /// @throws std::invalid_argument where no degree will do, or there are more taps
    explicit TapPolynomials(const Filter& filter);

    int taps() const noexcept { return taps_; }
    int degree() const noexcept { return degree_; }
    /// Coefficient of f^power.
    float coefficient(int tap, int power) const noexcept { return coefficients_[tap][power]; }
    /// Those of a filter, made once a process.
    static const TapPolynomials& of(const Filter& filter);

 private:
    int taps_, degree_ = 0;
    std::array<std::array<float, kMostDegree + 1>, kMostTaps> coefficients_{};
};

/// How far values may lie beyond the samples that they are made of, on either side: a share of
/// these samples' range, and for roundings a share of their greatest magnitude.
struct Overshoot {
    double range = 0, magnitude = 0;

    friend bool operator==(const Overshoot&, const Overshoot&) = default;
};

/// Of values in so many axes; 0 of a filter without negative weights.
Overshoot overshoot_of(const Filter& filter, int axes);

/// The code that reads by a filter: kernels' own where there is one, else weights at run time.
Hold hold_of(const Filter& filter) noexcept;

}  // namespace edgewise::kernels
