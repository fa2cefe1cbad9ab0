#pragma once

#include <chrono>

namespace edgewise::cli {

/// Tells whether the host of this virtual machine took its processors away while something was
/// timed: such runs say more about its other guests than about the code.
class StolenTime {
 public:
    StolenTime();
    /// Since construction no more than a twentieth of the processors' time was taken, or a tick.
    bool calm() const;

 private:
    std::chrono::steady_clock::time_point begin_;
    double before_;
};

}  // namespace edgewise::cli
