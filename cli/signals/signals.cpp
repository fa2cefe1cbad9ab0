#include "cli/signals/signals.hpp"

#include <algorithm>
#include <csignal>
#include <sys/resource.h>
#include <unistd.h>

#include "measure/machine.hpp"

namespace edgewise::cli {
namespace {

std::atomic<bool> g_stop = false;
std::atomic<bool> g_at_once = false;
std::atomic<int> g_keeps = 0;
std::atomic<int> g_code = 0;

extern "C" void on_signal(int number) {
    const bool again = g_stop.exchange(true);
    g_code = 128 + number;
    if (again || g_at_once) _exit(128 + number);
}

}  // namespace

void catch_signals() {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    // A reader that went away is an error of a write, not the end of the process.
    signal(SIGPIPE, SIG_IGN);
}

const std::atomic<bool>& stop_flag() noexcept { return g_stop; }
int signal_exit_code() noexcept { return g_code; }

void begin_unobserved() noexcept {
    if (g_keeps > 0) return;
    g_at_once = true;
    if (g_stop) _exit(g_code);
}
void end_unobserved() noexcept { g_at_once = false; }

void begin_collecting() noexcept { ++g_keeps; }
void end_collecting() noexcept { --g_keeps; }

void fence_memory(double bytes) {
    const double held = data_now();
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
    const double most = std::min(held + bytes, 0x1p62);
    if (limit.rlim_max != RLIM_INFINITY && most > double(limit.rlim_max)) return;
    limit.rlim_cur = static_cast<rlim_t>(most);
    setrlimit(RLIMIT_DATA, &limit);
}

}  // namespace edgewise::cli
