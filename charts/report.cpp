#include "charts/report.hpp"

#include <cmath>
#include <fmt/format.h>

#include "charts/embedded.hpp"
#include "charts/html.hpp"
#include "charts/scales.hpp"

namespace edgewise::charts {
namespace {

constexpr const char* kUnknown = "–";

std::string bytes_text(double bytes) { return fmt::format("{:.1f}\u00a0MiB", bytes / 0x1p20); }

/// "0.0123 (38.2 dB)"; a narrow column breaks it before the bracket only.
std::string error_text(double error) {
    if (!(error > 0) || !std::isfinite(error)) return plain_text(error);
    return fmt::format("{} ({:.1f}\u00a0dB)", plain_text(error), -20 * std::log10(error));
}

using Text = std::string (*)(double);

std::string cell(const std::optional<double>& value, Text text, const std::string& otherwise) {
    if (!value) return "<td class=\"soft\">" + html_text(otherwise) + "</td>";
    return fmt::format("<td><data value=\"{}\">{}</data></td>", *value, html_text(text(*value)));
}

std::string or_unknown(const std::string& text) { return text.empty() ? kUnknown : text; }

/// Predicted, measured, and how many times that.
std::string cells(const std::optional<double>& predicted, const std::optional<double>& measured,
                  Text text, const ReportStep& step, const std::string& unmeasured) {
    std::string ratio;
    if (predicted && measured && *predicted > 0 && std::isfinite(*measured))
        ratio = fmt::format("{:.2f}", *measured / *predicted);
    return cell(predicted, text, or_unknown(step.no_prediction)) +
           cell(measured, text, or_unknown(unmeasured)) + "<td class=\"soft\">" + ratio + "</td>";
}

std::string row(const ReportStep& step, const char* kind) {
    const std::string note =
        step.note.empty() ? "" : "<div class=\"soft\">" + html_text(step.note) + "</div>";
    return fmt::format(
        "<tr class=\"{}\"><th scope=\"row\">{}{}</th>{}{}{}</tr>\n", kind, html_text(step.name),
        note, cells(step.predicted.seconds, step.measured.seconds, seconds_text, step, ""),
        cells(step.predicted.bytes, step.measured.bytes, bytes_text, step, ""),
        cells(step.predicted.error, step.measured.error, error_text, step, step.no_error));
}

std::string steps_of(const Report& report) {
    std::string rows;
    for (const ReportStep& step : report.steps) rows += row(step, "step");
    return rows + row(report.total, "total");
}

std::string front_of(const Report& report) {
    std::string rows;
    for (const ReportPath& path : report.front)
        rows += fmt::format("<tr{}><th scope=\"row\">{}</th>{}{}{}<td class=\"why\">{}</td></tr>\n",
                            path.chosen ? " class=\"chosen\"" : "", html_text(path.path),
                            cell(path.predicted.seconds, seconds_text, kUnknown),
                            cell(path.predicted.bytes, bytes_text, kUnknown),
                            cell(path.predicted.error, error_text, "unknown"),
                            path.chosen ? "chosen" : html_text(path.why_not));
    return rows;
}

std::string facts_of(const std::vector<Fact>& facts) {
    std::string list;
    for (const auto& [name, text] : facts)
        list += fmt::format("<dt>{}</dt><dd>{}</dd>\n", html_text(name), html_text(text));
    return list;
}

std::string refused_of(const Report& report) {
    std::string rows;
    for (const auto& [name, reason] : report.refused)
        rows += fmt::format("<tr><th scope=\"row\">{}</th><td class=\"why\">{}</td></tr>\n",
                            html_text(name), html_text(reason));
    return rows;
}

std::string warnings_of(const Report& report) {
    if (report.warnings.empty()) return {};
    std::string list = "<ul id=\"warnings\" aria-label=\"warnings\">\n";
    for (const std::string& warning : report.warnings)
        list += "<li>" + html_text(warning) + "</li>\n";
    return list + "</ul>";
}

/// Colours go with the root of the difference: what is in the middle of a half is a quarter.
std::string legend_of(double scale) {
    const auto tick = [&](double share) {
        return fmt::format("<span>{}{}</span>",
                           share > 0   ? "+"
                           : share < 0 ? "−"
                                       : "",
                           fmt::format("{:.4g}", std::abs(share * scale)));
    };
    return "<div class=\"legend\"><div class=\"bar\"></div><div class=\"ticks\">" + tick(-1) +
           tick(-0.25) + tick(0) + tick(0.25) + tick(1) + "</div></div>";
}

std::string figure(const char* id, const ReportPicture& picture, const std::string& legend) {
    return fmt::format(
        "<figure id=\"{}\"><img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}\">{}"
        "<figcaption>{}</figcaption></figure>\n",
        id, picture.uri, picture.width, picture.height, html_text(picture.text), legend,
        html_text(picture.text));
}

std::string pictures_of(const Report& report) {
    std::string figures;
    if (report.picture) figures += figure("picture", *report.picture, "");
    if (report.difference)
        figures += figure("difference", *report.difference, legend_of(report.difference_scale));
    if (!report.no_difference.empty())
        figures += "<p class=\"soft\">" + html_text(report.no_difference) + "</p>\n";
    return figures;
}

/// What an XML file has before its root does not belong into HTML.
std::string graph_of(const Report& report) {
    const std::size_t begin = report.graph.find("<svg");
    if (begin == std::string::npos)
        return "<p class=\"soft\">" + html_text(report.no_graph) + "</p>";
    return "<div class=\"graph\">" + report.graph.substr(begin) + "</div>";
}

}  // namespace

std::string page_of(const Report& report) {
    return filled(kReportHtml, {{"title", html_text(report.title)},
                                {"css", std::string(kPageCss) + kReportCss},
                                {"command", html_text(report.command)},
                                {"warnings", warnings_of(report)},
                                {"request", facts_of(report.request)},
                                {"machine", facts_of(report.machine)},
                                {"pictures", pictures_of(report)},
                                {"steps", steps_of(report)},
                                {"graph", graph_of(report)},
                                {"front", front_of(report)},
                                {"refused", refused_of(report)},
                                {"data", script_text(report.document)}});
}

}  // namespace edgewise::charts
