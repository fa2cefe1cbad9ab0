#pragma once

namespace edgewise::cli {

/// How often something runs before a run counts that others ran before: once, as these took its
/// blocks; brief ones, for 0.03 s or 4 times, on large data 12 times, as the caches of all
/// processors hold what others read, and on as long as each is faster than the one before. A last
/// cache that guests of a host share takes in what is read again only little by little: on 3 to 9
/// MB the second run took 1.05 to 1.7 times as long as the thirteenth, and further ones were hardly
/// faster. What takes 0.05 s or more does not run before.
class Warming {
 public:
    /// @param expected  [s] of a run; models may take for short what is not: each run tells anew
    /// @param data      [byte] that it reads
    Warming(double expected, double data) noexcept;
    bool goes_on() const noexcept;
    /// [s] of the run before, or what was expected.
    double last() const noexcept { return last_; }
    void ran(double seconds) noexcept;

 private:
    double last_;
    int many_, runs_ = 0;
    bool faster_ = false;
};

/// How many runs count each time that something runs before others do: several where they are
/// brief, as warming them took longer. @param expected  [s] of a run
int runs_in_a_row(double expected) noexcept;

}  // namespace edgewise::cli
