#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "engine/listener.hpp"

namespace edgewise {

/// Says what the program does where it goes on for more than half a second.
class Announced {
 public:
    Announced(Listener& messages, std::string what);
    ~Announced();
    Announced(const Announced&) = delete;
    Announced& operator=(const Announced&) = delete;

 private:
    bool ended_ = false;
    std::mutex mutex_;
    std::condition_variable ends_;
    std::thread thread_;
};

}  // namespace edgewise
