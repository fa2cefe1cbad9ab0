#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "graph/transform_graph.hpp"

namespace edgewise {
namespace {

std::string dot_string(const std::string& text) {
    std::string safe = "\"";
    for (char c : text) {
        if (c == '"' || c == '\\') safe += '\\';
        safe += c;
    }
    return safe + "\"";
}

constexpr const char* kHeader =
    "digraph edgewise {\n  rankdir=LR;\n"
    "  node [shape=box, style=rounded, fontname=\"Helvetica\"];\n"
    "  edge [fontname=\"Helvetica\", fontsize=10];\n";

std::string kind_of_vertex(const Vertex& vertex) {
    if (vertex.source >= 0) return ", style=\"rounded,filled\", fillcolor=\"#d8e8f8\"";
    if (vertex.target) return ", style=\"rounded,filled\", fillcolor=\"#d8f0d8\"";
    return "";
}

}  // namespace

std::string to_dot(const TransformGraph& spanned, const Catalogue& catalogue, const ArcText& cost) {
    std::string dot = kHeader;
    const Graph& graph = spanned.graph;
    for (const auto at : boost::make_iterator_range(boost::vertices(graph)))
        dot += fmt::format("  v{} [label={}{}];\n", at, dot_string(graph[at].what.text()),
                           kind_of_vertex(graph[at]));
    for (const auto arc : boost::make_iterator_range(boost::edges(graph))) {
        std::string label = catalogue[graph[arc].edge].name + graph[arc].offer.with.text();
        std::string text = dot_string(label);
        if (cost) text = dot_string(label + "\n" + cost(graph[arc]));
        for (std::size_t at; (at = text.find('\n')) != std::string::npos;)
            text.replace(at, 1, "\\n");
        dot += fmt::format("  v{} -> v{} [label={}];\n", boost::source(arc, graph),
                           boost::target(arc, graph), text);
    }
    return dot + "}\n";
}

nlohmann::json to_json(const TransformGraph& spanned, const Catalogue& catalogue,
                       const std::function<nlohmann::json(const Arc&)>& cost) {
    const Graph& graph = spanned.graph;
    nlohmann::json vertices = nlohmann::json::array(), edges = nlohmann::json::array(),
                   refused = nlohmann::json::array();
    for (const auto at : boost::make_iterator_range(boost::vertices(graph)))
        vertices.push_back({{"id", at},
                            {"what", graph[at].what.text()},
                            {"bytes", graph[at].what.bytes()},
                            {"runs", graph[at].what.runs()},
                            {"source", graph[at].source >= 0},
                            {"target", graph[at].target}});
    for (const auto arc : boost::make_iterator_range(boost::edges(graph))) {
        nlohmann::json parameters = nlohmann::json::object();
        for (const auto& [key, value] : graph[arc].offer.with.all())
            std::visit([&, &name = key](const auto& v) { parameters[name] = v; }, value);
        edges.push_back({{"from", boost::source(arc, graph)},
                         {"to", boost::target(arc, graph)},
                         {"transition", catalogue[graph[arc].edge].name},
                         {"parameters", parameters},
                         {"cost", cost ? cost(graph[arc]) : nlohmann::json()}});
    }
    for (const Refusal& refusal : spanned.refused)
        refused.push_back({{"transition", refusal.transition}, {"reason", refusal.reason.text()}});
    return {{"schema", 1}, {"vertices", vertices}, {"edges", edges}, {"refused", refused}};
}

std::string to_dot(const Catalogue& catalogue) {
    std::string dot = kHeader;
    for (const Transition& edge : catalogue)
        for (const auto& [from, to] : edge.joins)
            dot += fmt::format("  {} -> {} [label={}];\n", dot_string(from), dot_string(to),
                               dot_string(edge.name));
    return dot + "}\n";
}

nlohmann::json to_json(const Catalogue& catalogue) {
    nlohmann::json edges = nlohmann::json::array();
    for (const Transition& edge : catalogue)
        for (const auto& [from, to] : edge.joins)
            edges.push_back({{"from", from}, {"to", to}, {"transition", edge.name}});
    return {{"schema", 1}, {"edges", edges}};
}

}  // namespace edgewise
