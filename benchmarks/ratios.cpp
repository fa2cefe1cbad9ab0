// How the errors of fast paths compare with the plain path's: of random views of a file, the
// logarithm of the ratio of both on the same draws, its standard error (jackknife), and the view.
// Rows of CSV, one a view and path:
//   file, view, mode, path, log ratio, standard error, plain error [share of the samples' range],
//   RMS of rounding to 8 bits [likewise], ray direction [sample/t] (3), pixel's step along x (3)
//   and y (3) [sample], width, height
// and the samples in f32, for whoever works out facts of them.
//
//     build/release/bin/ratios_benchmark FILE VIEWS SEED [OUT.raw]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "measure/quantiles.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "planner/planner.hpp"
#include "planner/priced_graph.hpp"
#include "planner/search.hpp"
#include "reference/view_geometry.hpp"
#include "scene/preview.hpp"
#include "scene/scene.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"

using namespace edgewise;

namespace {

constexpr double kDraws = 4;  // times the usual ones
constexpr std::size_t kGroups = 8, kRoutes = 4096;

struct DrawnView {
    Query query;
    std::string mode;
};

DrawnView drawn_query(const char* file, std::mt19937& bits) {
    const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(bits); };
    const auto turn = [&] { return std::to_string(360 * unit()); };
    const char* const modes[] = {"mip", "mip", "mip", "xray", "composite"};
    std::vector<Given> given;
    const std::string mode = modes[bits() % std::size(modes)];
    given.push_back({"rotate", turn() + "," + turn() + "," + turn()});
    if (unit() < 0.5) given.push_back({"zoom", std::exp((2 * unit() - 1) * std::numbers::ln2)});
    given.push_back({"mode", mode});
    given.push_back({"size", std::floor(128 * std::exp(unit() * 2 * std::numbers::ln2))});
    Query query = query_of(Job::render, given);
    query.input = file;
    return {query, mode};
}

/// Without steps that only move or cut what is there; empty: not one of those that are compared.
std::string rival_of(const std::vector<std::string>& texts) {
    static const std::set<std::string> rivals = {
        "project.shear_warp/filter=foh",
        "store.precision/type=u8 > project.shear_warp/filter=foh",
        "store.precision/type=u8 > project.ray_cast/filter=foh/step=1",
        "store.precision/type=u8 > project.ray_cast/filter=foh/step=0.5",
        "store.precision/type=u8 > project.sorted_bricks > project.sorted_mip/filter=foh/step=1",
        "project.ray_cast/filter=foh/step=2",
        "project.splat",
        "project.adaptive_cast/filter=foh/step=1/tolerance=0.0003",
        "spectrum.forward/padding=1.25/width=4 > spectrum.slice/band=volume > spectrum.inverse",
        "spectrum.forward/padding=1.25/width=6 > spectrum.slice/band=volume > spectrum.inverse",
        "shade.runs > project.shear_warp_runs/filter=foh",
    };
    std::string name;
    for (const std::string& text : texts) {
        if (text.starts_with("warp.axis_permutation") || text == "store.crop") continue;
        name += (name.empty() ? "" : " > ") + text;
    }
    return rivals.contains(name) ? name : "";
}

class Ratios {
 public:
    explicit Ratios(const Planned& planned)
        : planned_(planned), graph_(planned.graph()), sources_(planned.sources()) {
        for (const Route& route : simple_routes(graph_->choice(), kRoutes)) {
            std::vector<std::string> texts;
            for (const auto arc : route.arcs) {
                const Arc& what = graph_->spanned().graph[arc];
                texts.push_back(planned_.engine.edges()[static_cast<std::size_t>(what.edge)].name +
                                what.offer.with.text());
            }
            const std::string name = rival_of(texts);
            if (name.empty() || plans_.contains(name)) continue;
            plans_.emplace(name, plan_of(route, graph_->real(), planned_.engine.edges(),
                                         {planned_.want, planned_.guessed}, planned_.plan_options));
        }
    }

    void print(const char* file, int view, const std::string& mode) {
        const Preview preview = draw();
        const auto all = errors_of(preview.likely);
        if (!all.contains("")) return;
        std::vector<std::map<std::string, double>> parts;
        for (const auto& facts : preview.without) parts.push_back(errors_of(facts));
        const double range = planned_.statistics.high - planned_.statistics.low;
        for (const auto& [name, error] : all) {
            if (name.empty()) continue;
            const double ratio = std::log(std::max(error, 1e-300) / std::max(all.at(""), 1e-300));
            std::printf("%s,%d,%s,%s,%.5f,%.5f,%.6g,%.6g", file, view, mode.c_str(), name.c_str(),
                        ratio, spread_of(parts, name), all.at("") / range,
                        1 / 255.0 / std::sqrt(12));
            print_view();
        }
    }

 private:
    Preview draw() {
        Scene scene = planned_.guessed;
        std::set<std::string> wanted;
        scene.supposed = 1;
        scene.asked = &wanted;
        const Ask ask{planned_.want, scene};
        plain_way(planned_.engine.edges(), ask, sources_, *planned_.want.budget.like);
        for (const auto& [name, plan] : plans_) likely_error(plan, ask, sources_);
        const Demands none;
        return preview_facts(planned_.engine.edges(), *planned_.input.data, planned_.statistics,
                             planned_.want,
                             planned_.input.phantom ? &*planned_.input.phantom : nullptr,
                             {.asked = none,
                              .times = kDraws,
                              .wanted = &wanted,
                              .spanned = &graph_->spanned(),
                              .groups = kGroups},
                             planned_.memory.get());
    }

    /// By path [value]; the plain one's has no name.
    std::map<std::string, double> errors_of(const std::map<std::string, double>& facts) const {
        Scene scene = planned_.guessed;
        for (const auto& [name, value] : facts) scene.facts[name] = value;
        const Ask ask{planned_.want, scene};
        std::map<std::string, double> errors;
        if (const auto plain =
                plain_way(planned_.engine.edges(), ask, sources_, *planned_.want.budget.like))
            errors[""] = plain->likely;
        for (const auto& [name, plan] : plans_)
            if (const auto error = likely_error(plan, ask, sources_))
                errors[name] = *error * scene.range;
        return errors;
    }

    static double spread_of(const std::vector<std::map<std::string, double>>& parts,
                            const std::string& name) {
        std::vector<double> ratios;
        for (const auto& part : parts)
            if (part.contains("") && part.contains(name))
                ratios.push_back(
                    std::log(std::max(part.at(name), 1e-300) / std::max(part.at(""), 1e-300)));
        return jackknife_error(ratios);
    }

    void print_view() const {
        const ViewGeometry geometry(planned_.want);
        const double x = static_cast<double>(planned_.want.screen.x / 2);
        const double y = static_cast<double>(planned_.want.screen.y / 2);
        const auto a = geometry.ray(0, x, y), b = geometry.ray(0, x + 1, y),
                   c = geometry.ray(0, x, y + 1);
        const auto put = [](const Vec3& v) { std::printf(",%.6g,%.6g,%.6g", v[0], v[1], v[2]); };
        const Vec3 none = Vec3::Zero();
        put(a ? a->direction : none);
        put(a && b ? Vec3(b->origin - a->origin) : none);
        put(a && c ? Vec3(c->origin - a->origin) : none);
        std::printf(",%d,%d\n", static_cast<int>(planned_.want.screen.x),
                    static_cast<int>(planned_.want.screen.y));
    }

    const Planned& planned_;
    std::shared_ptr<const PricedGraph> graph_;
    const std::vector<Source> sources_;
    std::map<std::string, Plan> plans_;
};

/// Samples in f32, x fastest, behind a line with their extent.
void dump(const Data& data, const char* out) {
    const kernels::Grid grid = kernels::grid_of(data);
    const auto load = kernels::scalar_load(grid.type);
    std::vector<float> values(static_cast<std::size_t>(grid.extent.samples()));
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<float>(
            grid.values.slope *
                static_cast<double>(load(grid.samples, static_cast<std::int64_t>(i))) +
            grid.values.offset);
    std::ofstream to(out, std::ios::binary);
    to << grid.extent.x << ' ' << grid.extent.y << ' ' << grid.extent.z << ' '
       << bytes_of(grid.type) << '\n';
    to.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(float)));
}

}  // namespace

int main(int count, char** words) {
    if (count < 4) {
        std::fprintf(stderr, "usage: ratios_benchmark FILE VIEWS SEED [OUT.raw]\n");
        return 2;
    }
    std::mt19937 bits(static_cast<unsigned>(std::atoi(words[3])));
    const Engine engine(catalogue(), default_profile(catalogue()));
    for (int view = 0; view < std::atoi(words[2]); ++view) {
        const DrawnView drawn = drawn_query(words[1], bits);
        const Prepared plan =
            prepare(engine, drawn.query, nullptr, {.errors = ErrorsWanted::never, .front = false});
        if (view == 0 && count > 4) dump(*plan.planned().input.data, words[4]);
        if (!plan.planned().want.budget.like) continue;
        Ratios(plan.planned()).print(words[1], view, drawn.mode);
        std::fflush(stdout);
    }
}
