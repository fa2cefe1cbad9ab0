#include <algorithm>
#include <map>

#include "cli/advise.hpp"

namespace edgewise::cli {
namespace {

void take_costs(const std::vector<CostAdvice>& costs, std::map<std::string, AdvisedCost>& joined) {
    for (const CostAdvice& one : costs) {
        AdvisedCost& all = joined[one.name];
        if (all.requests++ == 0) {
            all.advice = one;
            continue;
        }
        const double regret = all.advice.regret + one.regret;
        if (one.measuring > all.advice.measuring) all.advice = one;
        all.advice.regret = regret;
    }
}

/// @param by_kind  else by the representations with their extents
void take_arcs(const std::vector<ArcAdvice>& arcs, bool by_kind,
               std::map<std::pair<std::string, std::string>, AdvisedArc>& joined) {
    // Of one request the largest gain counts once for a pair of kinds.
    std::map<std::pair<std::string, std::string>, const ArcAdvice*> largest;
    for (const ArcAdvice& one : arcs) {
        const auto ends =
            by_kind ? std::pair(one.from_kind, one.to_kind) : std::pair(one.from, one.to);
        const ArcAdvice*& most = largest[ends];
        if (!most || one.gain > most->gain) most = &one;
    }
    for (const auto& [ends, one] : largest) {
        AdvisedArc& all = joined[ends];
        ++all.requests;
        all.gain += one->gain;
        if (one->gain > all.advice.gain) all.advice = *one;
    }
}

}  // namespace

Summary summary_of(const std::vector<Advice>& all) {
    Summary summary;
    std::map<std::string, AdvisedCost> costs;
    std::map<std::pair<std::string, std::string>, AdvisedArc> arcs;
    for (const Advice& each : all) {
        summary.measured += each.measured;
        summary.idle += each.idle;
        take_costs(each.costs, costs);
        take_arcs(each.arcs, all.size() > 1, arcs);
    }
    for (auto& [name, one] : costs) summary.costs.push_back(std::move(one));
    for (auto& [ends, one] : arcs) summary.arcs.push_back(std::move(one));
    std::stable_sort(summary.costs.begin(), summary.costs.end(),
                     [](const AdvisedCost& a, const AdvisedCost& b) {
                         return a.advice.worth() > b.advice.worth();
                     });
    std::stable_sort(summary.arcs.begin(), summary.arcs.end(),
                     [](const AdvisedArc& a, const AdvisedArc& b) { return a.gain > b.gain; });
    return summary;
}

}  // namespace edgewise::cli
