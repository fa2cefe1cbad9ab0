#include "charts/page.hpp"

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "charts/axes.hpp"
#include "charts/embedded.hpp"
#include "charts/families.hpp"

namespace edgewise::charts {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json axis_json(const LogAxis& axis) {
    Json ticks = Json::array();
    for (const Tick& tick : axis.ticks) ticks.push_back({{"at", tick.at}, {"text", tick.text}});
    return {{"low", axis.low}, {"high", axis.high}, {"zero", or_null(axis.zero)}, {"ticks", ticks}};
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
        {"pictures", pictures ? to_json(*pictures) : Json()}};
}

std::string html_text(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (c == '&')
            safe += "&amp;";
        else if (c == '<')
            safe += "&lt;";
        else
            safe += c;
    }
    return safe;
}

/// JSON as it may stand in a script element, which the first "</script" would end. In JSON "<" is
/// found in texts only.
std::string script_text(const Json& json) {
    std::string safe;
    for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace))
        safe += c == '<' ? std::string("\\u003c") : std::string(1, c);
    return safe;
}

/// Puts texts in the places that {{name}} marks; what is put in is not looked at again.
std::string filled(std::string_view form, const std::map<std::string, std::string>& texts) {
    std::string whole;
    while (true) {
        const std::size_t begin = form.find("{{");
        const std::size_t end = form.find("}}", begin);
        whole += form.substr(0, begin);
        if (begin == std::string_view::npos || end == std::string_view::npos) return whole;
        whole += texts.at(std::string(form.substr(begin + 2, end - begin - 2)));
        form.remove_prefix(end + 2);
    }
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
