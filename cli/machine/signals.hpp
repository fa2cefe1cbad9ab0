#pragma once

#include <atomic>

namespace edgewise::cli {

/// SIGINT and SIGTERM set the flag; a second one ends the process at once.
void catch_signals();
/// Set by the first signal; what runs polls it.
const std::atomic<bool>& stop_flag() noexcept;
/// 128 + the signal that came, or 0.
int signal_exit_code() noexcept;

/// While one of these lives nothing is half done that would have to be tidied up, and nothing polls
/// the flag (reading, planning): the first signal already ends the process.
class EndsAtOnce {
 public:
    EndsAtOnce() noexcept;
    ~EndsAtOnce();
    EndsAtOnce(const EndsAtOnce&) = delete;
    EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

/// While one of these lives there are results to keep: EndsAtOnce does nothing, the first signal
/// only sets the flag. They may be within each other.
class KeepsResults {
 public:
    KeepsResults() noexcept;
    ~KeepsResults();
    KeepsResults(const KeepsResults&) = delete;
    KeepsResults& operator=(const KeepsResults&) = delete;
};

}  // namespace edgewise::cli
