#pragma once

#include <cstddef>
#include <vector>

#include "cli/machine/data_lines.hpp"
#include "cli/machine/pace.hpp"

namespace edgewise::cli {

/// The machine beside one run: how fast it was, and where the data lay.
struct Beside {
    Pace before, after;
    double line = 0;  // line_seconds() before; 0: they are near anyway
    double held = 0;  // [byte] in all by what ran; 0: of where other data lie nothing follows
};

/// Calls run(), in the next calm moment if it waits, and looks at the machine before and after.
/// @param held  [byte] by the run, its input and results included: what it writes drives out what
///              it reads
template <class Run>
Beside beside(int threads, const Data& data, double held, bool waits, Run&& run) {
    Beside met;
    met.held = held;
    met.before = waits ? calm_pace(threads) : pace_now(threads);
    met.line = line_seconds(data);
    run();
    met.after = pace_now(threads);
    return met;
}

/// Runs of one thing on the same data, how fast the machine was beside each, and where the data
/// lay.
class PacedRuns {
 public:
    void add(double seconds, const Beside& beside) { runs_.push_back({seconds, beside}); }
    /// Those of the same thing that were kept elsewhere.
    void join(const PacedRuns& others);
    std::size_t size() const noexcept { return runs_.size(); }
    /// The runs from this one on count only where the others are too few.
    void disturbed_from(std::size_t first);

    /// Runs of a calm pace whose data were as near as they ever were: a line up to kNearLines times
    /// the least (docs/planner.md: runs on 8 MB take up to 2.5 times as
    /// long, and more, where their data are far).
    std::size_t calm(const Pace& best) const;
    /// The machine beside runs, against its best.
    struct Worse {
        double loop = 1, hop = 1, line = 1;  // medians, times the best
        double nearest = 0;                  // [s] of a line at best; 0: not looked at
        bool calm = false;                   // all runs were
    };
    struct Counted {
        std::vector<double> seconds;  // of each run
        Worse worse;
    };
    /// The calm runs; where they are fewer than `least`, so many that come closest and all that
    /// come as close; all where the pace of none is known.
    Counted counted(const Pace& best, std::size_t least) const;
    std::vector<double> seconds(const Pace& best, std::size_t least) const {
        return counted(best, least).seconds;
    }

    /// Seconds of a run that nothing disturbs: each run's that was not calm divided by how much
    /// slower than still calm the better of the loops beside it was (not than the best: looks are
    /// brief, and runs beside a slow one are hardly as slow); of these the 0.2 quantile, as other
    /// guests that read the same memory only add, which no pace tells. Runs whose data were far
    /// count only where the others are too few, and so do those of processors far from each other.
    /// @pre size() > 0
    double undisturbed(const Pace& best) const;

 private:
    struct Run {
        double seconds;
        Beside beside;
        /// Of its time.
        Pace pace() const noexcept;
    };
    /// Those that count, of which so many are calm; the calmest first.
    std::vector<Run> calmest(const Pace& best, std::size_t least, std::size_t calm) const;
    /// Of all runs, and of any data as large as all that they hold; 0: none was looked at.
    double least_line() const;

    std::vector<Run> runs_;
};

}  // namespace edgewise::cli
