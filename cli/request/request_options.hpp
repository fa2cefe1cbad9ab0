#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/request/job_options.hpp"
#include "cli/request/selection_words.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace edgewise::cli {

enum class OutNeeded { yes, no, absent };

/// Adds what `warp`, `render` or `mesh` takes. Call order_geometry when parsed.
void add_job_options(CLI::App& app, JobOptions& options, OutNeeded out);

/// Puts the geometry into the order in which it was given.
void order_geometry(const CLI::App& app, JobOptions& options);

/// The command line again, words of an option beside it: "edgewise", "render", "FILE", ...
std::vector<std::string> typed_words(const CLI::App& app);

/// Adds an option of which the last counts.
CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& into,
                      const std::string& help);

/// Adds what says which part of FILE is meant, and what FILE fails to say.
void add_selection(CLI::App& app, SelectionWords& words);

}  // namespace edgewise::cli
