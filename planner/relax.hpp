#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "planner/candidates.hpp"

namespace edgewise {

/// New limits for the budgets that must change; the others stay.
struct Relaxed {
    /// Infinite: no finite limit helps, since the errors of the remaining paths are unknown.
    std::optional<double> error = {};
    std::optional<double> seconds = {}, bytes = {};

    int changed() const noexcept {
        return error.has_value() + seconds.has_value() + bytes.has_value();
    }
};

/// Make a limit a number that can be said, no smaller than it.
struct Rounding {
    std::function<double(double)> error, seconds, bytes;
};

/// The smallest changes to budgets that make a request feasible, where no path keeps all of them:
/// each budget that helps alone; where none does, each pair that does, at the point where the
/// factors on its two limits multiply to the least; else all three. With the limits as rounded some
/// path keeps all budgets. With any one of them just below its least value before rounding none
/// does. A default error is a wish and needs no change. Empty where there is no path at all.
std::vector<Relaxed> relaxed_budgets(const Candidates& paths, const Budget& budget,
                                     const Rounding& rounding);

/// Indices of the demands that must be dropped.
struct Dropped {
    std::vector<std::size_t> via = {}, without = {};

    std::size_t size() const noexcept { return via.size() + without.size(); }
};

/// All smallest sets of demands without which there is a plan, tried one after another.
/// @param budgets  the plan must keep; else any path will do
std::vector<Dropped> demands_to_drop(const Catalogue& catalogue, const Ask& ask,
                                     const std::vector<Source>& sources, const Profile& profile,
                                     const PlanOptions& options, bool budgets);

/// All smallest sets of refused edges that would, if they applied wherever they declare to, join
/// the sources to what is asked for. Edges that were never asked, because nothing made what they
/// read, are assumed to apply. Empty where there is a path, or no set of up to three leads there.
std::vector<std::vector<Refusal>> missing_edges(const Catalogue& catalogue, const Ask& ask,
                                                const std::vector<Source>& sources);

}  // namespace edgewise
