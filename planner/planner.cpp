#include "planner/planner.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <functional>
#include <tuple>

#include "planner/alike.hpp"
#include "planner/boxed.hpp"
#include "planner/choice.hpp"
#include "planner/priced_graph.hpp"

namespace edgewise {
namespace {

constexpr double kThin =
    0.01;  // plans of the front closer than this in all three are reported once

/// The best of the plans that pass; ties go to the faster, then the smaller, then the more
/// accurate.
const Plan* best(const std::vector<Plan>& plans, Minimize what,
                 const std::function<bool(std::size_t)>& passes) {
    const Plan* chosen = nullptr;
    for (std::size_t i = 0; i < plans.size(); ++i) {
        if (!passes(i)) continue;
        const Plan& plan = plans[i];
        const double value = objective(plan.predicted, what);
        const double least = chosen ? objective(chosen->predicted, what) : 0;
        if (!chosen || value < least || (value == least && before(plan.label, chosen->label)))
            chosen = &plan;
    }
    return chosen;
}

bool close(double a, double b) {
    return std::abs(a - b) <= kThin * std::max(std::abs(a), std::abs(b));
}

/// Plans that meet more of Budget::like are dominated by fewer others.
int rank(Likeness likeness) {
    return likeness == Likeness::alike ? 2 : likeness == Likeness::worse ? 1 : 0;
}

/// Plans that no other beats in seconds, bytes, error and likeness, fastest first.
std::vector<Plan> reported_front(std::vector<Plan> plans) {
    // A plan that beats another comes before it, also where they tie in some of the three.
    const auto taken = [](const Plan& plan) {
        return std::tuple(plan.predicted.seconds, plan.predicted.bytes, plan.predicted.error);
    };
    std::stable_sort(plans.begin(), plans.end(),
                     [&](const Plan& a, const Plan& b) { return taken(a) < taken(b); });
    std::vector<Plan> front;
    for (Plan& plan : plans) {
        const bool superfluous = std::any_of(front.begin(), front.end(), [&](const Plan& other) {
            const Predicted &a = other.predicted, &b = plan.predicted;
            if (a.known != b.known || rank(a.likeness) < rank(b.likeness)) return false;
            const bool beaten = a.bytes <= b.bytes && a.error <= b.error;
            return beaten || (close(a.seconds, b.seconds) && close(a.bytes, b.bytes) &&
                              close(a.error, b.error));
        });
        if (!superfluous) front.push_back(std::move(plan));
    }
    return front;
}

/// For each budget, the plan that keeps the others and misses it by least; then the plans at the
/// ends, so that there is always one on either side.
std::vector<Plan> nearest_plans(const std::vector<Plan>& plans, const Budget& budget) {
    std::vector<Plan> nearest;
    const auto add = [&](const Plan* plan) {
        if (plan && std::none_of(nearest.begin(), nearest.end(),
                                 [&](const Plan& other) { return other.texts() == plan->texts(); }))
            nearest.push_back(*plan);
    };
    const auto at = [&](std::size_t i) -> const Plan& { return plans[i]; };
    if (budget.error)
        add(best(plans, Minimize::error, [&](std::size_t i) {
            return fast_enough(at(i).predicted, budget) && small_enough(at(i).predicted, budget);
        }));
    if (budget.seconds)
        add(best(plans, Minimize::time, [&](std::size_t i) {
            return accurate_enough(at(i).predicted, budget) &&
                   small_enough(at(i).predicted, budget);
        }));
    if (budget.bytes)
        add(best(plans, Minimize::memory, [&](std::size_t i) {
            return accurate_enough(at(i).predicted, budget) && fast_enough(at(i).predicted, budget);
        }));
    const auto any = [](std::size_t) { return true; };
    add(best(plans, Minimize::time, any));
    if (budget.error) add(best(plans, Minimize::error, any));
    if (budget.bytes) add(best(plans, Minimize::memory, any));
    return nearest;
}

std::string missed(const Budget& budget) {
    std::vector<std::string> set;
    if (budget.copied) set.push_back("all samples as they are stored");
    if (budget.error) set.push_back(fmt::format("an error of {:.3g}", *budget.error));
    if (budget.seconds) set.push_back(fmt::format("{:.3g} s", *budget.seconds));
    if (budget.bytes) set.push_back(fmt::format("{:.0f} MiB", *budget.bytes / 0x1p20));
    return fmt::format("no plan keeps to {}", fmt::join(set, " and "));
}

/// Chooses among all plans. `choice` is costed for the profile's processors, `real` for the threads
/// given: the first decides, so that the answer does not depend on threads; the second must keep
/// the budgets as well.
void choose(Answer& answer, const std::vector<Plan>& choice, const std::vector<Plan>& real,
            const Ask& ask, const PlanOptions& options) {
    const Request& want = ask.want;
    Budget budget = want.budget;
    const auto pick = [&](const Budget& limits, Minimize what) -> const Plan* {
        const Plan* chosen = best(choice, what, [&](std::size_t i) {
            return feasible(choice[i].predicted, limits) && feasible(real[i].predicted, limits);
        });
        if (!chosen)  // the profile's processors may be slower than the threads given
            chosen = best(choice, what,
                          [&](std::size_t i) { return feasible(real[i].predicted, limits); });
        return chosen ? &real[static_cast<std::size_t>(chosen - choice.data())] : nullptr;
    };
    const Plan* chosen = pick(budget, want.minimize);
    // Nothing is small enough: what has its last steps in boxes may be. Boxes make no plan cheaper,
    // so those that are dearer as a whole than the best one found need no look.
    std::optional<Plan> in_boxes;
    if (!chosen && budget.bytes) {
        std::vector<const Plan*> wholes;
        for (const Plan& plan : real) wholes.push_back(&plan);
        const auto dearness = [&](const Plan* plan) {
            return want.minimize == Minimize::memory ? 0
                                                     : objective(plan->predicted, want.minimize);
        };
        std::stable_sort(wholes.begin(), wholes.end(),
                         [&](const Plan* a, const Plan* b) { return dearness(a) < dearness(b); });
        for (const Plan* whole : wholes) {
            if (in_boxes && dearness(whole) >= objective(in_boxes->predicted, want.minimize)) break;
            std::optional<Plan> smaller = fewest_boxes(*whole, ask, options);
            if (smaller && (!in_boxes || objective(smaller->predicted, want.minimize) <
                                             objective(in_boxes->predicted, want.minimize)))
                in_boxes = std::move(smaller);
        }
        if (in_boxes) chosen = &*in_boxes;
    }
    if (!chosen && budget.like) {
        budget.like.reset();
        chosen = pick(budget, Minimize::error);
        if (chosen)
            answer.warnings.push_back(fmt::format(
                "no path that may be taken is as good as {}; taking the most accurate one{}",
                want.budget.like->name,
                chosen->predicted.known
                    ? fmt::format(", with an error of {:.3g}", chosen->predicted.error)
                    : ""));
    }
    if (!chosen && budget.error_yields) {
        budget.error.reset();
        chosen = pick(budget, Minimize::error);
        if (chosen)
            answer.warnings.push_back(
                chosen->predicted.known
                    ? fmt::format("no path that may be taken is equal but for rounding; taking the "
                                  "most accurate one, with an error of {:.3g}",
                                  chosen->predicted.error)
                    : "the error of the only paths that may be taken is not known");
    }
    if (chosen) {
        answer.plan = *chosen;
        return;
    }
    answer.nearest = nearest_plans(real, want.budget);
    answer.problem = real.empty() ? "no path of edges leads from the input to what is asked for"
                                  : missed(want.budget);
}

/// The shortest path (Dijkstra) where least time is asked for and it keeps all budgets, for the
/// profile's processors and for the threads given; else none. Arcs of barred filters are left out.
std::optional<Route> shortest_that_fits(const PricedGraph& graph, const Ask& ask,
                                        const PlanOptions& options) {
    if (ask.want.minimize != Minimize::time) return {};
    const Priced& choice = graph.choice();
    std::optional<Route> route = fastest_route(choice.alike ? choice.alike->likely : choice);
    const auto fits = [&](const Priced& by) {
        return feasible(predicted_of(*route, by, ask, options), ask.want.budget);
    };
    if (route && !(fits(choice) && fits(graph.real()))) route.reset();
    return route;
}

bool is_step(const Arc& arc, const std::string& step, const Catalogue& catalogue) {
    const std::string& name = catalogue[static_cast<std::size_t>(arc.edge)].name;
    return step.starts_with(name) && step == name + arc.offer.with.text();
}

/// The arc of one step from a source to the result.
std::optional<Graph::edge_descriptor> arc_of_step(const TransformGraph& spanned,
                                                  const std::string& step,
                                                  const Catalogue& catalogue) {
    const Graph& graph = spanned.graph;
    for (const auto source : spanned.sources)
        for (const auto arc : boost::make_iterator_range(boost::out_edges(source, graph)))
            if (graph[boost::target(arc, graph)].target && is_step(graph[arc], step, catalogue))
                return arc;
    return std::nullopt;
}

/// What one edge is predicted to take by itself [s], where it leads from a source to the request.
std::optional<double> seconds_alone(const Demand& by, const Source& source,
                                    const Catalogue& catalogue, const Ask& ask,
                                    const Profile& profile, const PlanOptions& options) {
    for (const Transition& edge : catalogue) {
        if (edge.name != by.name) continue;
        const std::string kind = source.what.kind();
        const bool fits = std::any_of(edge.joins.begin(), edge.joins.end(), [&](const auto& join) {
            return takes_kind(join.first, kind);
        });
        if (!fits) return std::nullopt;
        const Offer offer = edge.offer(source.what, ask, by.with);
        if (!offer.refused.empty() || !is_target(offer.to, ask.want)) return std::nullopt;
        StepCost cost = cost_of(edge, offer, ask, profile, ask.want.threads);
        if (options.random_costs) randomise(cost, edge, offer, *options.random_costs);
        return cost.seconds;
    }
    return std::nullopt;
}

/// What the plain path is predicted to take for the request's threads [s]. As a rule it is an arc
/// that has its price already; it is none where its step is one that nobody tries, or where other
/// edges are demanded.
std::optional<double> seconds_of(const PlainWay& plain, const Priced& priced,
                                 const Catalogue& catalogue, const Ask& ask, const Profile& profile,
                                 const PlanOptions& options) {
    if (const auto arc = arc_of_step(priced.spanned, plain.step, catalogue))
        return priced.cost(*arc).seconds;
    const Demand by = demand_of(plain.step, catalogue);
    for (const Source& source : priced.sources)
        if (const auto seconds = seconds_alone(by, source, catalogue, ask, profile, options))
            return seconds;
    return std::nullopt;
}

}  // namespace

const char* name_of(Search search) noexcept {
    return search == Search::shortest_path ? "shortest path" : "label setting";
}

Answer plan(const Catalogue& catalogue, const Ask& ask, const std::vector<Source>& sources,
            const Profile& profile, const PlanOptions& options) {
    const auto begin = std::chrono::steady_clock::now();
    Answer answer =
        plan(std::make_shared<const PricedGraph>(catalogue, ask, sources, profile, options),
             catalogue, ask, profile, options);
    answer.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return answer;
}

Answer plan(std::shared_ptr<const PricedGraph> graph, const Catalogue& catalogue, const Ask& ask,
            const Profile& profile, const PlanOptions& options) {
    const auto begin = std::chrono::steady_clock::now();
    Answer answer;
    answer.graph = std::move(graph);
    const TransformGraph& spanned = answer.graph->spanned();
    answer.vertices = static_cast<int>(boost::num_vertices(spanned.graph));
    answer.edges = static_cast<int>(boost::num_edges(spanned.graph));
    answer.refused = spanned.refused;

    const Priced &priced = answer.graph->choice(), &real_priced = answer.graph->real();
    const bool others = answer.graph->has_other_threads();
    const auto plans_of = [&](const std::vector<Route>& routes, const Priced& by) {
        std::vector<Plan> all;
        for (const Route& route : routes)
            all.push_back(plan_of(route, by, catalogue, ask, options));
        return all;
    };
    // Where the shortest path keeps all budgets it is the answer. Labels are set only where it does
    // not, or for the front.
    if (const std::optional<Route> route = shortest_that_fits(*answer.graph, ask, options)) {
        answer.plan = plan_of(*route, real_priced, catalogue, ask, options);
        answer.search = Search::shortest_path;
    }
    std::vector<Plan> real;
    if (!answer.plan || options.front) {
        const std::vector<Route> routes = routes_to_choose_from(priced);
        const std::vector<Plan> choice = plans_of(routes, priced);
        real = others ? plans_of(routes, real_priced) : choice;
        if (!answer.plan) choose(answer, choice, real, ask, options);
    }
    if (options.front) answer.front = reported_front(real);
    if (priced.alike && priced.alike->plain) {
        const PlainWay& plain = *priced.alike->plain;
        answer.plain = {plain.step,
                        seconds_of(plain, real_priced, catalogue, ask, profile, options),
                        plain.likely / ask.scene.range};
    }
    answer.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return answer;
}

std::optional<Plan> plan_of_steps(const PricedGraph& graph, const std::vector<std::string>& steps,
                                  const Catalogue& catalogue, const Ask& ask,
                                  const PlanOptions& options) {
    const Graph& spanned = graph.spanned().graph;
    const Priced& priced = graph.real();
    for (const auto source : graph.spanned().sources) {
        Route route{source, {}, priced.start(source)};
        auto at = source;
        for (const std::string& step : steps)
            for (const auto arc : boost::make_iterator_range(boost::out_edges(at, spanned)))
                if (is_step(spanned[arc], step, catalogue)) {
                    route.arcs.push_back(arc);
                    route.label = priced.step(route.label, arc);
                    at = boost::target(arc, spanned);
                    break;
                }
        if (route.arcs.size() == steps.size() && spanned[at].target)
            return plan_of(route, priced, catalogue, ask, options);
    }
    return std::nullopt;
}

std::vector<Plan> all_paths(const Priced& priced, const Catalogue& catalogue, const Ask& ask,
                            const PlanOptions& options, std::size_t limit) {
    std::vector<Plan> plans;
    for (const Route& route : simple_routes(priced, limit))
        plans.push_back(plan_of(route, priced, catalogue, ask, options));
    return plans;
}

}  // namespace edgewise
