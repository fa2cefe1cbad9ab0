#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "graph/filtering.hpp"
#include "graph/job.hpp"
#include "graph/mode.hpp"
#include "graph/radon.hpp"
#include "graph/samples.hpp"

namespace edgewise {

/// A request that an edge is timed on (Transition::trials). Several edges may name the same one: it
/// runs once, by all paths, and each of their steps is timed.
struct Trial {
    Job job;
    std::string input;              // samples by a formula: "phantom:gaussians:112"
    Type type = Type::f32;          // that they are rounded to
    std::vector<double> turn = {};  // [degree] one number of an image, three of a volume

    // What the request says beyond that.
    std::optional<Mode> mode = {};  // of pictures
    std::int64_t size = 0;          // width and height of the screen; 0: those of the input
    int frames = 0;                 // of a turntable; 0: one view
    double perspective = 0;         // [degree] of the view; 0: parallel rays
    bool lit = false;               // light falls on the samples
    /// Of filter jobs: an operation, and a kernel by its shape and radius or deviation [sample].
    struct Neighbourhood {
        FilterOp op = FilterOp::convolve;
        Stencil::Shape shape = Stencil::Shape::box;
        double size = 1;
        friend bool operator==(const Neighbourhood&, const Neighbourhood&) = default;
    };
    std::optional<Neighbourhood> filter = {};
    std::optional<RadonSetting> radon = {};  // of radon jobs
    std::optional<double> isovalue = {};     // of surfaces

    // What becomes of the samples before.
    bool labels = false;        // stored numbers are labels
    bool empty_around = false;  // they fill only the middle of their box

    // What is timed.
    /// One path alone: the cheapest by this edge, and of it this edge's step.
    bool alone = false;
    bool fine = false;  // also rays with several samples a voxel

    // When.
    enum class Part {
        full,   // of a calibration
        quick,  // of a quick one
        exam    // it is not timed, but predicted: how far that is off is the profile's spread
    };
    Part part = Part::full;
    /// Trials of a smaller order run before others: what most requests resemble comes first, as
    /// time may run out.
    int order = 0;

    friend bool operator==(const Trial&, const Trial&) = default;
};

/// What `all` has and `more` has, each once: those of `all` first.
void join(std::vector<Trial>& all, const std::vector<Trial>& more);

}  // namespace edgewise
