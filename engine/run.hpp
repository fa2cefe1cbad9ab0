#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "charts/pictures.hpp"
#include "engine/planned.hpp"
#include "reference/verify.hpp"
#include "runtime/runtime.hpp"
#include "surface/mesh_measures.hpp"

namespace edgewise {

/// What a run turned out to take.
struct Measured {
    std::vector<double> seconds;       // one a repetition
    std::vector<std::string> steps;    // that ran
    std::vector<double> step_seconds;  // of the last repetition: wall time
    std::vector<Ran> trace;            // likewise
    double bytes = 0, write_seconds = 0;
    std::optional<bool> kept = true;  // the budgets; absent: it is open whether the error is
    std::optional<Verified> error;
    std::optional<Refined> refined;  // of the last repetition, where pictures on the way are seen
};

/// What the page of a run shows of its first result.
struct Shown {
    std::optional<charts::ReportPicture> picture, difference;
    double difference_scale = 0;  // [value]
    std::string no_difference;    // why there is none
};

/// The last stage: what came out.
struct Run {
    Measured measured;
    std::optional<surface::Measures> surface;  // of a mesh
    std::optional<Shown> shown;                // where the request was opened so that it is shown
    std::vector<std::string> files;            // written
};

/// Receives each frame of the last repetition, one at a time, in any order, before budgets are
/// judged. It is what the path made (a mesh lies Geometry::offset away from where the file says):
/// pictures are f32 (a composite's four channels premultiplied);
/// the samples of a warp have the type and the value map that `what` says, labels that f32 cannot
/// hold are places in Input::table.
using FrameSink = std::function<void(int frame, const Data& result)>;

/// Where results go.
struct Sinks {
    FrameSink frames = {};
    bool files = true;  // those that the request names; else results go to `frames` alone
};

/// Runs a plan, verifies and writes. The samples are the caller's: who moves the only reference in
/// gives them back before results are written.
/// @throws Cancelled, RunError, std::bad_alloc
Run run(const Planned& planned, std::shared_ptr<const Data> samples, const Sinks& sinks,
        Listener& messages);
/// Of the stage's own samples, which it gives away.
Run run_once(Planned& planned, const Sinks& sinks, Listener& messages);

}  // namespace edgewise
