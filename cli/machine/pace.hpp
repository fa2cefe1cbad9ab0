#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace edgewise::cli {

/// How fast the processors of a shared machine are at this moment. No counter of a virtual machine
/// tells either of the two.
struct Pace {
    /// [s] of a fixed loop on so many processors, all at work: the harmonic mean, as work is
    /// shared; infinite where they did not come together within a fraction of a millisecond. The
    /// loop issues as much as a core can, out of its first cache: while a hyperthread's sibling is
    /// awake, for another guest of the host or for this one, it takes 1.3 to 1.9 times as long, and
    /// so does a ray caster; chains of products and streams hardly notice.
    double loop = std::numeric_limits<double>::infinity();
    /// [s] that a line of the caches takes from one processor to the next; of one thread 0. A host
    /// that moves processors to cores with third-level caches of their own makes it six times what
    /// it is under one such cache: what one thread wrote the other then reads as slowly as if it
    /// came from memory, and two threads may take as long as one.
    double hop = 0;
};

/// Of so many processors, or all that there are. Takes 0.06 to 0.15 ms, up to 0.6 ms where they do
/// not meet.
Pace pace_now(int threads);

/// The least that pace_now() of so many threads has found in this process; the hop is that of
/// processors on cores of their own.
Pace best_pace(int threads);

/// What another process found to be the best of this machine counts as if it had been found here: a
/// process that begins in a busy minute knows it.
void know_pace(int threads, const Pace& pace);

/// Whether a run of this pace was as good as alone: loop up to 1.1 times the best, hop up to twice.
bool is_calm(const Pace& pace, const Pace& best) noexcept;

/// The pace of the next calm moment, or the last one within so long [s].
Pace await_calm(int threads, double patience);

/// The pace of the next calm moment within 4 ms, for one run. Where a host is busy such moments
/// come and go: on one that was calm 14 % of the time half of them came within 0.2 ms, and 1 ms
/// later 72 % were not over. After a wait in vain a tenth of it is enough.
Pace calm_pace(int threads);

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

/// Runs of one thing on the same data, how fast the machine was beside each, and where the data
/// lay.
class PacedRuns {
 public:
    /// @param before,after  pace_now()
    /// @param line          line_seconds() of the data before; 0: they are near anyway
    void add(double seconds, const Pace& before, const Pace& after, double line = 0) {
        runs_.push_back({seconds, line, before, after});
    }
    /// Those of the same thing that were kept elsewhere.
    void join(const PacedRuns& others);
    std::size_t size() const noexcept { return runs_.size(); }
    /// The runs from this one on count only where the others are too few.
    void disturbed_from(std::size_t first);

    /// Runs of a calm pace whose data were as near as they ever were: a line up to
    /// kNearLines times the least (docs/planner.md: runs on 8 MB take up to 2.5 times as long, and
    /// more, where their data are far).
    std::size_t calm(const Pace& best) const;
    /// Seconds of the calm runs; where they are fewer than `least`, of so many that come closest;
    /// of all where the pace of none is known.
    std::vector<double> seconds(const Pace& best, std::size_t least) const;

    /// Seconds of a run that nothing disturbs: each run's that was not calm divided by how much
    /// slower than the best the better of the loops beside it was; of these the 0.2 quantile, as
    /// other guests that read the same memory only add, which no pace tells. Runs whose data were
    /// far count only where the others are too few, and so do those of processors far from each
    /// other.
    /// @pre size() > 0
    double undisturbed(const Pace& best) const;

 private:
    struct Run {
        double seconds, line;
        Pace before, after;
        /// Of its time.
        Pace pace() const noexcept;
    };
    /// Of all runs; 0: none was looked at.
    double least_line() const noexcept;

    std::vector<Run> runs_;
};

}  // namespace edgewise::cli
