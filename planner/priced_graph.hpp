#pragma once

#include <vector>

#include "planner/choice.hpp"

namespace edgewise {

/// The transform graph of one request, expanded and priced once. The plan, the paths that were not
/// chosen, margins and drawings are all read from it.
class PricedGraph {
 public:
    /// @throws RequestError where a demand makes no sense
    PricedGraph(const Catalogue& catalogue, const Ask& ask, std::vector<Source> sources,
                const Profile& profile, const PlanOptions& options);
    PricedGraph(const PricedGraph&) = delete;
    PricedGraph& operator=(const PricedGraph&) = delete;

    const TransformGraph& spanned() const noexcept { return spanned_; }
    const std::vector<Source>& sources() const noexcept { return sources_; }
    /// Costs for the profile's processors: the choice is made by them.
    const Priced& choice() const noexcept { return choice_; }
    /// Costs for the request's threads.
    const Priced& real() const noexcept { return real_; }
    /// Whether the two differ.
    bool has_other_threads() const noexcept { return other_threads_; }

 private:
    const std::vector<Source> sources_;
    const TransformGraph spanned_;
    const bool other_threads_;
    Priced choice_, real_;
};

}  // namespace edgewise
