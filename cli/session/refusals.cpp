#include "cli/session/refusals.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/request/spoken.hpp"

namespace edgewise::cli {
namespace {

bool waits_for_via(const Refusal& refusal, const Catalogue& catalogue) {
    const auto edge = std::find_if(catalogue.begin(), catalogue.end(), [&](const Transition& each) {
        return each.name == refusal.transition;
    });
    return edge != catalogue.end() && (*edge).on_demand &&
           std::ranges::any_of(refusal.reason.settings(),
                               [](const Setting& named) { return named.field == "via"; });
}

}  // namespace

Refusals folded(const std::vector<Refusal>& refused, const Catalogue& catalogue) {
    Refusals all;
    for (const Refusal& refusal : refused) {
        if (!refusal.asked) {
            all.unreached.push_back(refusal.transition);
        } else if (waits_for_via(refusal, catalogue)) {
            all.only_by_via.push_back(refusal.transition);
        } else {
            const std::string reason = spoken(refusal.reason);
            const auto known = std::find_if(all.reasons.begin(), all.reasons.end(),
                                            [&](const auto& each) { return each.first == reason; });
            if (known == all.reasons.end())
                all.reasons.emplace_back(reason, std::vector{refusal.transition});
            else
                known->second.push_back(refusal.transition);
        }
    }
    std::stable_sort(all.reasons.begin(), all.reasons.end(), [](const auto& a, const auto& b) {
        return a.second.size() > b.second.size();
    });
    return all;
}

std::string count_text(const Refusals& refusals) {
    std::vector<std::string> parts;
    if (const std::size_t n = refusals.only_by_via.size())
        parts.push_back(fmt::format("{} only by --via", n));
    if (const std::size_t n = refusals.unreached.size())
        parts.push_back(fmt::format("{} {} from another", n, n == 1 ? "follows" : "follow"));
    if (const std::size_t n = refusals.reasons.size())
        parts.push_back(fmt::format("{} reason{}", n, n == 1 ? "" : "s"));
    return fmt::format("{}", fmt::join(parts, ", "));
}

std::string few_of(const std::vector<std::string>& names, std::size_t most) {
    if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
    return fmt::format(
        "{} and {} more",
        fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(most), ", "),
        names.size() - most);
}

}  // namespace edgewise::cli
