#pragma once

#include <cstddef>
#include <vector>

namespace edgewise::cli {

/// Seconds that a fixed loop takes at this moment on so many processors, or all that there are, all
/// at work: the harmonic mean, as work is shared; infinite where they did not come together within
/// a fraction of a millisecond. The loop issues as much as a core can, out of its first cache:
/// while a hyperthread's sibling is awake for another guest of the host it takes 1.5 to 1.8 times
/// as long, and so does a ray caster, for tenths of a second to seconds; chains of products and
/// streams hardly notice, and no counter of a virtual machine tells. Takes 0.05 ms, up to 0.3 ms
/// where they do not meet.
double pace_now(int threads);

/// The least that pace_now() of so many threads has found in this process.
double best_pace(int threads);

/// Whether a run of this pace was as good as alone: up to 1.1 times the best.
bool is_calm(double pace, double best) noexcept;

/// How often something runs before a run counts that others ran before: at least once, as these
/// took its blocks; brief ones more often, as the caches of all processors hold what others read.
int warming_runs(double seconds) noexcept;

/// Runs of one thing, and how fast the machine was beside each.
class PacedRuns {
 public:
    /// @param before,after  pace_now()
    void add(double seconds, double before, double after) {
        runs_.push_back({seconds, before, after});
    }
    /// Those of the same thing that were kept elsewhere.
    void join(const PacedRuns& others);
    std::size_t size() const noexcept { return runs_.size(); }
    /// The runs from this one on count only where the others are too few.
    void disturbed_from(std::size_t first);

    std::size_t calm(double best) const;
    /// Seconds of the calm runs; where they are fewer than `least`, of so many that come closest;
    /// of all where the pace of none is known.
    std::vector<double> seconds(double best, std::size_t least) const;

    /// Seconds of a run that nothing disturbs: each run's divided by how much slower than calm the
    /// better of the paces beside it was; of these the first quintile, as other guests that read
    /// the same caches and memory only add, which no pace tells.
    /// @pre size() > 0
    double undisturbed(double best) const;

 private:
    struct Run {
        double seconds, before, after;
        double pace() const noexcept { return (before + after) / 2; }
    };
    std::vector<Run> runs_;
};

}  // namespace edgewise::cli
