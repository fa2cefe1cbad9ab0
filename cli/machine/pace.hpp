#pragma once

#include <limits>

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

/// A loop up to so many times the best is as good as alone; a sibling that is busy before or after
/// makes 1.13.
inline constexpr double kCalmLoop = 1.1;

/// Whether processors are under last caches of their own: hop over twice the best; such a cache
/// makes it 5 or 6.
bool is_far(const Pace& pace, const Pace& best) noexcept;

/// Whether a run of this pace was as good as alone.
bool is_calm(const Pace& pace, const Pace& best) noexcept;

/// The pace of the next calm moment, or the last one within so long [s].
Pace await_calm(int threads, double patience);

/// The pace of the next calm moment within 4 ms, for one run. Where a host is busy such moments
/// come and go: on one that was calm 14 % of the time half of them came within 0.2 ms, and 1 ms
/// later 72 % were not over. After a wait in vain a tenth of it is enough.
Pace calm_pace(int threads);

}  // namespace edgewise::cli
