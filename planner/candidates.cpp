#include "planner/candidates.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "planner/alike.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMostPaths = 3000;
/// Makes a step so slow that only a path without it can be the fastest.
constexpr double kNever = 1e9;

}  // namespace

Candidates::Candidates(const Catalogue& catalogue, const Ask& ask,
                       std::shared_ptr<const PricedGraph> graph, const PlanOptions& options,
                       const Known& known)
    : catalogue_(catalogue), ask_(ask), options_(options), graph_(std::move(graph)) {
    const Priced& choice = priced();
    texts_.resize(choice.costs.size());
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned().graph))) {
        const Arc& what = spanned().graph[arc];
        texts_[what.index] =
            catalogue[static_cast<std::size_t>(what.edge)].name + what.offer.with.text();
    }
    std::vector<Route> simple = simple_routes(choice, kMostPaths);
    complete_ = simple.size() < kMostPaths;
    for (Route& route : simple) add(std::move(route), known);
    for (Route& route : routes_to_choose_from(choice)) add(std::move(route), known).front = true;
    if (!complete_) add_replacements(known);
}

Candidate& Candidates::add(Route route, const Known& known) {
    std::vector<std::size_t> key{route.source};
    for (const auto arc : route.arcs) key.push_back(spanned().graph[arc].index);
    const auto [place, fresh] = places_.emplace(std::move(key), all_.size());
    if (!fresh) return all_[place->second];
    Candidate path;
    for (const auto arc : route.arcs) path.steps.push_back(texts_[spanned().graph[arc].index]);
    path.choice = predicted_of(route, priced(), ask_, options_);
    path.real = predicted_of(route, graph_->real(), ask_, options_);
    if (const auto found = known.find(path.steps); found != known.end()) {
        // Pilots run on the profile's processors; other threads keep their predicted ratio.
        const double ratio =
            path.choice.seconds > 0 ? found->second.seconds / path.choice.seconds : 1;
        const double slower = path.choice.seconds > 0 ? path.real.seconds / path.choice.seconds : 1;
        path.scale = ratio;
        const double expected = path.real.expected;
        const Likeness likeness = path.real.likeness;
        path.choice = path.real = found->second;
        path.choice.expected = path.real.expected = expected;
        path.choice.likeness = path.real.likeness = likeness;
        path.real.seconds *= slower;
    }
    path.route = std::move(route);
    all_.push_back(std::move(path));
    return all_.back();
}

void Candidates::add_replacements(const Known& known) {
    std::set<std::string> steps;
    for (const Route& route : routes_to_choose_from(priced()))
        for (const auto arc : route.arcs) steps.insert(texts_[spanned().graph[arc].index]);
    for (const std::string& step : steps) {
        Priced slower = priced();
        for (std::size_t i = 0; i < texts_.size(); ++i)
            if (texts_[i] == step) slower.costs[i].seconds *= kNever;
        for (Route& route : pareto_routes(slower)) add(std::move(route), known);
    }
}

double Candidates::seconds_in(const Candidate& path, const std::string& step, bool real) const {
    double sum = 0;
    for (const auto arc : path.route.arcs)
        if (texts_[spanned().graph[arc].index] == step)
            sum += (real ? graph_->real() : priced()).cost(arc).seconds;
    return path.scale * sum;
}

double Candidates::spread_of(const Candidate& path, const std::string& step) const {
    double spread = 0;
    for (const auto arc : path.route.arcs)
        if (texts_[spanned().graph[arc].index] == step)
            spread = std::max(spread, priced().cost(arc).spread);
    // A measured path is as uncertain as its measurement.
    return path.scale == 1 ? spread : std::min(spread, path.choice.spread);
}

const Candidate* Candidates::find(const std::vector<std::string>& steps) const {
    const auto found = std::find_if(all_.begin(), all_.end(),
                                    [&](const Candidate& path) { return path.steps == steps; });
    return found == all_.end() ? nullptr : &*found;
}

}  // namespace edgewise
