#include "cli/session/margin_report.hpp"

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/session/report.hpp"
#include "engine/paths.hpp"
#include "engine/planned.hpp"
#include "request/quantities.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
    return value ? Json(*value) : Json();
}

std::string step_text(const StepMargin& step) {
    if (!step.factor) return fmt::format("  {}: however slow, no other path fits\n", step.step);
    const std::string then = step.instead.empty()
                                 ? "no plan is left"
                                 : fmt::format("{} is chosen", path_text(step.instead));
    return fmt::format(
        "  {}: were it to take {:.3g} times as long, {}{}\n", step.step, *step.factor, then,
        step.inside ? fmt::format("; within its spread of {:.2f}: a toss-up", std::exp(step.spread))
                    : "");
}

std::string rival_text(const Rival& rival) {
    std::vector<std::string> parts;
    const auto compare = [&](double more, const std::string& amount, const char* worse,
                             const char* better) {
        if (more != 0) parts.push_back(fmt::format("{} {}", amount, more > 0 ? worse : better));
    };
    compare(rival.seconds, seconds_text(std::abs(rival.seconds)), "slower", "faster");
    if (!rival.error)
        parts.push_back("its error is unknown");
    else
        compare(*rival.error, fmt::format("{:.2g}", std::abs(*rival.error)), "more error",
                "less error");
    compare(rival.bytes, bytes_text(std::abs(rival.bytes)), "more", "less");
    if (!rival.breaks.empty())
        parts.push_back(fmt::format("breaks the budget of {}", fmt::join(rival.breaks, " and ")));
    if (rival.faster && rival.differs)
        parts.push_back(
            fmt::format("chosen were {} {:.3g} times as fast", *rival.differs, *rival.faster));
    if (rival.toss_up)
        parts.push_back(
            fmt::format("faster with a chance of {:.0f} %: a toss-up", 100 * rival.chance));
    return fmt::format("  {}: {}\n", path_text(rival.steps), fmt::join(parts, ", "));
}

}  // namespace

std::string margin_text(const Planned& planned) {
    if (!planned.margin) return {};
    const Margin& margin = *planned.margin;
    std::string text = "\nmargin\n";
    for (const StepMargin& step : margin.steps) text += step_text(step);
    if (margin.late > 0.05)
        text += fmt::format("  with a chance of {:.0f} % it takes longer than --max-time\n",
                            100 * margin.late);
    if (!margin.rivals.empty()) text += "\nrivals\n";
    for (const Rival& rival : margin.rivals) text += rival_text(rival);
    return text;
}

Json margin_json(const Margin& margin) {
    Json steps = Json::array();
    for (const StepMargin& step : margin.steps)
        steps.push_back({{"step", step.step},
                         {"factor", or_null(step.factor)},
                         {"instead", step.factor ? Json(step.instead) : Json()},
                         {"spread", step.spread},
                         {"inside", step.inside}});
    return {{"steps", steps}, {"toss_up", margin.toss_up}, {"late", margin.late}};
}

Json rivals_json(const Margin& margin) {
    Json rivals = Json::array();
    for (const Rival& rival : margin.rivals)
        rivals.push_back({{"steps", rival.steps},
                          {"predicted", to_json(rival.predicted)},
                          {"loses",
                           {{"seconds", rival.seconds},
                            {"bytes", rival.bytes},
                            {"error", or_null(rival.error)}}},
                          {"breaks", rival.breaks},
                          {"differs", or_null(rival.differs)},
                          {"faster", or_null(rival.faster)},
                          {"chance", rival.chance},
                          {"toss_up", rival.toss_up}});
    return rivals;
}

}  // namespace edgewise::cli
