#include "runtime/one_thread_a_core.hpp"

#ifdef __linux__
#include <algorithm>
#include <mutex>
#include <sched.h>
#include <unistd.h>
#endif

namespace edgewise {

#ifdef __linux__
namespace {

cpu_set_t only(int core) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(core, &set);
    return set;
}

/// Workers of this process that have been in an arena of ours: they outlive arenas, and sleep
/// between them.
class Workers {
 public:
    static Workers& all() {
        static auto* const workers = new Workers;  // threads may end after static objects
        return *workers;
    }

    /// The calling thread is awake, on this core, in an arena that this one observes.
    void came(int core, const OneThreadACore* where) {
        const std::lock_guard lock(mutex_);
        Worker& worker = mine();
        free(worker);
        worker.core = core;
        worker.where = where;
    }

    /// The calling thread is going to sleep, and should wake on this core if there is more to do.
    void goes(int core) {
        const std::lock_guard lock(mutex_);
        Worker& worker = mine();
        worker.where = nullptr;
        if (users_ > 0) bind(worker, core);
    }

    /// Nobody will tell any more who leaves that arena.
    void lose(const OneThreadACore* where) {
        const std::lock_guard lock(mutex_);
        for (Worker& worker : workers_)
            if (worker.where == where) worker.where = nullptr;
    }

    /// All that sleep should wake on a core that is not `taken`, and each on one of its own while
    /// there are some.
    void begin(int taken) {
        const std::lock_guard lock(mutex_);
        ++users_;
        cpu_set_t used = only(taken);
        for (const Worker& worker : workers_)
            if (worker.where) CPU_SET(worker.core, &used);
        for (Worker& worker : workers_) {
            cpu_set_t allowed = worker.allowed;
            if (worker.where) continue;
            if (!worker.bound && sched_getaffinity(worker.thread, sizeof allowed, &allowed) != 0)
                continue;
            const int core = choice(worker.core, allowed, used, taken);
            if (core < 0) continue;
            CPU_SET(core, &used);
            if (worker.bound && worker.core == core) continue;
            free(worker);
            bind(worker, core);
        }
    }

    void end() {
        const std::lock_guard lock(mutex_);
        if (--users_ > 0) return;
        for (Worker& worker : workers_) free(worker);
    }

 private:
    struct Worker {
        pid_t thread = 0;
        int core = 0;  // that it ran on last
        /// Who observes the arena in which it is awake; null: none, so it sleeps, or is not ours.
        const OneThreadACore* where = nullptr;
        bool bound = false;
        cpu_set_t allowed;  // if it is not bound
    };

    /// Takes a thread off the list when it ends, so that none of its number is bound instead.
    struct Ending {
        ~Ending() {
            Workers& workers = all();
            const std::lock_guard lock(workers.mutex_);
            std::erase_if(workers.workers_,
                          [](const Worker& worker) { return worker.thread == gettid(); });
        }
    };

    Worker& mine() {
        const pid_t thread = gettid();
        const auto found =
            std::find_if(workers_.begin(), workers_.end(),
                         [&](const Worker& worker) { return worker.thread == thread; });
        if (found != workers_.end()) return *found;
        thread_local const Ending ending;
        static_cast<void>(ending);
        Worker& added = workers_.emplace_back();
        added.thread = thread;
        return added;
    }

    /// @return the last core, if it is free, or the first that is, or any but `taken`; -1: none
    static int choice(int last, const cpu_set_t& allowed, const cpu_set_t& used, int taken) {
        if (CPU_ISSET(last, &allowed) && !CPU_ISSET(last, &used)) return last;
        int other = -1;
        for (int core = 0; core < CPU_SETSIZE; ++core) {
            if (core == taken || !CPU_ISSET(core, &allowed)) continue;
            if (!CPU_ISSET(core, &used)) return core;
            if (other < 0) other = core;
        }
        return other;
    }

    static void bind(Worker& worker, int core) {
        worker.core = core;
        if (worker.bound ||
            sched_getaffinity(worker.thread, sizeof worker.allowed, &worker.allowed) != 0)
            return;
        const cpu_set_t one = only(core);
        worker.bound = sched_setaffinity(worker.thread, sizeof one, &one) == 0;
    }

    static void free(Worker& worker) {
        if (worker.bound) sched_setaffinity(worker.thread, sizeof worker.allowed, &worker.allowed);
        worker.bound = false;
    }

    std::mutex mutex_;
    std::vector<Worker> workers_;
    int users_ = 0;
};

}  // namespace

OneThreadACore::OneThreadACore(tbb::task_arena& arena, int threads)
    : tbb::task_scheduler_observer(arena), core_(static_cast<std::size_t>(threads)) {
    for (std::atomic<int>& core : core_) core = -1;
    if (threads > 1) observe(true);
}

OneThreadACore::~OneThreadACore() {
    if (!is_observing()) return;
    observe(false);
    Workers::all().lose(this);
}

OneThreadACore::AtWork::AtWork(const OneThreadACore& cores) {
    const int here = sched_getcpu();
    if (!cores.is_observing() || here < 0 || here >= CPU_SETSIZE) return;
    Workers::all().begin(here);
    begun_ = true;
}

OneThreadACore::AtWork::~AtWork() {
    if (begun_) Workers::all().end();
}

void OneThreadACore::on_scheduler_entry(bool worker) {
    const auto slot = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
    const int here = sched_getcpu();
    if (slot >= core_.size() || here < 0 || here >= CPU_SETSIZE) return;
    core_[slot] = here;
    if (!worker) return;
    Workers::all().came(here, this);
    const auto is_taken = [&](int core) {
        for (std::size_t other = 0; other < core_.size(); ++other)
            if (other != slot && core_[other] == core) return true;
        return false;
    };
    cpu_set_t allowed;
    if (!is_taken(here) || sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
    for (int core = 0; core < CPU_SETSIZE; ++core) {
        if (!CPU_ISSET(core, &allowed) || is_taken(core)) continue;
        core_[slot] = core;
        // The first call moves the thread, the second leaves it free again.
        const cpu_set_t one = only(core);
        sched_setaffinity(0, sizeof one, &one);
        sched_setaffinity(0, sizeof allowed, &allowed);
        return;
    }
}

void OneThreadACore::on_scheduler_exit(bool worker) {
    const auto slot = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
    if (slot >= core_.size()) return;
    const int core = core_[slot].exchange(-1);
    if (worker && core >= 0) Workers::all().goes(core);
}
#else
OneThreadACore::OneThreadACore(tbb::task_arena& arena, int) : tbb::task_scheduler_observer(arena) {}
OneThreadACore::~OneThreadACore() = default;
OneThreadACore::AtWork::AtWork(const OneThreadACore&) {}
OneThreadACore::AtWork::~AtWork() = default;
void OneThreadACore::on_scheduler_entry(bool) {}
void OneThreadACore::on_scheduler_exit(bool) {}
#endif

}  // namespace edgewise
