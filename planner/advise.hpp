#pragma once

#include <string>
#include <vector>

#include "planner/candidates.hpp"

namespace edgewise {

/// A cost that nobody has measured here, and what knowing it would be worth.
struct CostAdvice {
    std::string name;      // "EDGE/key=value.../VARIANT KIND TYPE", as in Rates
    std::string state;     // "guessed", "fitted" ...; "borrowed", "beyond" or "stale"
    std::string when;      // it was measured, of a stale one
    double seconds = 0;    // of one run, as predicted
    double spread = 0;     // of that: standard deviation of the log
    double regret = 0;     // [s] that choosing now is expected to lose against knowing it
    double measuring = 0;  // [s] of three runs

    double worth() const noexcept { return measuring > 0 ? regret / measuring : 0; }
};

/// Two representations between which all known paths take far longer than they need to.
struct ArcAdvice {
    std::string from, to;            // Representation::text
    std::string from_kind, to_kind;  // Representation::kind
    std::vector<std::string> best;   // the fastest known path, as `--via` takes it
    bool serves = true;              // on some path that could win, if only its steps were faster
    double seconds = 0;              // that it takes, all runs
    double bound = 0;                // [s] below which no edge can be
    double plan = 0;  // [s] of the whole path with an edge at this bound, if that errs nothing
    double gain = 0;  // [s] by which that is faster than the plan
};

struct Advice {
    double seconds = 0, bound = 0;  // of the plan, and below which no plan can be
    int measured = 0;               // costs on paths that could win which need no measuring
    int idle = 0;                   // unmeasured ones that cannot change the plan
    std::vector<CostAdvice> costs;  // most regret removed a second of measuring first
    std::vector<ArcAdvice> arcs;    // largest gain first
};

/// What is worth measuring, and which edges are worth inventing ([W93] 2.4), for one request.
///
/// Regret: seconds of a cost are log-normal about the prediction with its spread, all others stay
/// as predicted; what is lost is the mean of the plan's seconds less those of the path that is best
/// once this cost is known. Paths that could win keep the budgets of error and memory and, where
/// not time is minimised, are no worse than the plan in what is.
/// Bound: one operation a sample of the larger of both ends, and each byte of both moved once in
/// address order, by the profile's numbers shared by its processors, for every run; or what the
/// fastest known way takes, where that reads only a part and is below it. An edge is missing where
/// known ways take at least twice the bound.
/// @param build  the version of this program: rates of another are stale
Advice advise(const Candidates& paths, const Plan& plan, const Profile& profile,
              const std::string& build);

}  // namespace edgewise
