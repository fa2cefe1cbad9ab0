#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/reached.hpp"

namespace edgewise {

/// Tells a series' listener what one of its requests does: of progress a share of all.
class SeriesListener final : public Listener {
 public:
    explicit SeriesListener(Listener& to) : to_(to) {}

    int frame = 0, frames = 1;

    void notice(const Message& text) override {
        if (frame == 0) to_.notice(text);
    }
    void progress(double share, const std::string& step) override {
        to_.progress((frame + share) / frames, step);
    }
    void end_progress() override {
        if (frame + 1 == frames) to_.end_progress();
    }
    void step_begun(const std::string& step) override { to_.step_begun(step); }
    const std::atomic<bool>& stop() const noexcept override { return to_.stop(); }
    void file_warnings(const Input& file, const std::vector<Message>& found) override {
        for (const Message& text : found) counts(text);
        to_.file_warnings(file, found);
    }
    void memory_opened(double bytes) override { to_.memory_opened(bytes); }
    void begins(State state) override { to_.begins(state); }
    void ends(State state) override { to_.ends(state); }

 protected:
    void on_warning(const Message& text) override { to_.warning(text); }

 private:
    Listener& to_;
};

/// All time points of a volume, a picture each: a film over time. The first one is planned, and its
/// plan serves all, since they have one shape. They are read one after another, so that memory
/// holds the samples of one. What hangs on values (what misses show, an X-ray's zero, where a grey
/// ramp runs) goes by the range of all time points, and all go through one window, so that nothing
/// flickers.
///
/// Budgets: seconds are those of all time points, errors each one's own, bytes the process's.
struct Series {
    /// @param request   of all of them; its selection names no time, and its geometry has one view
    /// @param listener  outlives it
    Series(Query request, Engine means, Listener& listener)
        : query(std::move(request)), engine(std::move(means)), messages(listener), told(listener) {}

    const Query query;
    const Engine engine;
    Listener& messages;
    bool runs = false;  // and is not only planned
    Effort effort;
    int times = 1;
    SeriesListener told;
    std::optional<Reached> first;      // its request, plan and measurements
    std::optional<Measured> measured;  // of all: seconds are sums, the error is the largest
    double read_seconds = 0;
    std::vector<std::string> files;  // written
};

/// Plans a series and, where `runs`, renders its pictures and writes them.
/// @param planned  told the first time point when it has a plan, before it runs
/// @throws RequestError, InputError, NoPlan, Cancelled, RunError, std::bad_alloc
void perform(Series& series, const std::function<void(Planned& first)>& planned = {},
             const FrameSink& sink = {});

/// What is predicted for all time points: seconds of that many times the first.
Predicted predicted_of(const Series& series);

}  // namespace edgewise
