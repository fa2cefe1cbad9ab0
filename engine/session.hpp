#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "charts/pictures.hpp"
#include "engine/announced.hpp"
#include "engine/listener.hpp"
#include "engine/refinement.hpp"
#include "engine/request/errors.hpp"
#include "engine/request/input.hpp"
#include "engine/request/make_request.hpp"
#include "engine/request/outputs.hpp"
#include "engine/way_out.hpp"
#include "engine/written.hpp"
#include "planner/margin.hpp"
#include "reference/verify.hpp"
#include "runtime/runtime.hpp"
#include "scene/statistics.hpp"
#include "surface/mesh_measures.hpp"

namespace edgewise {

struct Session;

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

/// When errors are measured on a preview: never, so that they are guessed; where a choice depends
/// on them; or because somebody wants to know them.
enum class ErrorsWanted { never, for_choice, asked };

/// What a time point takes from a series, so that its picture can be held against the others'.
struct InSeries {
    double low = 0, high = 0;        // of the values of all of them
    const Session* first = nullptr;  // that what hangs on values is taken from; null: it is this
    const Input* file = nullptr;     // the description of any time point: all have one
};

/// What choosing took [s].
struct Spent {
    double statistics = 0, preset = 0, preview = 0, search = 0, pilot = 0;

    double all() const noexcept { return statistics + preset + preview + search + pilot; }
};

/// One request on its way from its words to a result. What is not there yet when something fails
/// stays empty.
struct Session {
    /// @param catalogue  that paths are made of
    /// @param machine    whose seconds are predicted
    /// @param listener   outlives it
    Session(RequestSpec asked, Catalogue catalogue, Profile machine, Listener& listener)
        : spec(with_smoothing(std::move(asked), catalogue)),
          messages(listener),
          request(request_of(spec)),
          window(spec.window),
          profile(std::move(machine)),
          edges(std::move(catalogue)) {}

    const RequestSpec spec;
    Listener& messages;
    bool runs = false;       // and is not only planned: on one rank, with data
    bool explained = false;  // the plan is shown with where its numbers come from
    bool writes = true;      // else results go to the caller alone, in the form of the output
    bool shows = false;      // pictures of the result are made, and of its error
    ErrorsWanted errors = ErrorsWanted::asked;
    std::unique_ptr<MemoryBudget> memory;  // before all data, which give their bytes back to it
    double resident = 0;                   // bytes of the process without `memory`
    double peak_before = 0;                // most bytes that the process ever had until then
    Request request;                       // what the graph knows of it
    bool threads_of_machine = false;       // its threads are the profile's, of one rank
    std::optional<Window> window;          // of the result; nothing where it became a grey ramp
    std::optional<TakenPreset> preset;     // of modes with a transfer function, where there is one
    std::optional<Outputs> outputs;
    Profile profile;
    Catalogue edges;
    /// Samples in place of the input's: then none are read. Where the input has no name they are
    /// all that is known of it: samples one unit apart, or as the spec's selection says.
    std::shared_ptr<const Data> given;
    /// Takes pictures on the way, of edges that have its watch.
    std::shared_ptr<Refinement> refinement;
    std::optional<Input> input;
    Geometry geometry;
    Statistics statistics;  // of the input's samples, where there are any
    std::optional<InSeries> series;
    Scene scene;
    int drawn = 1;  // so many times the usual draws of its preview; 0: none, errors are guesses
    Spent spent;
    bool announces = false;               // that it plans, where that takes long
    std::unique_ptr<Announced> planning;  // while it does
    Written written;
    PlanOptions plan_options;
    std::optional<Answer> answer;
    std::optional<Margin> margin;   // of its plan
    std::optional<WayOut> way_out;  // where it has none
    std::optional<Measured> measured;
    std::optional<surface::Measures> surface;  // of a mesh
    std::optional<Shown> shown;                // where `shows`
    std::vector<std::string> files;            // written

    const Request& want() const noexcept { return request; }
    Ask ask() const noexcept { return {request, scene}; }
    /// Frames are written as they come; else they wait until all are there: the default window of
    /// values needs the range of all.
    bool writes_at_once() const noexcept;
    /// Where a path may start: at the samples in memory; where there are ranks, also at the samples
    /// on disk, of which every rank reads its share.
    std::vector<Source> sources() const;
    /// The priced graph that the answer was read from; before there is one, a new one.
    std::shared_ptr<const PricedGraph> graph() const;
};

/// Measures what errors and ray casts depend on.
/// @param draw  a preview too; without one, errors are guesses unless an earlier run kept them
void look_at_data(Session& session, bool draw);

/// Checks what is to be written, reads the input, and measures its scene.
/// @throws RequestError, InputError, NoPlan
void take_request(Session& session);

/// What the planner is told in addition to request and scene, as the process is now.
void prepare_planning(Session& session);

/// Asks the planner. @throws RequestError, NoPlan
void make_plan(Session& session);

/// Takes the errors out of the answer where nobody asked for them: some may be guesses.
void forget_errors(Session& session);

/// Receives each frame of the last repetition, one at a time, in any order, before budgets are
/// judged. It is what the path made (a mesh lies Geometry::offset away from where the file says):
/// pictures are f32 (a composite's four channels premultiplied);
/// the samples of a warp have the type and the value map that `what` says, labels that f32 cannot
/// hold are places in Input::table.
using FrameSink = std::function<void(int frame, const Data& result)>;

/// Runs the plan, verifies and writes. @throws Cancelled, RunError, std::bad_alloc
void perform(Session& session, const FrameSink& frames = {});

}  // namespace edgewise
