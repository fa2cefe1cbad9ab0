#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/paths.hpp"
#include "graph/cost.hpp"
#include "reference/verify.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {

class Listener;
struct Planned;

/// How the paths of a request are measured.
struct PathSettings {
    std::size_t limit = 200;  // paths a request
    int repeat = 5;           // warm runs of every path that is worth them
    std::optional<std::int64_t>
        samples;             // output samples that an error is measured on, 0: all; absent: all of
                             // a small output, many of a large one (samples_to_compare)
    std::uint64_t seed = 1;  // of these samples, and of the paths beyond the limit
};

/// One path: what it was predicted to take, and what it took.
struct MeasuredPath {
    std::vector<std::string> steps;
    Predicted predicted;
    bool front = false, chosen = false;
    std::optional<double> first;     // [s], with cold caches
    std::vector<double> seconds;     // of further runs
    std::optional<double> given_up;  // [s] after which it was stopped: it takes longer
    double bytes = 0;                // peak: what the process held before, and what was counted
    std::optional<double>
        resident_bytes;  // peak as the system sees it, without what measuring holds
    std::optional<Verified> error;
    Message failure;  // why it has no result

    bool measured() const noexcept { return first.has_value(); }
    /// undisturbed() of the warm runs, or the cold run where there is no other.
    double typical() const;
    double least() const;
};

/// The paths to run, with nothing measured yet. @param chosen  the planner's, where it has one
std::vector<MeasuredPath> unmeasured(const TriedPaths& tried,
                                     const std::vector<std::string>* chosen);

/// Runs the paths of one request in this process. First each alone, with its error and with the
/// memory that a process of its own would hold. Then in rounds, interleaved, so that the machine's
/// load meets all of them alike. The caller decides which paths are worth more runs.
class PathRuns {
 public:
    /// All must stay alive. @param resident_before  bytes of the process without counted samples
    PathRuns(const Planned& planned, Listener& messages, std::vector<MeasuredPath>& paths,
             const std::vector<Plan>& plans, const PathSettings& settings, double resident_before);

    /// The first run. @param limit  stopped after so long [s]
    /// @param look  receives every frame's result, untimed
    /// @throws Cancelled
    void run_first(std::size_t i, double limit, const Deliver& look = {});
    /// One more run of a path that has run; where another path ran before a short one runs twice,
    /// and the second run counts. @throws Cancelled
    void run_again(std::size_t i);
    /// One more run of every path that has run and is wanted; the order is reversed every time.
    /// @param begins  is called before each run
    /// @throws Cancelled
    void run_round(int round, const std::function<bool(std::size_t)>& wanted,
                   const std::function<void(std::size_t)>& begins = {});

    const ReferenceField& field() const noexcept { return field_; }
    MemoryBudget& reference_memory() noexcept { return reference_memory_; }

 private:
    std::optional<Outcome> run_once(std::size_t i, double limit, const Deliver& deliver);

    const Planned& planned_;
    Listener& messages_;
    std::vector<MeasuredPath>& paths_;
    const std::vector<Plan>& plans_;
    double resident_before_;
    std::optional<std::size_t> last_;  // path that ran
    MemoryBudget reference_memory_;    // what verifying takes is not the paths'
    ReferenceField field_;
    Verifier verifier_;
};

}  // namespace edgewise
