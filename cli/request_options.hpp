#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/geometry.hpp"
#include "cli/messages.hpp"

namespace edgewise::cli {

/// A request as it was typed: texts, read when all of them are there.
struct JobOptions {
    Job job = Job::render;
    std::string input;
    std::optional<std::string> out;
    GeometryWords geometry;
    std::optional<std::string> orient, series, time, channel;
    std::optional<std::string> mode, zero, background, transfer, window, outside;
    std::optional<std::string> max_error, range, reference, max_time, max_memory, minimize;
    std::optional<std::string> threads, machine, planner;
    std::vector<std::string> via, without;
    std::optional<std::string> bits, quality, json, verify, seed, repeat, trace, flow;
    std::optional<std::string> progress, log;
    bool explain = false, quiet = false;
};

enum class OutNeeded { yes, no, absent };

/// Adds what `warp` or `render` takes. Call order_geometry when parsed.
void add_job_options(CLI::App& app, JobOptions& options, OutNeeded out);

/// Puts the geometry into the order in which it was given.
void order_geometry(const CLI::App& app, JobOptions& options);

/// Adds an option of which the last counts.
CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& into,
                      const std::string& help);

}  // namespace edgewise::cli
