#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "settings/settings.hpp"

namespace edgewise::cli {

/// A request as it was typed: texts for settings of the query, and what concerns words, files and
/// terminals alone.
struct JobOptions {
    Job job = Job::render;
    std::string input;
    std::optional<std::string> out;
    std::vector<Given> given;  // in the order given
    std::optional<std::string> json, report, trace, flow, stop_after, progress, log, machine, mpr;
    std::vector<std::string> words;  // of the command line, as it was typed
    bool explain = false, explain_all = false, quiet = false, progressive = false;

    bool has(std::string_view setting) const { return text(setting).has_value(); }
    /// The last text that is given for a setting.
    std::optional<std::string> text(std::string_view setting) const;
    /// In place of the last one, or behind all others.
    void put(std::string_view setting, const std::string& text);
    void drop(std::string_view setting);
};

/// Reads all texts that say what is asked for. @throws RequestError
Query spec_of(const JobOptions& options, const Catalogue& edges);

/// Which of several things in a file are meant, and what is said in its place. @throws RequestError
/// also where several channels or all time points are named
store::Selection selection_of(const JobOptions& options);

/// Whether --time asks for all time points: a film of a render, a series of a filter.
bool names_all_times(const JobOptions& options);

}  // namespace edgewise::cli
