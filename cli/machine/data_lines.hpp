#pragma once

#include "graph/data.hpp"

namespace edgewise::cli {

/// [byte] that the caches of cores hold, about.
inline constexpr double kOwnCaches = 2 << 20;

/// A line takes up to so many times as long as from where data are nearest: they are as near.
inline constexpr double kNearLines = 1.6;

/// Where data lie: [s] that one of their lines takes to come, the mean of 400, other ones each
/// time, each of which is asked for when the one before has come. 13 to 25 ns where all are in a
/// last cache, 100 and more where none is: other guests of a host who read much take such a cache
/// for hundredths of a second to minutes. Takes 400 times what it returns.
/// @return 0 for data up to kOwnCaches
double line_seconds(const Data& data);

/// The least that line_seconds() has found in this process of data as large or larger (1.1 times as
/// small at most), which lie no nearer than these; 0: none was looked at, or caches of cores hold
/// them.
/// @param data  [byte]
double nearest_line(double data);

/// How many times as far data lie as they, or others as large, ever did in this process; 1 of data
/// up to kOwnCaches.
double times_as_far(const Data& data);

}  // namespace edgewise::cli
