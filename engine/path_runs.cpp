#include "engine/path_runs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <tbb/task_arena.h>

#include "engine/planned.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "measure/repeated.hpp"
#include "measure/since.hpp"
#include "measure/watch.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

/// From now on resident_peak() counts anew. @return false where the system does not let us
bool reset_resident_peak() {
    std::ofstream stream("/proc/self/clear_refs");
    return static_cast<bool>(stream << "5" << std::flush);
}

}  // namespace

double MeasuredPath::typical() const { return seconds.empty() ? *first : undisturbed(seconds); }

double MeasuredPath::least() const {
    return seconds.empty() ? *first : *std::min_element(seconds.begin(), seconds.end());
}

std::vector<MeasuredPath> unmeasured(const TriedPaths& tried,
                                     const std::vector<std::string>* chosen) {
    std::vector<MeasuredPath> paths(tried.plans.size());
    for (std::size_t i = 0; i < paths.size(); ++i) {
        paths[i].steps = tried.plans[i].texts();
        paths[i].predicted = tried.plans[i].predicted;
        paths[i].front = tried.front[i];
        paths[i].chosen = chosen && paths[i].steps == *chosen;
    }
    return paths;
}

PathRuns::PathRuns(const Planned& planned, Listener& messages, std::vector<MeasuredPath>& paths,
                   const std::vector<Plan>& plans, const PathSettings& settings,
                   double resident_before)
    : planned_(planned),
      messages_(messages),
      paths_(paths),
      plans_(plans),
      resident_before_(resident_before),
      reference_memory_(std::size_t{1} << 46),
      field_(*planned.input.data, planned.want.field,
             planned.input.phantom ? &*planned.input.phantom : nullptr),
      verifier_(planned.want, field_, settings.samples.value_or(samples_to_compare(planned.want)),
                settings.seed, &reference_memory_) {}

void PathRuns::run_first(std::size_t i, double limit, const Deliver& look) {
    MeasuredPath& path = paths_[i];
    // As a process that runs this path alone would hold it.
    planned_.memory->trim();
    planned_.memory->reset_peak();
    const auto held = static_cast<double>(planned_.memory->used());
    const double resident = resident_now();
    const bool counts = reset_resident_peak();
    double delivering = 0;
    const Deliver deliver = [&](int frame, const std::shared_ptr<const Data>& result) {
        const auto begin = Clock::now();
        // Waiting for its own tiles, this thread must not begin another frame's step.
        tbb::this_task_arena::isolate([&] { verifier_.frame(frame, *result); });
        if (look) look(frame, result);
        delivering += since(begin);
    };
    const std::optional<Outcome> outcome = run_once(i, limit, deliver);
    // What the process needs more than before; what verifying holds does not count.
    const double grown = resident_peak() - resident;
    const Verified error = verifier_.finish();
    if (!outcome) return;
    const Request& want = planned_.want;
    const int side_by_side = std::max(1, std::min(want.threads, want.frames));
    path.first = std::max(0.0, outcome->seconds - delivering / side_by_side);
    path.bytes = planned_.resident + static_cast<double>(outcome->peak);
    if (counts) path.resident_bytes = resident_before_ + held + std::max(0.0, grown);
    path.error = error;
}

/// @return nothing where it failed or was given up
std::optional<Outcome> PathRuns::run_once(std::size_t i, double limit, const Deliver& deliver) {
    MeasuredPath& path = paths_[i];
    const std::atomic<bool>& stop = messages_.stop();
    // Its thread would take a processor from a brief run.
    std::optional<Watch> watch;
    if (std::isfinite(limit)) watch.emplace(limit, stop);
    RunOptions options;
    options.threads = planned_.want.threads;
    options.arenas = &planned_.engine.arenas();
    options.memory = planned_.memory.get();
    options.stop = watch ? &watch->flag() : &stop;
    try {
        return run(plans_[i], planned_.ask(), planned_.input.data, deliver, options);
    } catch (const Cancelled&) {
        if (!watch || stop) throw;
        path.given_up = watch->elapsed();
    } catch (const std::bad_alloc&) {
        path.failure = "out of memory";
    } catch (const Exception& error) {
        path.failure = error.message();
    } catch (const std::exception& error) {
        path.failure = error.what();
    }
    return std::nullopt;
}

void PathRuns::run_again(std::size_t i) {
    constexpr double kAsLongAsItTakes = std::numeric_limits<double>::infinity();
    const Deliver nothing = [](int, const std::shared_ptr<const Data>&) {};
    if (last_ != i && needs_warming(paths_[i].least()) && !run_once(i, kAsLongAsItTakes, nothing))
        return;
    last_ = i;
    if (const auto outcome = run_once(i, kAsLongAsItTakes, nothing))
        paths_[i].seconds.push_back(outcome->seconds);
}

void PathRuns::run_round(int round, const std::function<bool(std::size_t)>& wanted,
                         const std::function<void(std::size_t)>& begins) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < paths_.size(); ++i)
        if (paths_[i].measured() && paths_[i].failure.empty() && wanted(i)) order.push_back(i);
    if (round % 2) std::reverse(order.begin(), order.end());
    for (const std::size_t i : order) {
        if (begins) begins(i);
        run_again(i);
    }
}

}  // namespace edgewise
