#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <pybind11/pybind11.h>

/// Calls of Python that do work: what ends them.
namespace edgewise::python {

namespace py = pybind11;

/// When the interpreter ends it ends threads that still run wherever they next want its lock, and
/// cannot unwind them through C++. So it waits until all are out, and lets none in again.
class Doors {
 public:
    /// @throws SystemExit, which ends a thread silently; RuntimeError in the thread that ends
    void enter() {
        {
            const std::lock_guard lock(mutex_);
            if (!closed_) {
                ++inside_;
                return;
            }
        }
        PyErr_SetString(
            PyThread_get_thread_ident() == ends_ ? PyExc_RuntimeError : PyExc_SystemExit,
            "edgewise: the interpreter ends");
        throw py::error_already_set();
    }
    void leave() {
        const std::lock_guard lock(mutex_);
        --inside_;
        left_.notify_all();
    }
    bool closed() const noexcept { return closed_; }
    void close() {
        const py::gil_scoped_release unlocked;
        std::unique_lock lock(mutex_);
        ends_ = PyThread_get_thread_ident();
        closed_ = true;
        left_.wait(lock, [&] { return inside_ == 0; });
    }

 private:
    std::mutex mutex_;
    std::condition_variable left_;
    int inside_ = 0;
    unsigned long ends_ = 0;
    std::atomic<bool> closed_ = false;
};

inline Doors& doors() {
    static auto* const one = new Doors;  // threads may outlive static objects
    return *one;
}

struct Inside {
    Inside() { doors().enter(); }
    ~Inside() { doors().leave(); }
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;
};

/// Does work in a thread of its own, without the interpreter's lock; Ctrl-C sets the flag, and so
/// does the interpreter's end.
template <class Work>
auto interruptible(std::atomic<bool>& stop, Work work) {
    auto done = std::async(std::launch::async, work);
    bool interrupted = false;
    for (;;) {
        {
            const py::gil_scoped_release unlocked;
            if (done.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
        }
        if (interrupted) continue;
        const bool ends = doors().closed();
        if (ends) PyErr_SetString(PyExc_SystemExit, "edgewise: the interpreter ends");
        if (ends || PyErr_CheckSignals() != 0) stop = interrupted = true;
    }
    if (interrupted) {
        try {
            done.get();
        } catch (...) {
        }
        throw py::error_already_set();
    }
    return done.get();
}

}  // namespace edgewise::python
