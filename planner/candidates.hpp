#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "planner/priced_graph.hpp"

namespace edgewise {

/// A path that may be chosen.
struct Candidate {
    Route route;
    std::vector<std::string> steps;  // as `--via` takes them
    Predicted choice;                // for the profile's processors: the choice is made by it
    Predicted real;                  // for the request's threads
    bool front = false;              // no other beats its label: what the planner chooses from
    double scale = 1;                // seconds of its steps, where they were measured, to predicted
};

/// All paths of a request with their predictions. Margins, ways out and advice are read from them.
/// Edges are asked once; after that only labels are compared.
class Candidates {
 public:
    /// What was measured of paths, by their steps. It replaces predictions.
    using Known = std::map<std::vector<std::string>, Predicted>;

    /// Up to some thousand simple paths; beyond, those of the Pareto front, and those that take
    /// their place when a step of one of them becomes slower without end.
    /// @param graph  of this request
    Candidates(const Catalogue& catalogue, const Ask& ask, std::shared_ptr<const PricedGraph> graph,
               const PlanOptions& options, const Known& known = {});
    Candidates(const Candidates&) = delete;
    Candidates& operator=(const Candidates&) = delete;

    const std::vector<Candidate>& all() const noexcept { return all_; }
    /// No path was left out.
    bool complete() const noexcept { return complete_; }
    const TransformGraph& spanned() const noexcept { return graph_->spanned(); }
    /// Costs for the profile's processors.
    const Priced& priced() const noexcept { return graph_->choice(); }
    const Catalogue& catalogue() const noexcept { return catalogue_; }
    const Ask& ask() const noexcept { return ask_; }
    const PlanOptions& options() const noexcept { return options_; }

    /// [s] that a path spends in its steps called `step`, as `choice` or `real` has it.
    double seconds_in(const Candidate& path, const std::string& step, bool real = false) const;
    /// The largest spread of the steps called so.
    double spread_of(const Candidate& path, const std::string& step) const;
    const Candidate* find(const std::vector<std::string>& steps) const;

 private:
    Candidate& add(Route route, const Known& known);
    void add_replacements(const Known& known);

    const Catalogue& catalogue_;
    const Ask ask_;
    const PlanOptions options_;
    const std::shared_ptr<const PricedGraph> graph_;
    std::vector<std::string> texts_;  // of arcs, by edge_index
    std::vector<Candidate> all_;
    std::map<std::vector<std::size_t>, std::size_t> places_;
    bool complete_ = true;
};

}  // namespace edgewise
