#pragma once

namespace edgewise::cli {

/// How often something runs before a run counts that others ran before: once, as these took its
/// blocks; brief ones, for 0.006 s or twice, where data are still far 6 times, and on as long as
/// each is faster than the one before. A last cache that guests of a host share takes in what is
/// read again only little by little: on 3 to 9 MB the second run took 1.05 to 1.7 times as long as
/// the thirteenth, and further ones were hardly faster; where data lie is looked at beside those
/// that count. What takes 0.05 s or more does not run before.
class Warming {
 public:
    /// @param expected  [s] of a run; models may take for short what is not: each run tells anew
    explicit Warming(double expected) noexcept : last_(expected) {}
    bool goes_on() const noexcept;
    /// [s] of the run before, or what was expected.
    double last() const noexcept { return last_; }
    /// @param far  times_as_far() of the data that it reads, now
    void ran(double seconds, double far) noexcept;

 private:
    double last_;
    int runs_ = 0;
    bool faster_ = false, far_ = false;
};

/// How many runs count each time that something runs before others do: several where they are
/// brief, as warming them took longer. @param expected  [s] of a run
int runs_in_a_row(double expected) noexcept;

}  // namespace edgewise::cli
