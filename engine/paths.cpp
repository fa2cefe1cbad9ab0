#include "engine/paths.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <random>
#include <set>

#include "engine/planned.hpp"

namespace edgewise {
namespace {

/// Paths of a turntable hold a placement for every view, so not all of a huge graph are kept.
constexpr std::size_t kMostPaths = 4000;

using Texts = std::vector<std::string>;

/// Whether one step more, one less or one exchanged makes one path of the other.
bool neighbours(const Texts& a, const Texts& b) {
    if (a.size() > b.size()) return neighbours(b, a);
    if (b.size() - a.size() > 1) return false;
    const auto [at, bt] = std::mismatch(a.begin(), a.end(), b.begin());
    if (bt == b.end()) return false;
    return a.size() == b.size() ? std::equal(at + 1, a.end(), bt + 1, b.end())
                                : std::equal(at, a.end(), bt + 1, b.end());
}

std::vector<bool> front_of(const std::vector<Plan>& plans) {
    std::vector<bool> front(plans.size());
    for (std::size_t i = 0; i < plans.size(); ++i) {
        const Predicted& a = plans[i].predicted;
        // Sorted by seconds: only what comes before can beat it.
        front[i] =
            std::none_of(plans.begin(), plans.begin() + std::ptrdiff_t(i), [&](const Plan& other) {
                const Predicted& b = other.predicted;
                return b.bytes <= a.bytes && (!a.known || (b.known && b.error <= a.error));
            });
    }
    return front;
}

/// All paths, and what the planner found where these were cut off, each once, fastest first.
/// The planner's own predictions count where it has any: it may have measured.
std::vector<Plan> all_plans(const Planned& planned) {
    const auto graph = planned.graph();
    std::vector<Plan> plans = all_paths(graph->real(), planned.engine.edges(), planned.ask(),
                                        planned.plan_options, kMostPaths);
    std::map<Texts, std::size_t> places;
    for (std::size_t i = 0; i < plans.size(); ++i) places.emplace(plans[i].texts(), i);
    const auto take = [&](const Plan& plan) {
        const auto [at, is_new] = places.emplace(plan.texts(), plans.size());
        if (is_new)
            plans.push_back(plan);
        else
            plans[at->second].predicted = plan.predicted;
    };
    for (const Plan& plan : planned.answer.front) take(plan);
    if (planned.answer.plan) take(*planned.answer.plan);
    std::stable_sort(plans.begin(), plans.end(), [](const Plan& a, const Plan& b) {
        return a.predicted.seconds < b.predicted.seconds;
    });
    return plans;
}

/// Places of the paths to keep, the most wanted first.
std::vector<std::size_t> wanted(const std::vector<Plan>& plans, const std::vector<bool>& front,
                                const Texts* chosen, std::uint64_t seed) {
    std::vector<Texts> texts, front_texts;
    for (const Plan& plan : plans) texts.push_back(plan.texts());
    for (std::size_t i = 0; i < plans.size(); ++i)
        if (front[i]) front_texts.push_back(texts[i]);
    std::mt19937_64 bits(seed);
    std::vector<std::pair<std::uint64_t, std::size_t>> ranked;  // class and lot, place
    for (std::size_t i = 0; i < plans.size(); ++i) {
        // The upper bits are the class; within the sample the lots decide, else the order.
        const std::uint64_t lot = bits() >> 2;
        std::uint64_t rank = lot | std::uint64_t{3} << 62;
        if (chosen && texts[i] == *chosen)
            rank = 0;
        else if (front[i])
            rank = std::uint64_t{1} << 62;
        else if (std::any_of(front_texts.begin(), front_texts.end(),
                             [&](const Texts& other) { return neighbours(other, texts[i]); }))
            rank = std::uint64_t{2} << 62;
        ranked.emplace_back(rank, i);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> order;
    for (const auto& [rank, place] : ranked) order.push_back(place);
    return order;
}

}  // namespace

TriedPaths tried_paths(const Planned& planned, std::size_t limit, std::uint64_t seed,
                       const std::set<std::string>& only) {
    TriedPaths tried;
    std::vector<Plan> plans = all_plans(planned);
    const std::vector<bool> front = front_of(plans);
    tried.all = plans.size();
    std::vector<std::size_t> kept;
    if (!only.empty()) {
        for (std::size_t i = 0; i < plans.size(); ++i)
            if (only.contains(path_text(plans[i].texts()))) kept.push_back(i);
    } else {
        Texts chosen;
        const bool has_plan = planned.answer.plan.has_value();
        if (has_plan) chosen = planned.answer.plan->texts();
        kept = wanted(plans, front, has_plan ? &chosen : nullptr, seed);
        kept.resize(std::min(limit, kept.size()));
        std::sort(kept.begin(), kept.end());
    }
    for (const std::size_t place : kept) {
        tried.plans.push_back(std::move(plans[place]));
        tried.front.push_back(front[place]);
    }
    return tried;
}

std::string path_text(const std::vector<std::string>& steps) {
    return steps.empty() ? "(the input itself)" : fmt::format("{}", fmt::join(steps, " > "));
}

}  // namespace edgewise
