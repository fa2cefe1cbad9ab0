#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/request/job_options.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace edgewise::cli {

enum class OutNeeded { yes, no, absent };

/// Adds the settings of a job, and what is the command's own. Call take_given when parsed.
void add_job_options(CLI::App& app, JobOptions& options, OutNeeded out);

/// Takes what was typed for settings, in its order.
void take_given(const CLI::App& app, JobOptions& options);

/// The command line again, words of an option beside it: "edgewise", "render", "FILE", ...
std::vector<std::string> typed_words(const CLI::App& app);

/// Adds an option of which the last counts.
CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& into,
                      const std::string& help);

/// Adds what says which part of FILE is meant, and what FILE fails to say. Call take_given when
/// parsed.
void add_selection(CLI::App& app);

}  // namespace edgewise::cli
