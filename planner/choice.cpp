#include "planner/choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/alike.hpp"

namespace edgewise {
namespace {

bool within(const std::optional<double>& limit, double value) { return !limit || value <= *limit; }

/// The peak where as many frames are made side by side as there are threads. Each holds what its
/// step reads, makes and works in; threads share one scratch each, whatever they work on.
double peak_side_by_side(const Route& route, const Priced& priced, const Ask& ask) {
    const Graph& graph = priced.spanned.graph;
    double peak = priced.start(route.source).peak, held = priced.start(route.source).held;
    for (const auto arc : route.arcs) {
        const Offer& offer = graph[arc].offer;
        const StepCost& cost = priced.cost(arc);
        const bool from_source = graph[boost::source(arc, graph)].source >= 0;
        const double input = from_source ? 0 : offer.from.own_bytes() / cost.from_ranks;
        const bool kept = offer.to.runs() > offer.from.runs();
        if (kept) held += input;
        const double scratch = std::min(cost.scratch, cost.work.scratch * ask.want.threads);
        const double each = (kept ? 0 : input) + cost.made / cost.to_ranks + cost.scratch - scratch;
        const int lanes = std::max(1, std::min(ask.want.threads, offer.to.runs()));
        peak = std::max(peak, priced.pinned + held + lanes * each + scratch);
    }
    return peak;
}

/// Where budgets bound it, fewer frames are made side by side.
double expected_bytes(double bytes, double side_by_side, const Ask& ask,
                      const PlanOptions& options) {
    if (options.held <= 0) return bytes;
    double most = std::max(bytes, options.resident + side_by_side);
    if (ask.want.budget.bytes) most = std::min(most, std::max(bytes, *ask.want.budget.bytes));
    return most - std::max(0.0, options.resident - options.held);
}

}  // namespace

std::vector<StepCost> price(const TransformGraph& spanned, const Catalogue& catalogue,
                            const Ask& ask, const Profile& profile, int threads,
                            const PlanOptions& options) {
    std::vector<StepCost> costs(boost::num_edges(spanned.graph));
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Arc& what = spanned.graph[arc];
        StepCost& cost = costs[what.index];
        cost = cost_of(catalogue[what.edge], what.offer, ask, profile, threads);
        if (spanned.graph[boost::target(arc, spanned.graph)].target)
            cost.rounding = rounding_of(ask);
        if (options.random_costs)
            randomise(cost, catalogue[what.edge], what.offer, *options.random_costs);
    }
    return costs;
}

Predicted predicted_of(const Route& route, const Priced& priced, const Ask& ask,
                       const PlanOptions& options) {
    Label label = priced.start(route.source);
    double uncertain = 0;  // [s]; steps are wrong independently of each other
    for (const auto arc : route.arcs) {
        const StepCost& cost = priced.cost(arc);
        label = priced.step(label, arc);
        uncertain = std::hypot(uncertain, cost.seconds * cost.spread);
    }
    // A plan without steps still holds what it was given.
    const double least = priced.pinned + options.after;
    const double bytes = options.resident + std::max(label.peak, least);
    const double side_by_side = std::max(peak_side_by_side(route, priced, ask), least);
    return {.seconds = label.seconds,
            .spread = label.seconds > 0 ? uncertain / label.seconds : 0,
            .bytes = bytes,
            .error = label.error() / ask.scene.range,
            .known = label.known,
            .copied = label.copied,
            .expected = expected_bytes(bytes, side_by_side, ask, options),
            .likeness = likeness_of(route, priced)};
}

Plan plan_of(const Route& route, const Priced& priced, const Catalogue& catalogue, const Ask& ask,
             const PlanOptions& options) {
    const Graph& graph = priced.spanned.graph;
    Plan plan;
    plan.source = graph[route.source].what;
    Label label = priced.start(route.source);
    for (const auto arc : route.arcs) {
        const Arc& what = graph[arc];
        const StepCost& cost = priced.cost(arc);
        Label unlimited = label;
        unlimited.peak = 0;
        const double peak = priced.step(unlimited, arc).peak;
        label = priced.step(label, arc);
        plan.steps.push_back(
            {catalogue.shared(what.edge),
             what.offer,
             cost.work,
             cost.seconds,
             cost.scratch,
             label,
             {cost.seconds, cost.spread, peak, label.error() / ask.scene.range, label.known}});
    }
    label.peak = std::max(label.peak, priced.pinned);
    plan.label = label;
    plan.predicted = predicted_of(route, priced, ask, options);
    return plan;
}

bool accurate_enough(const Predicted& predicted, const Budget& budget) {
    if (budget.copied && !predicted.copied) return false;
    if (budget.like && predicted.likeness != Likeness::alike) return false;
    if (!budget.error) return true;
    return predicted.known && predicted.error <= *budget.error;
}

bool fast_enough(const Predicted& predicted, const Budget& budget) {
    return within(budget.seconds, predicted.seconds);
}

bool small_enough(const Predicted& predicted, const Budget& budget) {
    return within(budget.bytes, predicted.bytes);
}

bool feasible(const Predicted& predicted, const Budget& budget) {
    return accurate_enough(predicted, budget) && fast_enough(predicted, budget) &&
           small_enough(predicted, budget);
}

double objective(const Predicted& predicted, Minimize what) {
    switch (what) {
        case Minimize::time:
            return predicted.seconds;
        case Minimize::memory:
            return predicted.bytes;
        case Minimize::error:
            break;
    }
    return predicted.known ? predicted.error : std::numeric_limits<double>::infinity();
}

}  // namespace edgewise
