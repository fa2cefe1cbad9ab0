#include "cli/machine/stolen_time.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <unistd.h>

namespace edgewise::cli {
namespace {

/// [s] of all processors so far, by proc(5); 0 where the system does not say.
double stolen_seconds() {
    std::ifstream stat("/proc/stat");
    std::string line;
    if (!std::getline(stat, line)) return 0;
    std::istringstream fields(line);
    std::string cpu;
    double user = 0, nice = 0, system = 0, idle = 0, io = 0, irq = 0, soft = 0, steal = 0;
    fields >> cpu >> user >> nice >> system >> idle >> io >> irq >> soft >> steal;
    return fields ? steal / static_cast<double>(sysconf(_SC_CLK_TCK)) : 0;
}

}  // namespace

StolenTime::StolenTime() : begin_(std::chrono::steady_clock::now()), before_(stolen_seconds()) {}

bool StolenTime::calm() const {
    constexpr double kShare = 0.05;
    const double tick = 1.5 / static_cast<double>(sysconf(_SC_CLK_TCK));
    const double elapsed =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    const double processors = std::max(1u, std::thread::hardware_concurrency());
    return stolen_seconds() - before_ <= std::max(tick, kShare * elapsed * processors);
}

}  // namespace edgewise::cli
