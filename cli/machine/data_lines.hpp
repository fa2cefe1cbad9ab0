#pragma once

#include "graph/data.hpp"

namespace edgewise::cli {

/// [byte] that the caches of cores hold, about.
inline constexpr double kOwnCaches = 2 << 20;

/// Where data lie: [s] that one of their lines takes to come, the mean of a few hundred, other ones
/// each time, each of which is asked for when the one before has come. 15 to 25 ns where all are in
/// a last cache, 100 and more where none is: other guests of a host who read much take such a cache
/// for hundredths of a second to minutes, and of 8 MB more or less is left from one run to the
/// next. Takes 0.01 to 0.06 ms.
/// @return 0 for data up to kOwnCaches
double line_seconds(const Data& data);

}  // namespace edgewise::cli
