#pragma once

#include <cstdint>

#include "graph/radon.hpp"

namespace edgewise {

/// For which line of an angle a sample votes: offsets are rounded to the nearest, halves upwards.
/// All edges round this one way, so that their counts are equal.
class VoteRule {
 public:
    VoteRule(const RadonLines& lines, int k) noexcept
        : x_centre_(0.5 * static_cast<double>(lines.input.x - 1)),
          y_centre_(0.5 * static_cast<double>(lines.input.y - 1)),
          middle_(static_cast<double>(lines.middle()) + 0.5) {
        const auto [a, b] = lines.slopes(k);
        across_ = a, down_ = b;
    }

    double across() const noexcept { return across_; }
    double down() const noexcept { return down_; }
    /// Offset of a sample from the lower end of line 0 [step]; never negative. Rises or falls with
    /// x, and with y, also as it is rounded.
    double place(std::int64_t x, std::int64_t y) const noexcept {
        return (static_cast<double>(x) - x_centre_) * across_ +
               (static_cast<double>(y) - y_centre_) * down_ + middle_;
    }
    std::int64_t line(std::int64_t x, std::int64_t y) const noexcept {
        return static_cast<std::int64_t>(place(x, y));
    }

 private:
    double x_centre_, y_centre_, middle_, across_ = 0, down_ = 0;
};

/// Whether a sample votes: it and the threshold as f32. NaN never does.
inline bool votes(float sample, const RadonSetting& setting) noexcept {
    return sample >= static_cast<float>(setting.threshold);
}

}  // namespace edgewise
