#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/run.hpp"

namespace edgewise {

/// A frame of a run, as soon as it is there.
struct Frame {
    int number = 0;
    /// f32 of pictures: [y][x][channel], a composite's four channels premultiplied. Of warps and
    /// filters [z][y][x][channel] in the type and with the value map that `what` says.
    const Data& samples;
};

/// How a plan is run.
struct RunWith {
    int threads = 0;                           // 0: those of the query
    const std::atomic<bool>* stop = nullptr;   // set by whoever wants the run to end
    std::function<void(Frame)> on_frame = {};  // one at a time, in any order, from any thread
    std::function<void(double share, const std::string& step)> on_progress = {};
    /// Samples of all frames, one after another, in the result's type; empty: nowhere.
    std::span<std::byte> into = {};
    /// In Prepared::Result::frames. While the run is on they count against the memory of the plan,
    /// then they are the caller's.
    bool keep_frames = false;
};

/// A request with a plan that can run: a value that never changes. It runs again and again, from
/// any number of threads at once; what all its runs share is made by the first of them and kept.
/// Copies share it too. A run that is like one before it makes nothing anew but the frames that it
/// keeps, and what some edges allocate for themselves (docs/design.md).
class Prepared {
 public:
    struct Result {
        std::vector<std::shared_ptr<const Data>> frames;        // where they are kept
        std::shared_ptr<const std::vector<std::string>> steps;  // that ran
        std::vector<Message> warnings;  // a step that failed, and what ran then
        double seconds = 0;
    };

    explicit Prepared(Planned planned);

    const Plan& plan() const noexcept { return *planned_->answer.plan; }
    /// All that is known of the request.
    const Planned& planned() const noexcept { return *planned_; }
    int frames() const noexcept { return planned_->want.frames; }
    /// Of one frame.
    Representation result() const;
    /// What was said while it was made: of the path that had to change, say.
    const std::vector<Message>& warnings() const noexcept { return warnings_; }

    /// @throws Cancelled, RunError, std::bad_alloc, RequestError (`into` has another size)
    Result run(const RunWith& with = {}) const;

    /// The same with other samples of the same shape and type (FFTW's new-array execute). What
    /// hangs on values (a window, a transfer function) stays. Path: see follow().
    /// @throws RequestError
    Prepared with_input(std::shared_ptr<const Data> samples) const;
    /// The same seen from elsewhere. Path: see follow().
    /// @throws RequestError
    Prepared with_views(const GeometrySpec& views) const;

 private:
    struct Shared;
    Prepared(Planned planned, std::vector<Message> warnings);
    /// What the rest of the plan begins with.
    std::shared_ptr<const Data> shared_input(const RunOptions& options) const;
    std::shared_ptr<const Planned> planned_;
    std::shared_ptr<Shared> shared_;
    std::vector<Message> warnings_;
};

/// Reads a query's input, plans, and keeps the samples for the runs, as a guest of the process.
/// @throws RequestError, InputError, Infeasible, Cancelled, std::bad_alloc
Prepared prepare(const Engine& engine, Query query, Opening as, const Effort& effort,
                 Listener& messages);
/// @param given  samples in place of the input's, see Opening
Prepared prepare(const Engine& engine, Query query, std::shared_ptr<const Data> given = nullptr,
                 const Effort& effort = {});

}  // namespace edgewise
