#pragma once

#include <atomic>
#include <cstddef>
#include <span>
#include <string>
#include <sys/types.h>
#include <vector>

namespace edgewise::store {

/// A program that runs beside this one and reads what is written to it. What it prints goes
/// nowhere; what it complains about is told where it fails. It does not count as this process: its
/// memory is its own, and a signal from the terminal does not reach it.
class Child {
 public:
    /// @param words  the program's file and its arguments, as they are: no shell reads them
    /// @param about  what errors begin with
    /// @param stop   set by whoever wants it to end; null: nobody does
    /// @throws RunError where there is no process to be had
    Child(const std::vector<std::string>& words, std::string about, const std::atomic<bool>* stop);
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    /// Ends it at once where it still runs.
    ~Child();

    /// @throws RunError where it ends before it has read this, Cancelled
    void write(std::span<const std::byte> bytes);
    /// Tells it that this was all, and waits for its end. @throws RunError where it fails,
    /// Cancelled
    void finish();

 private:
    void poll_stop() const;
    void hear();
    void hang_up() noexcept;
    bool has_ended(bool waits) noexcept;
    [[noreturn]] void fail();

    std::string about_;
    const std::atomic<bool>* stop_;
    pid_t child_ = -1;
    int to_ = -1, said_ = -1;  // its input; what it complains about
    int status_ = 0;
    std::string complaint_;  // the end of it
};

}  // namespace edgewise::store
