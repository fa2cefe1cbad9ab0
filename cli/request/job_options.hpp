#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/request/geometry_words.hpp"
#include "cli/request/selection_words.hpp"

namespace edgewise::cli {

/// A request as it was typed: texts, read when all of them are there.
struct JobOptions {
    Job job = Job::render;
    std::string input;
    std::optional<std::string> out;
    GeometryWords geometry;
    SelectionWords selection;
    std::optional<std::string> mode, zero, background, transfer, preset, window, exposure, outside,
        isovalue, smooth;
    std::optional<std::string> op, kernel, border;     // of filter
    std::optional<std::string> angles, to, threshold;  // of radon
    std::optional<std::string> shade, gradient, material, phase, cue, occlusion;
    std::vector<std::string> lights;
    std::optional<std::string> max_error, range, reference, max_time, max_memory, minimize;
    std::optional<std::string> threads, ranks, machine, planner, planning_time;
    std::vector<std::string> via, without;
    std::optional<std::string> bits, quality, fps, json, verify, seed, repeat, trace, flow;
    std::optional<std::string> progress, log;
    std::optional<std::string> report, stop_after;
    std::vector<std::string> words;          // of the command line, as it was typed
    std::optional<std::string> only_labels;  // of --labels=12,13
    std::optional<std::string> colormap, montage, decimate, mpr;
    bool legend = false, scale_bar = false, depth_colour = false, lids = false, largest = false;
    bool explain = false, explain_all = false, quiet = false, strict = false, labels = false,
         shadows = false, progressive = false, slices = false, inverse = false;
};

/// Reads all texts that say what is asked for. @throws RequestError
Query spec_of(const JobOptions& options, const Catalogue& edges);

/// None, and the rules of light that some mode takes.
std::vector<Shade> known_shades();

/// --window: "0,255", "1%,99.5%", "W400L40", "lung". @throws RequestError
Window window_of(const std::string& text);

/// --verify=N: a number of samples, or all (0). @throws RequestError
std::size_t verify_count(const std::string& text);

}  // namespace edgewise::cli
