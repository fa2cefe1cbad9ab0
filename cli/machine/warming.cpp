#include "cli/machine/warming.hpp"

namespace edgewise::cli {

bool Warming::goes_on() const noexcept {
    constexpr double kEnough = 0.006, kLong = 0.05;  // [s]
    constexpr int kFew = 2, kMany = 6, kMost = 16;
    if (last_ >= kLong || runs_ >= kMost) return false;
    return faster_ || (runs_ < (far_ ? kMany : kFew) && runs_ * last_ < kEnough);
}

void Warming::ran(double seconds, double far) noexcept {
    constexpr double kFaster = 0.97, kNear = 1.3;
    far_ = far > kNear;
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
