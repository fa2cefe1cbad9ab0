#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace edgewise {

/// Stops a run that takes too long, or when all is asked to end.
class Watch {
 public:
    /// @param seconds  from now; may be infinite
    /// @param stop  ends it as well
    Watch(double seconds, const std::atomic<bool>& stop);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    const std::atomic<bool>& flag() const noexcept { return stop_; }
    double elapsed() const;

 private:
    std::chrono::steady_clock::time_point begin_;
    double seconds_;
    std::atomic<bool> stop_ = false;
    bool done_ = false;
    std::mutex mutex_;
    std::condition_variable ended_;
    std::thread thread_;
};

}  // namespace edgewise
