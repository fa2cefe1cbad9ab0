#pragma once

#include <string>
#include <utility>
#include <vector>

#include "graph/plan.hpp"
#include "graph/transition.hpp"

namespace edgewise::cli {

/// Refusals by what people would do about them.
struct Refusals {
    std::vector<std::string> only_by_via;  // edges that nobody named
    std::vector<std::string> unreached;    // edges of which nothing makes what they read
    /// Reasons, those of most edges first, with the edges that have them.
    std::vector<std::pair<std::string, std::vector<std::string>>> reasons;
};

Refusals folded(const std::vector<Refusal>& refused, const Catalogue& catalogue);

/// "20 only by --via, 15 follow from another, 10 reasons".
std::string count_text(const Refusals& refusals);

/// Names, of many the first and how many more there are.
std::string few_of(const std::vector<std::string>& names, std::size_t most);

}  // namespace edgewise::cli
