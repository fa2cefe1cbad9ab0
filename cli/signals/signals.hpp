#pragma once

#include <atomic>

namespace edgewise::cli {

/// SIGINT and SIGTERM set the flag; a second one ends the process at once.
void catch_signals();
/// Set by the first signal; what runs polls it.
const std::atomic<bool>& stop_flag() noexcept;
/// 128 + the signal that came, or 0.
int signal_exit_code() noexcept;

/// From here to the end nothing is half done that would have to be tidied up, and nothing polls the
/// flag (reading, planning): the first signal already ends the process.
void begin_unobserved() noexcept;
void end_unobserved() noexcept;

/// From here to the end there are results to keep: the first signal only sets the flag, also
/// between begin_unobserved and end_unobserved. May be nested.
void begin_collecting() noexcept;
void end_collecting() noexcept;

/// From now on the process cannot allocate beyond `bytes` of data more than it has.
void fence_memory(double bytes);

}  // namespace edgewise::cli
