#include "engine/announced.hpp"

#include <chrono>
#include <utility>

namespace edgewise {

constexpr std::chrono::milliseconds kPatience{500};

Announced::Announced(Listener& messages, std::string what)
    : thread_([this, &messages, said = std::move(what)] {
          std::unique_lock lock(mutex_);
          if (!ends_.wait_for(lock, kPatience, [this] { return ended_; }))
              messages.step_begun(said);
      }) {}

Announced::~Announced() {
    {
        const std::lock_guard lock(mutex_);
        ended_ = true;
    }
    ends_.notify_one();
    thread_.join();
}

}  // namespace edgewise
