#include "engine/rivals.hpp"

#include <algorithm>
#include <cmath>

#include "engine/paths.hpp"
#include "engine/planned.hpp"
#include "engine/wisdom.hpp"
#include "measure/quantiles.hpp"

namespace edgewise {
namespace {

constexpr double kLeastSpread = 0.03;  // that two runs of one path differ by

/// The steps of a path as wisdom writes it.
std::vector<std::string> steps_of(const std::string& path) {
    constexpr std::string_view kBetween = " > ";
    std::vector<std::string> steps;
    for (std::size_t begin = 0;;) {
        const std::size_t end = path.find(kBetween, begin);
        steps.push_back(path.substr(begin, end - begin));
        if (end == std::string::npos) return steps;
        begin = end + kBetween.size();
    }
}

/// What pilots measured of this request.
Candidates::Known known_of(const Planned& planned) {
    Candidates::Known known;
    if (planned.query.planner == Planner::estimate || planned.input.described ||
        !planned.query.remembers)
        return known;
    const Wisdom wisdom = Wisdom::load(planned.engine.wisdom());
    const Wisdom::Paths* paths = wisdom.find(wisdom_key(planned));
    if (!paths) return known;
    for (const auto& [path, learned] : *paths) {
        if (learned.seconds.empty()) continue;
        const double middle = median(learned.seconds);
        std::vector<double> away;
        for (const double each : learned.seconds) away.push_back(std::abs(std::log(each / middle)));
        // As a pilot judges: half of the way to the end of the interval.
        known[steps_of(path)] = {middle, std::max(kLeastSpread, 1.4826 * median(away)),
                                 learned.bytes, 0.5 * (learned.error + learned.high), true};
    }
    return known;
}

}  // namespace

std::unique_ptr<Candidates> candidates_of(const Planned& planned) {
    return std::make_unique<Candidates>(planned.engine.edges(), planned.ask(), planned.graph(),
                                        planned.plan_options, known_of(planned));
}

void weigh(Planned& planned) {
    // What another path would have to be is not known where errors were not measured, or decided
    // nothing.
    if (planned.answer.plan && planned.errors == ErrorsWanted::asked && !planned.seen_better)
        planned.margin = margin_of(*candidates_of(planned), *planned.answer.plan);
}

}  // namespace edgewise
