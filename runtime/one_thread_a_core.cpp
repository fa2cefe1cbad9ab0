#include "runtime/one_thread_a_core.hpp"

#ifdef __linux__
#include <sched.h>
#endif

namespace edgewise {

OneThreadACore::OneThreadACore(tbb::task_arena& arena, int threads)
    : tbb::task_scheduler_observer(arena),
#ifdef __linux__
      taken_(CPU_SETSIZE),
#endif
      core_(static_cast<std::size_t>(threads)) {
    for (std::atomic<int>& core : core_) core = -1;
    if (threads > 1 && !taken_.empty()) observe(true);
}

void OneThreadACore::on_scheduler_entry(bool) {
#ifdef __linux__
    const auto slot = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
    const int here = sched_getcpu();
    if (slot >= core_.size() || here < 0 || here >= CPU_SETSIZE) return;
    const auto take = [&](int core) {
        if (taken_[static_cast<std::size_t>(core)].exchange(true)) return false;
        core_[slot] = core;
        return true;
    };
    cpu_set_t allowed;
    if (take(here) || sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
    for (int core = 0; core < CPU_SETSIZE; ++core) {
        if (!CPU_ISSET(core, &allowed) || !take(core)) continue;
        cpu_set_t only;
        CPU_ZERO(&only);
        CPU_SET(core, &only);
        // The first call moves the thread, the second leaves it free again.
        sched_setaffinity(0, sizeof only, &only);
        sched_setaffinity(0, sizeof allowed, &allowed);
        return;
    }
#endif
}

void OneThreadACore::on_scheduler_exit(bool) {
    const auto slot = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
    if (slot >= core_.size()) return;
    const int core = core_[slot].exchange(-1);
    if (core >= 0) taken_[static_cast<std::size_t>(core)] = false;
}

}  // namespace edgewise
