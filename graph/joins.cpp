#include "graph/joins.hpp"

#include "graph/representation.hpp"
#include "graph/transition.hpp"

namespace edgewise {
namespace {

std::string_view without_facets(std::string_view kind) { return kind.substr(0, kind.find('+')); }

bool prepares(std::string_view from, std::string_view to) {
    return from.starts_with("object/") && to.starts_with("object/");
}

std::vector<char> edges_towards(std::string_view target, const Catalogue& catalogue) {
    std::set<std::string_view> wanted{target};
    std::vector<char> found(catalogue.size());
    for (bool grows = true; grows;) {
        grows = false;
        for (std::size_t i = 0; i < catalogue.size(); ++i)
            for (const auto& [from, to] : catalogue[i].joins) {
                if (!wanted.contains(without_facets(to))) continue;
                found[i] = 1;
                grows = wanted.insert(without_facets(from)).second || grows;
            }
    }
    return found;
}

}  // namespace

Joins::Joins(const Catalogue& catalogue) {
    std::set<std::string_view> kinds;
    for (std::size_t i = 0; i < catalogue.size(); ++i) {
        names_.push_back(catalogue[i].name);
        for (const auto& [from, to] : catalogue[i].joins) {
            kinds.insert(without_facets(to));
            std::vector<Leaving>& all = leaving_[std::string(without_facets(from))];
            std::set<std::string> needs = facets_of(from);
            const bool prepares_only = prepares(from, to);
            if (all.empty() || all.back().edge != static_cast<int>(i) || all.back().needs != needs)
                all.push_back({static_cast<int>(i), std::move(needs), prepares_only});
            else
                all.back().prepares_only = all.back().prepares_only && prepares_only;
        }
    }
    for (const std::string_view kind : kinds)
        towards_.emplace(std::string(kind), edges_towards(kind, catalogue));
}

const std::vector<Leaving>& Joins::leaving(std::string_view kind) const {
    static const std::vector<Leaving> none;
    const auto found = leaving_.find(kind);
    return found == leaving_.end() ? none : found->second;
}

bool Joins::leads_to(std::string_view kind, std::size_t edge) const {
    const auto found = towards_.find(without_facets(kind));
    return found != towards_.end() && found->second[edge];
}

std::set<std::string> Joins::towards(std::string_view kind) const {
    std::set<std::string> found;
    for (std::size_t i = 0; i < names_.size(); ++i)
        if (leads_to(kind, i)) found.insert(names_[i]);
    return found;
}

}  // namespace edgewise
