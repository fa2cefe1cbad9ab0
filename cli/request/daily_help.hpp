#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace edgewise::cli {

/// Help as people need it on most days: what a verb is for, examples, and the options that are
/// asked for most, at most 40 lines of 100 columns. `--help-all` lists all options, in groups.
/// Verbs without such a page get the list.
std::shared_ptr<CLI::FormatterBase> daily_help();

}  // namespace edgewise::cli
