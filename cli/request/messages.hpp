#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "engine/announced.hpp"
#include "engine/listener.hpp"

namespace edgewise::cli {

enum class Log { error, warning, info, debug };
enum class Progress { automatic, always, never };

/// Says on standard error what the work tells, ends it on a signal, and keeps the process within
/// its budget of memory.
class Messages : public Listener {
 public:
    /// --log, --progress. @throws RequestError
    void configure(const std::string& log, const std::string& progress, bool quiet);

    /// A share of the work is done: a bar on a terminal.
    void progress(double share, const std::string& step) override;
    /// A step is done: one line where there is no bar.
    void step_done(const std::string& step, double seconds);
    /// A step goes on for long; may be called by another thread while there is no bar.
    void step_begun(const std::string& step) override;
    /// What a run ends with.
    void result(const std::string& text);
    /// Worth knowing, and nothing is wrong with the result.
    void notice(const Message& text) override;
    /// Takes the bar away.
    void end_progress() override;
    const std::atomic<bool>& stop() const noexcept override;
    /// What earlier commands have told of a file is left out. But --log info and debug tell all,
    /// and who is told nothing by --quiet has not been told.
    void file_warnings(const Input& file, const std::vector<Message>& found) override;
    /// Libraries get std::bad_alloc where they would break a memory budget.
    void memory_opened(double bytes) override;
    /// That it plans is said where that takes long.
    void announces_planning(bool does) { announces_ = does; }
    void begins(State state) override;
    void ends(State state) override;

 protected:
    void on_warning(const Message& text) override;

 private:
    void say(const char* kind, const std::string& text);
    bool shows_bar() const noexcept;

    Log log_ = Log::warning;
    Progress progress_ = Progress::automatic;
    bool quiet_ = false, bar_ = false, announces_ = false;
    std::unique_ptr<Announced> planning_;
    std::chrono::steady_clock::time_point drawn_{};
};

/// Whether standard output may be coloured: a terminal, and no NO_COLOR.
bool colourful();

}  // namespace edgewise::cli
