#include "charts/page.hpp"

#include <nlohmann/json.hpp>

#include "charts/axes.hpp"
#include "charts/courses.hpp"
#include "charts/embedded.hpp"
#include "charts/families.hpp"
#include "charts/html.hpp"

namespace edgewise::charts {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json axis_json(const LogAxis& axis) {
    Json ticks = Json::array();
    for (const Tick& tick : axis.ticks) ticks.push_back({{"at", tick.at}, {"text", tick.text}});
    return {{"low", axis.low}, {"high", axis.high}, {"zero", or_null(axis.zero)}, {"ticks", ticks}};
}

Json courses_json(const Table& table) {
    Json courses = Json::array();
    if (table.swept.empty()) return courses;
    for (const Course& course : courses_of(table))
        courses.push_back({{"number", course.number},
                           {"dash", course.dash},
                           {"path", course.path},
                           {"family", course.family},
                           {"points", course.points}});
    return courses;
}

Json layout_of(const Table& table, const Pictures* pictures) {
    Json families = Json::array();
    for (const std::string& name : families_of(table)) {
        const Style style = style_of(families.size());
        families.push_back({{"name", name}, {"colour", style.colour}, {"shape", style.shape}});
    }
    return {
        {"axes",
         {{"seconds", axis_json(seconds_axis(table))}, {"error", axis_json(error_axis(table))}}},
        {"budgets",
         {{"seconds", or_null(table.seconds_budget)}, {"error", or_null(table.error_budget)}}},
        {"families", families},
        {"courses", courses_json(table)},
        {"pictures", pictures ? to_json(*pictures) : Json()}};
}

}  // namespace

std::string page_of(const Table& table, Json document, const Pictures* pictures) {
    document["chart"] = layout_of(table, pictures);
    return filled(kPageHtml, {{"title", html_text(table.title)},
                              {"css", kPageCss},
                              {"d3", kD3},
                              {"script", kPageScript},
                              {"licence", html_text(kD3Licence)},
                              {"data", script_text(document)}});
}

}  // namespace edgewise::charts
