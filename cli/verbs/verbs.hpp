#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace edgewise::cli {

/// A verb: its part of the command line, and what it does once that is parsed.
struct Verb {
    CLI::App* app = nullptr;
    std::function<int()> run;  // exit code
};

/// One for each job that comes with the library.
std::vector<Verb> add_jobs(CLI::App& main);
Verb add_plan(CLI::App& main);
Verb add_graph(CLI::App& main);
Verb add_info(CLI::App& main);
Verb add_compare(CLI::App& main);
Verb add_list(CLI::App& main);
Verb add_calibrate(CLI::App& main);
Verb add_audit(CLI::App& main);
Verb add_advise(CLI::App& main);
Verb add_chart(CLI::App& main);

/// Runs `body` and says nothing. @return the exit code that it would end with, and why
int ending_of(const std::function<void()>& body, std::string& message);

/// Runs `body`, says what fails, and turns it into an exit code.
/// @param failed  told code and message, before they are said
int guarded(const std::function<int()>& body,
            const std::function<void(int code, const std::string& message)>& failed);

/// As guarded, for verbs whose report is no request's: a failure goes to --json as well.
int guarded_with_json(const std::optional<std::string>& json, const std::function<int()>& body);

}  // namespace edgewise::cli
