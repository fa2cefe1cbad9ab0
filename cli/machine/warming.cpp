#include "cli/machine/warming.hpp"

#include "cli/machine/data_lines.hpp"

namespace edgewise::cli {

Warming::Warming(double expected, double data) noexcept
    : last_(expected), many_(data > kOwnCaches ? 12 : 4) {}

bool Warming::goes_on() const noexcept {
    constexpr double kEnough = 0.03, kLong = 0.05;  // [s]
    constexpr int kMost = 16;
    if (last_ >= kLong || runs_ >= kMost) return false;
    return faster_ || (runs_ < many_ && runs_ * last_ < kEnough);
}

void Warming::ran(double seconds) noexcept {
    constexpr double kFaster = 0.97;
    faster_ = runs_ > 0 && seconds < kFaster * last_;
    last_ = seconds;
    ++runs_;
}

int runs_in_a_row(double expected) noexcept {
    constexpr double kBrief = 0.005;  // [s]
    constexpr int kMany = 6;
    return expected < kBrief ? kMany : 1;
}

}  // namespace edgewise::cli
