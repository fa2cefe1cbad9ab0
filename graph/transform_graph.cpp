#include "graph/transform_graph.hpp"

#include <algorithm>
#include <deque>
#include <fmt/format.h>
#include <iterator>
#include <set>
#include <string_view>
#include <unordered_map>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMostVertices = 4096;

/// All values that an offer of an edge is asked with: the tried ones, but a demanded value wherever
/// a demand fixes one.
std::vector<Parameters> combinations(const Transition& edge, const Demand* demanded) {
    std::vector<Parameters> all{{}};
    for (const auto& [key, domain] : edge.parameters) {
        std::vector<Value> values = domain.tried;
        if (demanded && demanded->with.contains(key)) values = {demanded->with.all().at(key)};
        std::vector<Parameters> longer;
        for (const Parameters& shorter : all)
            for (const Value& value : values) {
                longer.push_back(shorter);
                longer.back().set(key, value);
            }
        all = std::move(longer);
    }
    return all;
}

class Expansion {
 public:
    Expansion(const Catalogue& catalogue, const Ask& ask, const Demands& demands)
        : catalogue_(catalogue),
          ask_(ask),
          demands_(demands),
          accepted_(catalogue.size()),
          reasons_(catalogue.size()),
          views_(catalogue.size()) {}

    TransformGraph span(const std::vector<Source>& sources) {
        for (std::size_t i = 0; i < sources.size(); ++i) {
            // A vertex of its own, even where an edge leads to the same representation: what lies
            // there already costs no bytes and starts with a label of its own.
            const auto at = find_or_add(sources[i].what, 0, -1, static_cast<int>(i));
            graph_[at].source = static_cast<int>(i);
        }
        while (!waiting_.empty()) {
            const auto at = waiting_.front();
            waiting_.pop_front();
            leave(at);
        }
        return finish();
    }

 private:
    using At = Graph::vertex_descriptor;

    void leave(At at) {
        const Representation what = graph_[at].what;  // the graph grows
        const std::vector<Leaving>& all =
            catalogue_.joins().leaving(what.space + "/" + what.content);
        for (std::size_t i = 0; i < all.size(); ++i) {
            // An edge may have several joins: the one that needs most of the facets.
            const Leaving* next = nullptr;
            const std::size_t first = i;
            for (; i < all.size() && all[i].edge == all[first].edge; ++i)
                if (std::includes(what.facets.begin(), what.facets.end(), all[i].needs.begin(),
                                  all[i].needs.end()) &&
                    (!next || all[i].needs.size() > next->needs.size()))
                    next = &all[i];
            --i;
            if (!next || (next->prepares_only && out_of_order(graph_[at], next->edge))) continue;
            const Transition& edge = catalogue_[static_cast<std::size_t>(next->edge)];
            if (edge.on_demand && !is_demanded(edge)) {
                std::string& why = reasons_[static_cast<std::size_t>(next->edge)];
                if (why.empty()) why = message("taken only where @via names it").marked();
                continue;
            }
            const Demand* demand = next_demand(edge, graph_[at]);
            // What needs no facet left from where there were none, for less; unless the data came
            // with them.
            if (!what.facets.empty() && next->needs.empty() && !edge.attaches && !demand &&
                graph_[at].source < 0)
                continue;
            for (const Parameters& with : combinations(edge, demand)) follow(at, *next, with);
        }
    }

    /// What an edge sees: the facets that it names, or all where it adds one.
    static Representation seen(const Representation& what, const Leaving& by, bool attaches) {
        Representation seen = what;
        if (attaches) return seen;
        seen.facets = by.needs;
        if (by.needs.empty()) seen.facet_bytes = 0;
        return seen;
    }

    /// Preparations apply in the order of the catalogue, each at most once: without this rule those
    /// that commute would multiply the paths.
    static bool out_of_order(const Vertex& from, int edge) { return edge <= from.prepared; }

    const Demand* next_demand(const Transition& edge, const Vertex& from) const {
        if (from.demanded == static_cast<int>(demands_.via.size())) return nullptr;
        const Demand& next = demands_.via[from.demanded];
        return next.names(edge) ? &next : nullptr;
    }

    bool is_demanded(const Transition& edge) const {
        return std::any_of(demands_.via.begin(), demands_.via.end(),
                           [&](const Demand& demand) { return demand.names(edge); });
    }

    void follow(At at, const Leaving& leaving, const Parameters& with) {
        const int place = leaving.edge;
        const Transition& edge = catalogue_[place];
        for (const Demand& without : demands_.without)
            if (without.fits(edge, with)) {
                reasons_[place] = "forbidden by the request";
                return;
            }
        std::optional<std::string>& views = views_[static_cast<std::size_t>(place)];
        if (!views) views = edge.views_refused(ask_.want);
        if (!views->empty()) {
            reasons_[place] = *views;
            return;
        }
        Offer offer = edge.offer(seen(graph_[at].what, leaving, edge.attaches), ask_, with);
        if (!offer.refused.empty()) {
            if (reasons_[place].empty()) reasons_[place] = offer.refused;
            return;
        }
        offer.with = with;
        offer.from = graph_[at].what;
        offer.to.shares = edge.attaches && (graph_[at].source >= 0 || offer.from.shares);
        accepted_[place] = true;
        const Demand* next = next_demand(edge, graph_[at]);
        const int demanded = graph_[at].demanded + (next && next->fits(edge, with));
        // All that leads to the result leads to one vertex.
        const bool prepared = offer.from.space == "object" && offer.to.space == "object" &&
                              !is_target(offer.to, ask_.want);
        if (prepared && out_of_order(graph_[at], place)) return;  // not what its joins declare
        const At to = find_or_add(offer.to, demanded, prepared ? place : -1);
        boost::add_edge(at, to, Arc{place, 0, std::move(offer)}, graph_);
    }

    At find_or_add(const Representation& what, int demanded, int prepared, int source = -1) {
        std::string key = what.key();
        key += fmt::format("|{}|{}|{}", demanded, prepared, source);
        const auto [found, fresh] = known_.try_emplace(std::move(key), At{});
        if (!fresh) return found->second;
        if (boost::num_vertices(graph_) == kMostVertices)
            throw RequestError(fmt::format(
                "the request spans more than {} vertices; forbid an edge", kMostVertices));
        const bool target =
            demanded == static_cast<int>(demands_.via.size()) && is_target(what, ask_.want);
        found->second = boost::add_vertex(Vertex{what, demanded, prepared, -1, target}, graph_);
        waiting_.push_back(found->second);
        return found->second;
    }

    TransformGraph finish() const {
        const std::vector<char> kept = reaches_target();
        TransformGraph spanned;
        std::vector<At> renamed(kept.size());
        for (At at = 0; at < kept.size(); ++at) {
            if (!kept[at]) continue;
            renamed[at] = boost::add_vertex(graph_[at], spanned.graph);
            if (graph_[at].source >= 0) spanned.sources.push_back(renamed[at]);
            if (graph_[at].target) spanned.targets.push_back(renamed[at]);
        }
        for (const auto arc : boost::make_iterator_range(boost::edges(graph_))) {
            const At from = boost::source(arc, graph_), to = boost::target(arc, graph_);
            if (!kept[from] || !kept[to]) continue;
            const auto added =
                boost::add_edge(renamed[from], renamed[to], graph_[arc], spanned.graph);
            spanned.graph[added.first].index = boost::num_edges(spanned.graph) - 1;
        }
        // Edges of other jobs have nothing to say, unless they are asked for.
        const Joins& joins = catalogue_.joins();
        for (std::size_t i = 0; i < catalogue_.size(); ++i) {
            const Transition& edge = catalogue_[i];
            const auto names = [&](const Demand& demand) { return demand.names(edge); };
            if (!accepted_[i] && (joins.leads_to(ask_.want.job->target, i) ||
                                  std::ranges::any_of(demands_.via, names)))
                spanned.refused.push_back({edge.name, reason(i), !reasons_[i].empty()});
        }
        return spanned;
    }

    std::vector<char> reaches_target() const {
        std::vector<char> kept(boost::num_vertices(graph_));
        std::vector<At> open;
        for (const At at : boost::make_iterator_range(boost::vertices(graph_)))
            if (graph_[at].target) open.push_back(at), kept[at] = 1;
        while (!open.empty()) {
            const At at = open.back();
            open.pop_back();
            for (const auto arc : boost::make_iterator_range(boost::in_edges(at, graph_))) {
                const At from = boost::source(arc, graph_);
                if (!kept[from]) open.push_back(from), kept[from] = 1;
            }
        }
        return kept;
    }

    /// Its own reason, or that of the edges that would have made what it reads.
    std::string reason(std::size_t place) const {
        if (!reasons_[place].empty()) return reasons_[place];
        const Transition& edge = catalogue_[place];
        for (const auto& [from, to] : edge.joins)
            for (std::size_t i = 0; i < catalogue_.size(); ++i)
                for (const auto& join : catalogue_[i].joins)
                    if (takes_kind(from, join.second) && !accepted_[i] && !reasons_[i].empty())
                        return fmt::format("nothing makes its {}: {}: {}", from, catalogue_[i].name,
                                           reasons_[i]);
        return fmt::format("nothing makes its {}", edge.joins.empty() ? "" : edge.joins[0].first);
    }

    const Catalogue& catalogue_;
    const Ask& ask_;
    const Demands& demands_;
    Graph graph_;
    std::deque<At> waiting_;
    std::unordered_map<std::string, At> known_;
    std::vector<char> accepted_;
    std::vector<std::string> reasons_;
    // Why edges are not asked about the views; empty: they are; absent: not yet seen.
    std::vector<std::optional<std::string>> views_;
};

}  // namespace

bool Demand::fits(const Transition& edge, const Parameters& chosen) const {
    if (!names(edge)) return false;
    return std::all_of(with.all().begin(), with.all().end(), [&](const auto& entry) {
        const auto found = chosen.all().find(entry.first);
        return found != chosen.all().end() && found->second == entry.second;
    });
}

namespace {

/// The edge or family that a word means: its name in any case, or the end of it behind the family
/// where only one edge ends so, or only one of `preferred`. @throws RequestError
std::string full_name(const std::string& typed, const Catalogue& catalogue,
                      const std::set<std::string>& preferred) {
    std::vector<std::string> names, ends;
    std::set<std::string> alike;
    for (const Transition& edge : catalogue) {
        if (same_word(typed, edge.name)) return edge.name;
        if (same_word(typed, edge.family())) return edge.family();
        names.push_back(edge.name);
        ends.push_back(edge.name.substr(edge.name.find('.') + 1));
        if (same_word(typed, ends.back())) alike.insert(edge.name);
    }
    if (alike.size() == 1) return *alike.begin();
    std::set<std::string> both;
    std::set_intersection(alike.begin(), alike.end(), preferred.begin(), preferred.end(),
                          std::inserter(both, both.end()));
    if (both.size() == 1) return *both.begin();
    if (!alike.empty())
        throw RequestError(
            fmt::format("'{}' may be {}; say which", typed, fmt::join(alike, " or ")));
    for (const Transition& edge : catalogue) ends.push_back(edge.family());
    const std::string all = message("`@command(list edges)` shows all").marked();
    const bool whole = typed.find('.') != std::string::npos;
    throw RequestError(fmt::format("no edge is called '{}'; {}", typed,
                                   instead_of(typed, whole ? names : ends, all)));
}

Demand demand_in(const std::string& text, const Catalogue& catalogue,
                 const std::set<std::string>& preferred) {
    const std::string typed = text.substr(0, text.find('/'));
    Demand demand{.name = full_name(typed, catalogue, preferred)};
    const auto named = std::find_if(catalogue.begin(), catalogue.end(),
                                    [&](const Transition& edge) { return demand.names(edge); });
    for (std::size_t slash = text.find('/'); slash != std::string::npos;) {
        const std::size_t next = text.find('/', slash + 1);
        const std::string pair = text.substr(slash + 1, next - slash - 1);
        slash = next;
        const std::size_t equals = pair.find('=');
        if (equals == std::string::npos)
            throw RequestError(fmt::format("'{}' in '{}': expected key=value", pair, text));
        const std::string key = lower(pair.substr(0, equals));
        const auto domain = named->parameters.find(key);
        if (demand.name != named->name)
            throw RequestError(
                fmt::format("'{}' is a family, and parameters are of one edge, as {}/{}",
                            demand.name, named->name, pair));
        if (domain == named->parameters.end()) {
            std::vector<std::string> keys;
            for (const auto& entry : named->parameters) keys.push_back(entry.first);
            throw RequestError(fmt::format("'{}' has no parameter '{}'; {}", demand.name, key,
                                           keys.empty() ? "it has none" : instead_of(key, keys)));
        }
        demand.with.set(key, domain->second.parse(demand.name, key, pair.substr(equals + 1)));
    }
    return demand;
}

}  // namespace

Demand demand_of(const std::string& text, const Catalogue& catalogue) {
    return demand_in(text, catalogue, {});
}

Demand demand_of(const std::string& text, const Catalogue& catalogue, Job job) {
    return demand_in(text, catalogue, catalogue.joins().towards(job->target));
}

Demands untried(const Demands& demands, const Catalogue& catalogue) {
    Demands found;
    for (const Demand& demand : demands.via) {
        const auto is_untried = [&](const Transition& edge) {
            const auto nobody_tries = [&](const auto& parameter) {
                const auto domain = edge.parameters.find(parameter.first);
                if (domain == edge.parameters.end()) return false;
                const auto& tried = domain->second.tried;
                return std::find(tried.begin(), tried.end(), parameter.second) == tried.end();
            };
            const auto& with = demand.with.all();
            return demand.names(edge) &&
                   (!edge.plain || std::any_of(with.begin(), with.end(), nobody_tries));
        };
        if (std::any_of(catalogue.begin(), catalogue.end(), is_untried))
            found.via.push_back(demand);
    }
    return found;
}

TransformGraph expand(const Catalogue& catalogue, const Ask& ask,
                      const std::vector<Source>& sources, const Demands& demands) {
    return Expansion(catalogue, ask, demands).span(sources);
}

}  // namespace edgewise
