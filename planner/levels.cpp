#include "planner/levels.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "graph/cost.hpp"
#include "planner/json_fields.hpp"

namespace edgewise {

double cost_in(const Levels& levels, double Level::*cost, double set) noexcept {
    if (!(set > 0)) return levels.back().*cost;
    const auto holds = std::find_if(levels.begin(), levels.end() - 1,
                                    [&](const Level& level) { return set <= level.bytes; });
    const Level& level = *holds;
    if (holds == levels.begin()) return level.*cost;
    const Level& below = *(holds - 1);
    const double begin = below.bytes, end = std::min(2 * begin, level.bytes);
    const double part = std::min(1.0, std::log(set / begin) / std::log(end / begin));
    return (1 - part) * below.*cost + part * level.*cost;
}

double line_again(const Levels& levels, double set) noexcept {
    // Share of a copy's seconds, since other work goes on while a line comes. Least squares over
    // 160 ray casts of ten scans: 0.3 to 0.4 for zero-order holds, 0.3 for first-order holds.
    constexpr double kInOrder = 0.4;
    const auto beyond_near = [&](double Level::*cost) {
        return cost_in(levels, cost, 2 * set) - levels.front().*cost;
    };
    return std::max(beyond_near(&Level::line),
                    kInOrder * kLineBytes * beyond_near(&Level::streamed));
}

nlohmann::json to_json(const Levels& levels) {
    nlohmann::json json = nlohmann::json::array();
    for (const Level& level : levels) {
        json.push_back({{"streamed", level.streamed},
                        {"gather", level.gather},
                        {"line", level.line},
                        {"spread", level.spread}});
        if (std::isfinite(level.bytes)) json.back()["bytes"] = level.bytes;
    }
    return json;
}

Levels levels_of(const nlohmann::json& json, const std::string& file) {
    const JsonFields fields(file);
    if (!json.is_array()) fields.reject("levels", "expected a list");
    Levels levels;
    for (const nlohmann::json& each : json) {
        const std::string where = fmt::format("levels.{}", levels.size());
        if (!each.is_object()) fields.reject(where, "expected an object");
        const auto number = [&](const char* key, double low, double high) {
            return fields.number(each.value(key, nlohmann::json()), where + "." + key, low, high);
        };
        const bool last = levels.size() + 1 == json.size();
        const Level before = levels.empty() ? Level{.bytes = 0} : levels.back();
        Level level{.streamed = number("streamed", 0, 1), .gather = number("gather", 0, 1)};
        level.line = each.contains("line") ? number("line", 0, 1) : level.gather;
        if (each.contains("spread")) level.spread = number("spread", 0, 10);
        if (!last || each.contains("bytes")) level.bytes = number("bytes", 1, 1e18);
        if (!(level.bytes > before.bytes))
            fields.reject(where + ".bytes", "expected more than the level before holds");
        // Else a larger set would be read faster than a smaller one.
        if (level.streamed < before.streamed)
            fields.reject(where + ".streamed", "expected no less than that of the level before");
        if (level.gather < before.gather)
            fields.reject(where + ".gather", "expected no less than that of the level before");
        if (level.line < before.line)
            fields.reject(where + ".line", "expected no less than that of the level before");
        levels.push_back(level);
    }
    return levels;
}

}  // namespace edgewise
