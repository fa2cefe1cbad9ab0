#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "graph/message.hpp"

namespace edgewise {

struct Input;

/// Whom a request tells what it does, and who may end it. By default nobody is told anything.
/// All but the flag is used by one thread at a time.
class Listener {
 public:
    Listener() = default;
    virtual ~Listener() = default;
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// What is wrong with the result or may be; the same words count once.
    void warning(const Message& text);
    /// What is wrong with a file: what its reader found, not what the request makes of it. Each
    /// request finds it again, so a listener may leave out what it has said before.
    virtual void file_warnings(const Input& file, const std::vector<Message>& found);
    const std::vector<Message>& warnings() const noexcept { return warnings_; }

    /// Worth knowing, and nothing is wrong with the result.
    virtual void notice(const Message&) {}
    /// A share of the work is done.
    virtual void progress(double, const std::string&) {}
    virtual void end_progress() {}
    /// A step goes on for long; may come from another thread.
    virtual void step_begun(const std::string&) {}

    /// Set by whoever wants the work to end. Runs, measurements and verifying look at it often,
    /// reading and planning before they begin.
    virtual const std::atomic<bool>& stop() const noexcept { return stop_; }
    void end() noexcept { stop_ = true; }

    /// From now on all samples and scratch of the request take at most so many bytes.
    virtual void memory_opened(double) {}

    /// What the work is doing, for whoever decides how it may be ended.
    enum class State {
        unobserved,  // it reads or plans: nothing is half done, and nobody looks at the flag
        collecting,  // there are results to keep: only the flag may end it
        planning,    // a path is chosen, which may take long
    };
    virtual void begins(State) {}
    virtual void ends(State) {}

 protected:
    virtual void on_warning(const Message&) {}
    /// Counts a warning that is not said. @return whether it is new
    bool counts(const Message& text);

 private:
    std::vector<Message> warnings_;
    std::atomic<bool> stop_ = false;
};

/// Tells a listener what the work does for as long as it lives.
class InState {
 public:
    InState(Listener& listener, Listener::State state) : listener_(listener), state_(state) {
        listener_.begins(state_);
    }
    ~InState() { listener_.ends(state_); }
    InState(const InState&) = delete;
    InState& operator=(const InState&) = delete;

 private:
    Listener& listener_;
    Listener::State state_;
};

}  // namespace edgewise
