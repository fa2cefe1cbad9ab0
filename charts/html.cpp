#include "charts/html.hpp"

#include <nlohmann/json.hpp>

namespace edgewise::charts {

std::string html_text(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (c == '&')
            safe += "&amp;";
        else if (c == '<')
            safe += "&lt;";
        else if (c == '>')
            safe += "&gt;";
        else if (c == '"')
            safe += "&quot;";
        else
            safe += c;
    }
    return safe;
}

std::string script_text(const nlohmann::ordered_json& json) {
    std::string safe;
    for (const char c : json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace))
        safe += c == '<' ? std::string("\\u003c") : std::string(1, c);
    return safe;
}

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

}  // namespace edgewise::charts
