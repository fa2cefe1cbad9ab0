#include "cli/session/graph_picture.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <set>
#include <tuple>

#include "charts/html.hpp"
#include "charts/program.hpp"
#include "charts/scales.hpp"
#include "cli/request/programs.hpp"
#include "cli/session/refusals.hpp"
#include "engine/looked.hpp"
#include "graph/range.hpp"
#include "planner/cost.hpp"

namespace edgewise::cli {
namespace {

using charts::html_text;
using At = Graph::vertex_descriptor;
using Way = Graph::edge_descriptor;

constexpr std::size_t kLineLength = 38;  // characters of a reason

constexpr const char* kHeader =
    "digraph edgewise {\n"
    "  rankdir=LR; ranksep=0.35; nodesep=0.22; bgcolor=\"white\"; fontname=\"Helvetica\";\n"
    "  node [shape=box, style=\"rounded,filled\", fillcolor=\"#f4f4f4\", fontname=\"Helvetica\", "
    "fontsize=11, margin=\"0.16,0.07\"];\n"
    "  edge [fontname=\"Helvetica\", fontsize=9, color=\"#777777\"];\n";

/// Words in lines of kLineLength, each ended by `end`.
std::string wrapped(const std::string& text, const char* end) {
    std::string lines, line;
    std::size_t begin = 0;
    while (begin < text.size()) {
        const std::size_t space = std::min(text.find(' ', begin), text.size());
        const std::string word = text.substr(begin, space - begin);
        if (!line.empty() && line.size() + 1 + word.size() > kLineLength) {
            lines += html_text(line) + end;
            line.clear();
        }
        line += (line.empty() ? "" : " ") + word;
        begin = space + 1;
    }
    return lines + html_text(line) + end;
}

/// "object/scalar/u8/linear/256x256x128": what it is in one line, how it is stored in the next.
std::string vertex_label(const Vertex& vertex) {
    const std::string text = vertex.what.text(), kind = vertex.what.kind();
    const std::string rest = text.starts_with(kind + "/") ? text.substr(kind.size() + 1) : "";
    return fmt::format("<<b>{}</b>{}>", html_text(kind),
                       rest.empty() ? "" : "<br/>" + html_text(rest));
}

/// The arcs of the chosen path.
std::set<std::size_t> arcs_of(const Plan& plan, const TransformGraph& spanned,
                              const Catalogue& catalogue) {
    const Graph& graph = spanned.graph;
    std::set<std::size_t> chosen;
    for (At at : spanned.sources) {
        std::set<std::size_t> arcs;
        for (const Step& step : plan.steps) {
            const auto out = boost::make_iterator_range(boost::out_edges(at, graph));
            const auto next = std::find_if(out.begin(), out.end(), [&](const Way& way) {
                const Offer& offer = graph[way].offer;
                return catalogue[static_cast<std::size_t>(graph[way].edge)].name == step.by->name &&
                       offer.to.key() == step.offer.to.key() &&
                       offer.with.text() == step.offer.with.text() &&
                       offer.from.key() == step.offer.from.key();
            });
            if (next == out.end()) break;
            arcs.insert(graph[*next].index);
            at = boost::target(*next, graph);
        }
        if (arcs.size() == plan.steps.size()) chosen = arcs;
    }
    return chosen;
}

class Drawing {
 public:
    Drawing(const TransformGraph& spanned, const Catalogue& catalogue, const CostWords& cost,
            const Plan* chosen)
        : spanned_(spanned), graph_(spanned.graph), catalogue_(catalogue), cost_(cost) {
        if (chosen) chosen_ = arcs_of(*chosen, spanned, catalogue);
    }

    std::string dot() const {
        std::string dot = kHeader;
        for (const At at : boost::make_iterator_range(boost::vertices(graph_))) dot += vertex(at);
        std::map<std::tuple<At, At, int>, std::vector<Way>> groups;
        for (const Way way : boost::make_iterator_range(boost::edges(graph_)))
            groups[{boost::source(way, graph_), boost::target(way, graph_), graph_[way].edge}]
                .push_back(way);
        for (const auto& [ends, ways] : groups) dot += line(ways);
        return dot + refusals() + "}\n";
    }

 private:
    bool is_chosen(const Way& way) const { return chosen_.contains(graph_[way].index); }

    std::string vertex(At at) const {
        const Vertex& vertex = graph_[at];
        const char* fill = vertex.source >= 0 ? "#cfe3f7" : vertex.target ? "#cdebd0" : "#f4f4f4";
        const bool on_path =
            std::any_of(boost::in_edges(at, graph_).first, boost::in_edges(at, graph_).second,
                        [&](const Way& way) { return is_chosen(way); });
        return fmt::format("  v{} [label={}, fillcolor=\"{}\", penwidth={}];\n", at,
                           vertex_label(vertex), fill,
                           on_path || (vertex.source >= 0 && !chosen_.empty()) ? 2.4 : 1);
    }

    /// One line for all arcs of an edge between two vertices.
    std::string line(const std::vector<Way>& ways) const {
        const bool bold =
            std::any_of(ways.begin(), ways.end(), [&](const Way& way) { return is_chosen(way); });
        const std::string name = catalogue_[static_cast<std::size_t>(graph_[ways[0]].edge)].name;
        std::string rows;
        for (const Way& way : ways) rows += row(way);
        return fmt::format(
            "  v{} -> v{} [penwidth={}, color=\"{}\", label=<<table border=\"0\" "
            "cellborder=\"0\" cellspacing=\"0\" cellpadding=\"2\"><tr><td align=\"left\" "
            "colspan=\"4\"><b>{}</b></td></tr>{}</table>>];\n",
            boost::source(ways[0], graph_), boost::target(ways[0], graph_), bold ? 3.2 : 0.9,
            bold ? "#000000" : "#888888", html_text(name), rows);
    }

    std::string row(const Way& way) const {
        const bool bold = is_chosen(way);
        std::string text = graph_[way].offer.with.text();
        if (text.starts_with("/")) text.erase(0, 1);
        std::replace(text.begin(), text.end(), '/', ' ');
        const auto cell = [&](const std::string& words, const char* align) {
            // Graphviz takes no empty text.
            const std::string plain = words.empty() ? "&#160;" : html_text(words);
            const std::string safe = bold ? "<b>" + plain + "</b>" : plain;
            return fmt::format("<td align=\"{}\">{}</td>", align, safe);
        };
        std::string cells = cell(text, "left");
        for (const std::string& words : cost_(graph_[way])) cells += cell(words, "right");
        return "<tr>" + cells + "</tr>";
    }

    /// Beside the graph and without lines: what was refused is no part of it.
    std::string refusals() const {
        const Refusals refused = folded(spanned_.refused, catalogue_);
        std::string reasons;
        constexpr std::size_t kNames = 3;
        for (const auto& [reason, names] : refused.reasons)
            reasons +=
                fmt::format("<b>{}</b><br align=\"left\"/>{}", html_text(few_of(names, kNames)),
                            wrapped(reason, "<br align=\"left\"/>"));
        return box("refused", count_text(refused), reasons);
    }

    static std::string box(const char* id, const std::string& label, const std::string& lines) {
        if (lines.empty()) return {};
        return fmt::format(
            "  subgraph cluster_{0} {{ label=\"{0}: {1}\"; fontsize=10; color=\"#bbbbbb\"; "
            "style=dashed;\n"
            "    {0} [shape=plaintext, style=\"\", fontsize=9, label=<{2}>]; }}\n",
            id, label, lines);
    }

    const TransformGraph& spanned_;
    const Graph& graph_;
    const Catalogue& catalogue_;
    const CostWords& cost_;
    std::set<std::size_t> chosen_;
};

}  // namespace

std::string picture_dot(const TransformGraph& spanned, const Catalogue& catalogue,
                        const CostWords& cost, const Plan* chosen) {
    return Drawing(spanned, catalogue, cost, chosen).dot();
}

CostWords cost_words(const Looked& looked) {
    return [&](const Arc& arc) -> std::vector<std::string> {
        const StepCost c =
            cost_of(looked.engine.edges()[static_cast<std::size_t>(arc.edge)], arc.offer,
                    looked.ask(), looked.engine.machine(), looked.want.threads);
        // Of a result over what counts as an error of 1 there; of samples over their range.
        const bool ends = is_target(arc.offer.to, looked.want);
        const double range =
            ends ? looked.scene.range : range_between(looked.scene.low, looked.scene.high);
        const double error = std::hypot(c.error.bias, c.error.noise) / range;
        return {charts::seconds_text(c.seconds),
                c.error.known ? fmt::format("NRMSE + {:.2g}", error) : "NRMSE unknown"};
    };
}

std::string laid_out(const std::string& dot) {
    return charts::output_of({installed_program("dot", "graphviz"), "-Tsvg"}, dot);
}

}  // namespace edgewise::cli
