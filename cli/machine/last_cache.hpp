#pragma once

namespace edgewise::cli {

/// [s] that a line takes from the last cache, right now, when each read waits for the one before;
/// 0 where the system tells of no last cache, or of one that is not much larger than the second.
/// Three times what the second holds is read, then some of the first third again: a last cache that
/// this machine has to itself still has them, and one that other guests of the host fill has given
/// them up to memory, ten times as far. Takes 0.15 ms where they are there, up to 1 ms where not;
/// what the second cache held is then in the last one.
double last_cache_line();

}  // namespace edgewise::cli
