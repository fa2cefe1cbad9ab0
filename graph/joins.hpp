#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace edgewise {

class Catalogue;  // graph/transition.hpp

/// An edge that reads a content of a space, with which facets, and whether it does nothing there
/// but prepare: lead from object space to object space.
struct Leaving {
    int edge = 0;  // place in the catalogue
    std::set<std::string> needs = {};
    bool prepares_only = true;
};

/// What the kinds that edges join say of all requests.
class Joins {
 public:
    explicit Joins(const Catalogue& catalogue);

    /// The edges that leave "space/content", in the order of the catalogue; one that reads it with
    /// different facets is there several times, one after another.
    const std::vector<Leaving>& leaving(std::string_view kind) const;
    /// Whether an edge may lead to a kind, by the kinds that edges join, whatever their facets.
    bool leads_to(std::string_view kind, std::size_t edge) const;
    /// The names of those that may.
    std::set<std::string> towards(std::string_view kind) const;

 private:
    std::vector<std::string> names_;
    std::map<std::string, std::vector<Leaving>, std::less<>> leaving_;
    std::map<std::string, std::vector<char>, std::less<>> towards_;  // by kind, by edge
};

}  // namespace edgewise
