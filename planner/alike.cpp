#include "planner/alike.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <variant>

#include "graph/plan.hpp"

namespace edgewise {
namespace {

/// Scenes with made-up facts that a comparison must hold in. Two facts that have nothing to do with
/// each other are in the same order in all of them with a chance of 2^-24.
constexpr std::uint64_t kSupposed = 24;

/// The label behind an edge, as far as errors go; as `price` has them.
Label after(const Label& label, const Transition& edge, const Offer& offer, const Ask& ask) {
    StepCost cost;
    cost.error = counted_error(edge, offer, ask);
    if (is_target(offer.to, ask.want)) cost.rounding = rounding_of(ask);
    return extend(label, offer, cost, true, 0);
}

bool reads_by(const Parameters& with, const std::set<std::string>& filters) {
    const auto found = with.all().find("filter");
    if (found == with.all().end()) return false;
    const std::string* word = std::get_if<std::string>(&found->second);
    return word && filters.contains(*word);
}

/// The distance of samples along rays of an edge that combines them: its parameter of that name,
/// or that of whole layers. 0: it combines none along rays.
double distance_of(const Offer& offer, const Request& want) {
    if (!want.job->of_rays()) return 0;
    const auto step = offer.with.all().find("step");
    if (step != offer.with.all().end()) return offer.with.number("step");
    // Surfaces and depths are no samples, and pictures are combined already.
    const std::string& reads = offer.from.content;
    const bool layers =
        is_target(offer.to, want) && reads != "mesh" && reads != "depth" && reads != "picture";
    return layers ? 1 : 0;
}

bool is_barred(const Offer& offer, const Request& want, const Like& like) {
    return reads_by(offer.with, like.barred) || distance_of(offer, want) > like.step;
}

/// The parameters with which an edge is the plain path by this filter, or nothing.
std::optional<Parameters> plain_parameters(const Transition& edge, const Like& like) {
    const std::string& filter = like.filter;
    if (!edge.plain) return std::nullopt;
    const auto domain = edge.parameters.find("filter");
    if (domain == edge.parameters.end()) return std::nullopt;
    const auto& words = domain->second.words;
    if (std::find(words.begin(), words.end(), filter) == words.end()) return std::nullopt;
    Parameters with = *edge.plain;
    with.set("filter", filter);
    const auto step = with.all().find("step");
    if (step != with.all().end()) with.set("step", std::min(with.number("step"), like.step));
    return with;
}

/// A path of one step by which the plain one may go.
struct PlainOffer {
    const Transition* edge;
    Label from;
    Offer offer;

    double likely(const Ask& ask) const {
        const Label label = after(from, *edge, offer, ask);
        return label.known ? label.error() : std::numeric_limits<double>::infinity();
    }
};

std::vector<PlainOffer> plain_offers(const Catalogue& catalogue, const Ask& ask,
                                     const std::vector<Source>& sources, const Like& like) {
    std::vector<PlainOffer> found;
    for (const Transition& edge : catalogue) {
        const auto with = plain_parameters(edge, like);
        if (!with) continue;
        for (const Source& source : sources) {
            const std::string kind = source.what.kind();
            const bool fits =
                std::any_of(edge.joins.begin(), edge.joins.end(),
                            [&](const auto& join) { return takes_kind(join.first, kind); });
            if (!fits) continue;
            Offer offer = edge.offer(source.what, ask, *with);
            if (!offer.refused.empty() || !is_target(offer.to, ask.want)) continue;
            offer.with = *with;
            found.push_back({&edge, source.label, std::move(offer)});
        }
    }
    return found;
}

/// The most accurate of them.
std::optional<PlainWay> plain_of(const std::vector<PlainOffer>& offers, const Ask& ask) {
    const PlainOffer* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const PlainOffer& each : offers)
        if (const double likely = each.likely(ask); likely < least) best = &each, least = likely;
    if (!best) return std::nullopt;
    return PlainWay{best->edge->name + best->offer.with.text(), least};
}

}  // namespace

std::optional<PlainWay> plain_way(const Catalogue& catalogue, const Ask& ask,
                                  const std::vector<Source>& sources, const Like& like) {
    return plain_of(plain_offers(catalogue, ask, sources, like), ask);
}

std::shared_ptr<const Alike> alike_of(const Priced& priced, const Catalogue& catalogue,
                                      const Ask& ask, const Like& like) {
    const Scene scene = ask.scene.as_likely();
    const Ask likely{ask.want, scene};
    auto alike = std::make_shared<Alike>(
        Alike{{priced.spanned, priced.sources, priced.costs, priced.pinned}, {}, 0});
    const Graph& graph = priced.spanned.graph;
    for (const auto arc : boost::make_iterator_range(boost::edges(graph))) {
        const Arc& what = graph[arc];
        StepCost& cost = alike->likely.costs[what.index];
        cost.barred = is_barred(what.offer, ask.want, like);
        if (cost.barred) continue;
        cost.error =
            counted_error(catalogue[static_cast<std::size_t>(what.edge)], what.offer, likely);
        if (cost.rounding > 0) cost.rounding = rounding_of(likely);
    }
    alike->plain = plain_way(catalogue, likely, priced.sources, like);
    if (std::isinf(like.times)) {
        alike->most = like.times;
        return alike;
    }
    if (alike->plain) {
        alike->most = like.times * alike->plain->likely;
        return alike;
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Route& route : pareto_routes(alike->likely))
        if (route.label.known) least = std::min(least, route.label.error());
    alike->most = like.times * least;
    return alike;
}

Likeness likeness_of(const Route& route, const Priced& priced) {
    if (!priced.alike) return Likeness::alike;
    const Priced& likely = priced.alike->likely;
    Label label = likely.start(route.source);
    for (const auto arc : route.arcs) {
        if (likely.cost(arc).barred) return Likeness::barred;
        label = likely.step(label, arc);
    }
    return label.known && label.error() <= priced.alike->most ? Likeness::alike : Likeness::worse;
}

std::vector<Route> routes_to_choose_from(const Priced& priced) {
    std::vector<Route> routes = pareto_routes(priced);
    if (!priced.alike) return routes;
    const auto number = [&](Graph::edge_descriptor arc) { return priced.spanned.graph[arc].index; };
    const auto same = [&](const Route& a, const Route& b) {
        return a.source == b.source &&
               std::equal(a.arcs.begin(), a.arcs.end(), b.arcs.begin(), b.arcs.end(),
                          [&](const auto& x, const auto& y) { return number(x) == number(y); });
    };
    const std::size_t front = routes.size();
    for (Route& route : pareto_routes(priced.alike->likely))
        if (std::none_of(routes.begin(), routes.begin() + static_cast<std::ptrdiff_t>(front),
                         [&](const Route& other) { return same(other, route); }))
            routes.push_back(std::move(route));
    return routes;
}

std::optional<double> likely_error(const Plan& plan, const Ask& ask,
                                   const std::vector<Source>& sources) {
    const auto from = std::find_if(sources.begin(), sources.end(), [&](const Source& source) {
        return source.what.key() == plan.source.key();
    });
    if (from == sources.end()) return std::nullopt;
    const Scene scene = ask.scene.as_likely();
    const Ask likely{ask.want, scene};
    Label label = from->label;
    for (const Step& step : plan.steps) label = after(label, *step.by, step.offer, likely);
    if (!label.known) return std::nullopt;
    return label.error() / ask.scene.range;
}

bool alike_unseen(const Plan& plan, const Catalogue& catalogue, const Ask& ask,
                  const std::vector<Source>& sources, const Like& like) {
    const auto from = std::find_if(sources.begin(), sources.end(), [&](const Source& source) {
        return source.what.key() == plan.source.key();
    });
    if (from == sources.end()) return false;
    for (const Step& step : plan.steps)
        if (is_barred(step.offer, ask.want, like)) return false;
    const std::vector<PlainOffer> plain_ones = plain_offers(catalogue, ask, sources, like);
    Scene scene = ask.scene;
    for (std::uint64_t seed = 1; seed <= kSupposed; ++seed) {
        scene.supposed = seed;
        const Ask supposed{ask.want, scene};
        const auto plain = plain_of(plain_ones, supposed);
        if (!plain) return false;
        Label label = from->label;
        for (const Step& step : plan.steps) label = after(label, *step.by, step.offer, supposed);
        if (!label.known || !(label.error() <= like.times * plain->likely)) return false;
    }
    return true;
}

}  // namespace edgewise
