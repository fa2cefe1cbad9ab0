#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace edgewise::cli {

enum class Log { error, warning, info, debug };
enum class Progress { automatic, always, never };

/// What goes to standard error, and the warnings that also enter the report.
class Messages {
 public:
    /// --log, --progress. @throws RequestError
    void configure(const std::string& log, const std::string& progress, bool quiet);

    void error(const std::string& text);
    void warning(const std::string& text);
    void info(const std::string& text);
    void debug(const std::string& text);
    const std::vector<std::string>& warnings() const noexcept { return warnings_; }

    /// A share of the work is done: a bar on a terminal.
    void progress(double share, const std::string& step);
    /// A step is done: one line where there is no bar.
    void step_done(const std::string& step, double seconds);
    /// A step goes on for long; may be called by another thread while there is no bar.
    void step_begun(const std::string& step);
    /// What a run ends with.
    void result(const std::string& text);
    /// Worth knowing, and nothing is wrong with the result.
    void notice(const std::string& text);
    /// Takes the bar away.
    void end_progress();

 private:
    void say(const char* kind, const std::string& text);
    bool shows_bar() const noexcept;

    Log log_ = Log::warning;
    Progress progress_ = Progress::automatic;
    bool quiet_ = false, bar_ = false;
    std::chrono::steady_clock::time_point drawn_{};
    std::vector<std::string> warnings_;
};

/// Whether standard output may be coloured: a terminal, and no NO_COLOR.
bool colourful();

}  // namespace edgewise::cli
