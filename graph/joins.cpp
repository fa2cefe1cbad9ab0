#include "graph/joins.hpp"

#include "graph/representation.hpp"
#include "graph/transition.hpp"

namespace edgewise {
namespace {

std::string_view without_facets(std::string_view kind) { return kind.substr(0, kind.find('+')); }

bool prepares(std::string_view from, std::string_view to) {
    return from.starts_with("object/") && to.starts_with("object/");
}

/// Kinds without facets, by small numbers.
class KindNumbers {
 public:
    std::size_t of(std::string_view kind) {
        return numbers_.try_emplace(without_facets(kind), numbers_.size()).first->second;
    }
    const std::map<std::string_view, std::size_t>& all() const noexcept { return numbers_; }

 private:
    std::map<std::string_view, std::size_t> numbers_;
};

/// Whether one kind leads to another by some edges, or is the same (Warshall 1962).
class Reach {
 public:
    explicit Reach(std::size_t kinds) : kinds_(kinds), leads_(kinds * kinds) {
        for (std::size_t kind = 0; kind < kinds; ++kind) join(kind, kind);
    }
    void join(std::size_t from, std::size_t to) { leads_[from * kinds_ + to] = 1; }
    bool leads(std::size_t from, std::size_t to) const { return leads_[from * kinds_ + to] != 0; }
    void close() {
        for (std::size_t by = 0; by < kinds_; ++by)
            for (std::size_t from = 0; from < kinds_; ++from)
                for (std::size_t to = 0; leads(from, by) && to < kinds_; ++to)
                    if (leads(by, to)) join(from, to);
    }

 private:
    std::size_t kinds_;
    std::vector<char> leads_;
};

}  // namespace

Joins::Joins(const Catalogue& catalogue) {
    struct Join {
        std::size_t edge, from, to;
    };
    KindNumbers numbers;
    std::vector<Join> joins;
    for (std::size_t i = 0; i < catalogue.size(); ++i) {
        names_.push_back(catalogue[i].name);
        for (const auto& [from, to] : catalogue[i].joins) {
            joins.push_back({i, numbers.of(from), numbers.of(to)});
            std::vector<Leaving>& all = leaving_[std::string(without_facets(from))];
            std::set<std::string> needs = facets_of(from);
            const bool prepares_only = prepares(from, to);
            if (all.empty() || all.back().edge != static_cast<int>(i) || all.back().needs != needs)
                all.push_back({static_cast<int>(i), std::move(needs), prepares_only});
            else
                all.back().prepares_only = all.back().prepares_only && prepares_only;
        }
    }
    Reach reach(numbers.all().size());
    for (const Join& join : joins) reach.join(join.from, join.to);
    reach.close();
    for (const auto& [kind, number] : numbers.all()) {
        std::vector<char> towards(catalogue.size());
        for (const Join& join : joins)
            if (reach.leads(join.to, number)) towards[join.edge] = 1;
        towards_.emplace(std::string(kind), std::move(towards));
    }
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
