#include "measure/watch.hpp"

namespace edgewise {

Watch::Watch(double seconds, const std::atomic<bool>& stop)
    : begin_(std::chrono::steady_clock::now()), seconds_(seconds), thread_([this, &stop] {
          std::unique_lock lock(mutex_);
          while (!done_) {
              if (stop || elapsed() > seconds_) stop_ = true;
              ended_.wait_for(lock, std::chrono::milliseconds(20));
          }
      }) {}

Watch::~Watch() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    ended_.notify_one();
    thread_.join();
}

double Watch::elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

}  // namespace edgewise
