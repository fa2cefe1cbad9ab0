#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <malloc.h>
#include <numeric>
#include <sys/resource.h>
#include <tbb/task_arena.h>

#include "cli/audit.hpp"
#include "cli/machine.hpp"
#include "cli/paths.hpp"
#include "cli/quantiles.hpp"
#include "cli/session.hpp"
#include "cli/signals.hpp"
#include "cli/watch.hpp"
#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

/// A path slower than the best by this factor needs no further runs, and none is waited for that
/// takes longer than the next: it cannot be the fastest.
constexpr double kNoRival = 1.5, kHopeless = 4;
constexpr double kPatience = 0.25;  // [s]; shorter runs are never given up: their errors tell
/// Runs up to kCheap are repeated at least kFewRuns times: their predicted seconds are judged too.
constexpr double kCheap = 0.05;  // [s]
constexpr int kFewRuns = 3;
/// Paths this close to the best are run on until they have kMoreRuns times the runs, or for
/// kMoreSeconds: the least of several medians is too small by what they scatter.
constexpr double kClose = 1.15, kMoreSeconds = 0.5;
constexpr int kMoreRuns = 4;

double since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// From now on resident_peak() counts anew. @return false where the system does not let us
bool reset_resident_peak() {
    std::ofstream stream("/proc/self/clear_refs");
    return static_cast<bool>(stream << "5" << std::flush);
}

/// A memory budget fences the whole process in; the next request must not inherit it.
class OwnLimits {
 public:
    OwnLimits() { getrlimit(RLIMIT_DATA, &before_); }
    ~OwnLimits() { setrlimit(RLIMIT_DATA, &before_); }
    OwnLimits(const OwnLimits&) = delete;
    OwnLimits& operator=(const OwnLimits&) = delete;

 private:
    rlimit before_{};
};

/// The runs of one request: all paths once, with their errors, then in rounds.
class Rounds {
 public:
    Rounds(Session& session, AuditedRequest& request, const std::vector<Plan>& plans,
           const AuditSettings& settings, double resident_before)
        : session_(session),
          resident_before_(resident_before),
          request_(request),
          plans_(plans),
          settings_(settings),
          reference_memory_(std::size_t{1} << 46),
          field_(*session.input->data, session.want().field,
                 session.input->phantom ? &*session.input->phantom : nullptr),
          verifier_(session.want(), field_, settings.samples, settings.seed, &reference_memory_) {}

    void run_all() {
        // The chosen path first: what it takes bounds the patience with the others.
        for (std::size_t i = 0; i < plans_.size(); ++i)
            if (path(i).chosen) run_first(i);
        for (std::size_t i = 0; i < plans_.size(); ++i)
            if (!path(i).chosen) run_first(i);
        for (int round = 0; round < settings_.repeat; ++round)
            run_round(round, [&](std::size_t i) { return may_win(i); });
        const auto begin = Clock::now();
        for (int round = settings_.repeat; round < kMoreRuns * settings_.repeat; ++round) {
            if (since(begin) > kMoreSeconds) break;
            if (!run_round(round, [&](std::size_t i) { return is_close(i); })) break;
        }
    }

 private:
    AuditedPath& path(std::size_t i) { return request_.paths[i]; }

    /// The least median of the paths that keep the budgets; of the chosen one where none does.
    const AuditedPath& best() const {
        const AuditedPath* best = nullptr;
        for (const AuditedPath& path : request_.paths)
            if (path.measured() && keeps_budgets(path, request_) &&
                (!best || path.median() < best->median()))
                best = &path;
        return best ? *best : request_.chosen();
    }

    void run_first(std::size_t i) {
        AuditedPath& path = this->path(i);
        // As a process that runs this path alone would hold it.
        session_.memory->trim();
        session_.memory->reset_peak();
        const auto held = static_cast<double>(session_.memory->used());
        const double resident = resident_now();
        const bool counts = reset_resident_peak();
        double limit = std::numeric_limits<double>::infinity();
        if (!path.chosen && best().measured())
            limit = std::max(kPatience, kHopeless * best().median());
        double delivering = 0;
        const Deliver deliver = [&](int frame, const std::shared_ptr<const Data>& result) {
            const auto begin = Clock::now();
            // Waiting for its own tiles, this thread must not begin another frame's step.
            tbb::this_task_arena::isolate([&] { verifier_.frame(frame, *result); });
            delivering += since(begin);
        };
        const std::optional<Outcome> outcome = run_once(i, limit, deliver);
        // What the process took more than before; what verifying holds beside it does not count.
        const double grown = resident_peak() - resident;
        const Verified error = verifier_.finish();
        if (!outcome) return;
        const int side_by_side = std::max(1, std::min(request_.threads, request_.frames));
        path.first = std::max(0.0, outcome->seconds - delivering / side_by_side);
        path.bytes = session_.resident + static_cast<double>(outcome->peak);
        if (counts) path.resident_bytes = resident_before_ + held + std::max(0.0, grown);
        path.error = error;
    }

    /// @return nothing where it failed or was given up
    std::optional<Outcome> run_once(std::size_t i, double limit, const Deliver& deliver) {
        AuditedPath& path = this->path(i);
        const Watch watch(limit);
        RunOptions options;
        options.threads = request_.threads;
        options.memory = session_.memory.get();
        options.stop = &watch.flag();
        try {
            return run(plans_[i], session_.ask(), session_.input->data, deliver, options);
        } catch (const Cancelled&) {
            if (stop_flag()) throw;
            path.given_up = watch.elapsed();
        } catch (const std::bad_alloc&) {
            path.failure = "out of memory";
        } catch (const std::exception& error) {
            path.failure = error.what();
        }
        return std::nullopt;
    }

    /// Every path that is still of interest once; the order turns round every time.
    template <class Wanted>
    bool run_round(int round, const Wanted& wanted) {
        std::vector<std::size_t> order;
        bool rival = false;
        for (std::size_t i = 0; i < plans_.size(); ++i) {
            if (!path(i).measured() || !path(i).failure.empty()) continue;
            if (!path(i).chosen && !wanted(i)) continue;
            rival = rival || !path(i).chosen;
            order.push_back(i);
        }
        if (round % 2) std::reverse(order.begin(), order.end());
        for (const std::size_t i : order) {
            const auto outcome = run_once(i, std::numeric_limits<double>::infinity(),
                                          [](int, const std::shared_ptr<const Data>&) {});
            if (outcome) path(i).seconds.push_back(outcome->seconds);
        }
        return rival;
    }

    /// Until its least time is beyond the best by more than what that scatters.
    bool may_win(std::size_t i) {
        const AuditedPath &path = this->path(i), &best = this->best();
        if (path.seconds.empty())
            return *path.first <= std::max(kPatience, kHopeless * best.median());
        if (path.seconds.size() < kFewRuns && path.least() < kCheap) return true;
        return path.least() <= kNoRival * best.median() + 3 * scatter(best.seconds);
    }

    bool is_close(std::size_t i) {
        const AuditedPath &path = this->path(i), &best = this->best();
        return keeps_budgets(path, request_) && path.least() <= kClose * best.median();
    }

    static double scatter(const std::vector<double>& seconds) {
        if (seconds.empty()) return 0;
        const double middle = median(seconds);
        std::vector<double> distances;
        for (const double one : seconds) distances.push_back(std::abs(one - middle));
        return median(distances);
    }

    Session& session_;
    double resident_before_;  // bytes of the process without the request
    AuditedRequest& request_;
    const std::vector<Plan>& plans_;
    const AuditSettings& settings_;
    MemoryBudget reference_memory_;  // what verifying takes is not the paths'
    ReferenceField field_;
    Verifier verifier_;
};

std::string family_of(const Request& want) {
    std::string family = want.job == Job::warp ? fmt::format("warp {}D", want.axes)
                                               : fmt::format("render {}", name_of(want.mode));
    return want.frames > 1 ? family + ", several views" : family;
}

void describe(AuditedRequest& request, const Session& session, const AuditSettings& settings) {
    const Request& want = session.want();
    request.family = family_of(want);
    request.planner = session.options.planner.value_or("estimate");
    request.machine = session.profile.name;
    request.budget = want.budget;
    request.bytes_given = session.wish.memory_given;
    const double there = static_cast<double>(want.output().samples()) * want.frames;
    request.sampled = settings.samples > 0 && static_cast<double>(settings.samples) < there;
    request.minimize = want.minimize;
    request.frames = want.frames;
    request.threads = want.threads;
    request.planning_seconds = session.answer->seconds;
}

}  // namespace

AuditedRequest audited(const AuditRequest& asked, const JobOptions& options,
                       const AuditSettings& settings) {
    malloc_trim(0);  // so that earlier requests do not show in what this process holds
    AuditedRequest request;
    request.asked = asked;
    Session session(options);
    session.runs = true;
    const double resident = resident_now();
    {
        const OwnLimits restored;
        take_request(session);
        make_plan(session);
    }
    describe(request, session, settings);
    TriedPaths tried = tried_paths(session, settings.limit, settings.seed);
    request.all_paths = tried.all;
    const std::vector<std::string> chosen = session.answer->plan->texts();
    for (std::size_t i = 0; i < tried.plans.size(); ++i) {
        AuditedPath path;
        path.steps = tried.plans[i].texts();
        path.predicted = tried.plans[i].predicted;
        path.front = tried.front[i];
        path.chosen = path.steps == chosen;
        request.paths.push_back(std::move(path));
    }
    Rounds(session, request, tried.plans, settings, resident).run_all();
    request.warnings = session.messages.warnings();
    if (!request.chosen().measured())
        throw RunError("the chosen path failed: " + request.chosen().failure);
    return request;
}

}  // namespace edgewise::cli
