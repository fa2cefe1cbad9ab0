#include "scene/measured_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <queue>
#include <vector>

#include "graph/errors.hpp"
#include "graph/transform_graph.hpp"
#include "reference/error_tally.hpp"
#include "reference/verify.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

constexpr int kTiles = 6, kTries = 200;
constexpr std::int64_t kSide = 24, kSideOfBox = 12;  // of a tile of pixels, and of samples
constexpr std::int64_t kMargin = 8;  // samples around what a tile sees, for filters' support

/// A tile of one view's output, and the part of the input that it sees.
struct Tile {
    int view = 0;
    Region output = {}, input = {};
};

void include(const Vec3& p, Region& box) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
        box.begin[axis] = std::min(box.begin[axis], cell - kMargin);
        box.end[axis] = std::max(box.end[axis], cell + 2 + kMargin);
    }
}

/// The box around what output samples see, within the input; empty: they see nothing.
Region seen_by(const Request& want, const ViewGeometry& geometry, int view, const Region& output) {
    constexpr std::int64_t kFar = std::int64_t{1} << 40;
    Region box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    bool any = false;
    for (std::int64_t z = output.begin[2]; z < output.end[2]; ++z)
        for (std::int64_t y = output.begin[1]; y < output.end[1]; ++y)
            for (std::int64_t x = output.begin[0]; x < output.end[0]; ++x) {
                if (want.job->of_rays()) {
                    const auto ray = geometry.ray({view, x, y, 0});
                    if (!ray) continue;
                    include(ray->origin + ray->low * ray->direction, box);
                    include(ray->origin + ray->high * ray->direction, box);
                    any = true;
                } else if (const auto p = geometry.point({view, x, y, z})) {
                    include(*p, box);
                    any = true;
                }
            }
    if (!any) return {};
    for (int axis = 0; axis < 3; ++axis) {
        box.begin[axis] = std::clamp<std::int64_t>(box.begin[axis], 0, want.input[axis]);
        box.end[axis] = std::clamp<std::int64_t>(box.end[axis], 0, want.input[axis]);
    }
    return box;
}

/// Tiles that see the input, by the additive recurrence of the generalised golden ratio (Roberts
/// 2018).
std::vector<Tile> draw_tiles(const Request& want, bool whole_input) {
    constexpr std::array<double, 4> kRatio = {0.8566749, 0.7338918, 0.6287067, 0.5385973};
    const ViewGeometry geometry(want);
    const Extent n = want.output();
    const std::int64_t side = n.z > 1 ? kSideOfBox : kSide;
    std::vector<Tile> tiles;
    for (int i = 1; i <= kTries && tiles.size() < kTiles; ++i) {
        const auto drawn = [&](int axis) { return std::fmod(0.5 + kRatio[axis] * i, 1.0); };
        Tile tile{.view = static_cast<int>(drawn(3) * want.frames)};
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t count = (n[axis] + side - 1) / side;
            const auto place = static_cast<std::int64_t>(drawn(axis) * static_cast<double>(count));
            tile.output.begin[axis] = place * side;
            tile.output.end[axis] = std::min(n[axis], (place + 1) * side);
        }
        const bool known = std::any_of(tiles.begin(), tiles.end(), [&](const Tile& other) {
            return other.view == tile.view && other.output == tile.output;
        });
        if (known) continue;
        tile.input = seen_by(want, geometry, tile.view, tile.output);
        if (tile.input.empty()) continue;
        if (whole_input) tile.input = Region::all(want.input);
        tiles.push_back(tile);
    }
    return tiles;
}

Transform shifted_by(const std::array<std::int64_t, 3>& by, double sign) {
    Mat4 map = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) map(axis, 3) = sign * static_cast<double>(by[axis]);
    return map;
}

/// The request for one tile from one part of the input.
Request request_of(const Request& want, const Tile& tile) {
    Request part = want;
    part.input = tile.input.extent();
    part.frames = 1;
    part.views = Placement(shifted_by(tile.output.begin, -1) * want.views.at(tile.view) *
                           shifted_by(tile.input.begin, 1));
    if (const Clip* clip = want.clip(tile.view)) {
        std::vector<HalfSpace> planes = half_spaces_of(*clip);
        for (HalfSpace& plane : planes)
            for (int axis = 0; axis < 3; ++axis)
                plane.offset += plane.normal[axis] * static_cast<double>(tile.input.begin[axis]);
        std::vector<Ball> balls = clip->balls;
        for (Ball& ball : balls)
            for (int axis = 0; axis < 3; ++axis)
                ball.centre[axis] -= static_cast<double>(tile.input.begin[axis]);
        part.clips = {clip_of(part.input, planes, balls)};
    }
    const Extent output = tile.output.extent();
    part.screen = {output.x, output.y, want.job->of_rays() ? want.screen.z : output.z};
    if (part.eye)
        for (int axis = 0; axis < 2; ++axis)
            part.eye->at[axis] -= static_cast<double>(tile.output.begin[axis]);
    part.budget = {};
    part.threads = part.ranks = 1;
    return part;
}

std::shared_ptr<Data> part_of(const Data& input, const Region& box,
                              std::pmr::memory_resource* memory) {
    Representation what = input.what;
    what.extent = box.extent();
    auto part = std::make_shared<Data>(Data::make(what, memory));
    const std::size_t sample = bytes_of(what.type) * static_cast<std::size_t>(what.channels);
    const std::size_t row = sample * static_cast<std::size_t>(what.extent.x);
    const Extent& n = input.what.extent;
    auto* to = part->as<std::byte>();
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y, to += row)
            std::memcpy(to,
                        input.as<std::byte>() +
                            sample * static_cast<std::size_t>((z * n.y + y) * n.x + box.begin[0]),
                        row);
    return part;
}

using Arcs = std::vector<Graph::edge_descriptor>;

/// The fewest edges from a source to a target; empty: there is no way.
Arcs shortest_path(const TransformGraph& spanned) {
    std::map<Graph::vertex_descriptor, Graph::edge_descriptor> by;
    std::queue<Graph::vertex_descriptor> open;
    std::vector<bool> met(boost::num_vertices(spanned.graph));
    for (const auto source : spanned.sources) {
        open.push(source);
        met[source] = true;
    }
    for (; !open.empty(); open.pop()) {
        const auto at = open.front();
        if (spanned.graph[at].target) {
            Arcs path;
            for (auto here = at; by.contains(here);
                 here = boost::source(path.back(), spanned.graph))
                path.push_back(by.at(here));
            std::reverse(path.begin(), path.end());
            return path;
        }
        for (const auto arc : boost::make_iterator_range(boost::out_edges(at, spanned.graph))) {
            const auto next = boost::target(arc, spanned.graph);
            if (met[next]) continue;
            met[next] = true;
            by.emplace(next, arc);
            open.push(next);
        }
    }
    return {};
}

/// Runs one edge whole, region by region.
std::shared_ptr<Data> run_edge(const Transition& edge, const Offer& offer, const Ask& ask,
                               const Data& in, std::pmr::memory_resource* memory) {
    Context context;
    context.memory = memory;
    const Partition parts = edge.parts(offer, ask);
    auto out = std::make_shared<Data>(Data::make(offer.to, memory));
    bool first = true;
    for (const Region& region : regions_of(parts, offer)) {
        if (parts.kind == Partition::input && !first) {
            Data part = Data::make(offer.to, memory);
            edge.run(offer, ask, in, part, region, context);
            parts.merge(*out, part);
        } else {
            edge.run(offer, ask, in, *out, region, context);
        }
        first = false;
    }
    return out;
}

/// What running an edge on one tile gave.
struct Measured {
    double square = 0;   // of the error [value of the edge's output squared]
    double samples = 0;  // that were compared
};

/// A path through an edge, and where there is none, through what else was asked for before it.
Arcs path_through(const Catalogue& catalogue, const Ask& ask, const Representation& input,
                  const Demand& edge, const Demands& asked, TransformGraph& spanned) {
    std::vector<Demand> before;
    for (const Demand& other : asked.via)
        if (other.name != edge.name) before.push_back(other);
    before.push_back(edge);
    for (const std::vector<Demand>& via : {std::vector<Demand>{edge}, before}) {
        spanned = expand(catalogue, ask, {{input}}, {.via = via});
        if (Arcs path = shortest_path(spanned); !path.empty()) return path;
    }
    return {};
}

std::optional<Measured> measure_tile(const Catalogue& catalogue, const Demand& edge,
                                     const Demands& asked, const Data& input,
                                     const Statistics& statistics, const Request& want,
                                     const Phantom* formula, const Scene& scene, const Tile& tile,
                                     std::pmr::memory_resource* memory) {
    const Request part = request_of(want, tile);
    std::shared_ptr<Data> data = part_of(input, tile.input, memory);
    Scene seen = unseen_scene(statistics);
    seen.occupied = Region::all(part.input);
    seen.occupied_fraction = 1;
    seen.facts = scene.facts;
    seen.likely = scene.likely;
    const Ask ask{part, seen};
    TransformGraph spanned;
    const Arcs path = path_through(catalogue, ask, data->what, edge, asked, spanned);
    if (path.empty()) return std::nullopt;
    const ReferenceField field(*data, want.field, formula);
    std::shared_ptr<const Data> made = data;
    double gain = 1;
    bool passed = false;
    for (const auto arc : path) {
        const Arc& step = spanned.graph[arc];
        const Transition& by = catalogue[static_cast<std::size_t>(step.edge)];
        made = run_edge(by, step.offer, ask, *made, memory);
        if (passed) gain *= by.error_of(step.offer, ask).gain;
        passed = passed || edge.name == by.name;
    }
    Verifier verifier(part, field, 0, 1, memory);
    verifier.frame(0, *made);
    const Verified verified = verifier.finish();
    const double rms = verified.nrmse * verified.range;
    if (verified.samples == 0 || !std::isfinite(rms) || !(gain > 0)) return std::nullopt;
    return Measured{std::pow(rms / gain, 2), static_cast<double>(verified.samples)};
}

}  // namespace

void measure_runs(const Catalogue& catalogue, const Demands& asked, const Data& input,
                  const Statistics& statistics, const Request& want, const Phantom* formula,
                  Scene& scene, std::pmr::memory_resource* memory) {
    if (std::all_of(catalogue.begin(), catalogue.end(),
                    [](const Transition& edge) { return bool(edge.error); }))
        return;
    const TransformGraph spanned =
        expand(catalogue, {want, scene}, {{input.what}}, {.via = asked.via});
    std::map<std::string, Demand> edges;  // by fact
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Transition& edge = catalogue[static_cast<std::size_t>(spanned.graph[arc].edge)];
        const Parameters& with = spanned.graph[arc].offer.with;
        if (!edge.error) edges.try_emplace(fact_of_runs(edge, with), Demand{edge.name, with});
    }
    if (edges.empty()) return;
    // A formula is told by the input's indices, of which a part has others.
    const std::vector<Tile> tiles = draw_tiles(want, formula != nullptr);
    for (const auto& [fact, edge] : edges) {
        ErrorTally tally;
        bool any = false;
        for (const Tile& tile : tiles) {
            std::optional<Measured> measured;
            try {
                measured = measure_tile(catalogue, edge, asked, input, statistics, want, formula,
                                        scene, tile, memory);
            } catch (const RequestError&) {  // not of this tile
            } catch (const RunError&) {
            } catch (const std::bad_alloc&) {
            }
            if (!measured) continue;
            tally.add(measured->square, measured->samples);
            tally.close();
            any = true;
        }
        if (!any) continue;
        const ErrorEstimate error = estimate_of(std::array{Stratum{.tally = tally}});
        scene.facts[fact] = error.upper;
        scene.likely[fact] = error.likely;
    }
}

}  // namespace edgewise
