#pragma once

#include <string>
#include <vector>

#include "graph/trial.hpp"

namespace edgewise {

// Trials that edges of several families share (Transition::trials): sizes within the caches and
// beyond; volumes that are full or mostly empty, seen along different axes.

/// Pictures whose rays take one kind of loop: max, sum, over or mean. Many of the volume, few of
/// its pixels, more pixels than samples.
std::vector<Trial> picture_trials(Combine loop);
/// Those of all these loops.
std::vector<Trial> picture_trials();
/// Pictures of samples that light falls on.
std::vector<Trial> lit_trials();
/// Pictures from an eye at a finite distance.
std::vector<Trial> perspective_trials();

/// Volumes and images, turned by a few degrees and by quarters.
std::vector<Trial> warp_trials();

/// A step from samples to samples, on the way to a picture: it costs what memory does, so that it
/// depends on sizes, and is timed alone.
Trial copy_trial(const std::string& input, Type type, const std::vector<double>& turn);

/// The triangles of a surface of a level, and a picture of it: both of one edge alone.
Trial mesh_trial(const std::string& input, Type type = Type::u8);
Trial surface_trial(const std::string& input, Type type = Type::u8);
/// The same of surfaces around labels.
Trial of_labels(Trial trial);

/// Where among all trials those of one family run (Trial::order).
enum TrialOrder { kFilterTrials = 110, kLineTrials = 120, kSurfaceTrials = 130 };

}  // namespace edgewise
