#pragma once

#include <atomic>

#include "planner/profile.hpp"

namespace edgewise {

/// Measures what rates refer to: the seconds of an operation, of accesses in order and at computed
/// addresses by level of memory, of starting a step, of waking a thread and of copying. Sets them
/// with their provenance and spread. Rounds over everything, medians of all rounds: a machine that
/// is shared slows down for tenths of a second. About 1.5 s, or 0.4.
/// @param profile  whose number of processors is known
/// @param stop  ends it when set
/// @throws Cancelled, std::bad_alloc
void probe_machine(Profile& profile, bool quick, const std::atomic<bool>& stop);

/// Factors were measured with other numbers than these: scales all so that those of edges that have
/// rates agree with them in the median.
void rebase_factors(Profile& profile);

}  // namespace edgewise
