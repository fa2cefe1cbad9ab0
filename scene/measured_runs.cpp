#include "scene/measured_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <map>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "graph/errors.hpp"
#include "graph/transform_graph.hpp"
#include "reference/error_tally.hpp"
#include "reference/verify.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

constexpr int kBoxes = 6, kPictures = 4, kTries = 200;
constexpr std::int64_t kSideOfBox = 12;        // of a tile of a warp
constexpr std::int64_t kMargin = 8;            // samples around what it sees, for filters' support
constexpr std::int64_t kMostPixels = 1 << 22;  // that are made, of all tiles of pictures
// That are compared, of all tiles of pictures; and where few of them carry the error: at outlines a
// pixel jumps from one answer to another. The Verifier then takes all of a small picture.
constexpr std::int64_t kRays = 512, kJumpingRays = 2048;

/// A part of one view's output, and the part of the input that it is made from.
struct Tile {
    int view = 0;
    Region output = {}, input = {};
    double weight = 0;  // output samples of it that see the input, about
};

void include(const Vec3& p, Region& box) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
        box.begin[axis] = std::min(box.begin[axis], cell - kMargin);
        box.end[axis] = std::max(box.end[axis], cell + 2 + kMargin);
    }
}

/// The box around what a warp's output samples see, within the input; empty: they see nothing.
Region seen_by(const Request& want, const ViewGeometry& geometry, int view, const Region& output) {
    constexpr std::int64_t kFar = std::int64_t{1} << 40;
    Region box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    bool any = false;
    for (std::int64_t z = output.begin[2]; z < output.end[2]; ++z)
        for (std::int64_t y = output.begin[1]; y < output.end[1]; ++y)
            for (std::int64_t x = output.begin[0]; x < output.end[0]; ++x)
                if (const auto p = geometry.point({view, x, y, z})) {
                    include(*p, box);
                    any = true;
                }
    if (!any) return {};
    for (int axis = 0; axis < 3; ++axis) {
        box.begin[axis] = std::clamp<std::int64_t>(box.begin[axis], 0, want.input[axis]);
        box.end[axis] = std::clamp<std::int64_t>(box.end[axis], 0, want.input[axis]);
    }
    return box;
}

/// How many pixels of a tile have rays that meet the input, from a lattice of them.
double pixels_seeing(const ViewGeometry& geometry, int view, const Region& output) {
    constexpr std::int64_t kSide = 32;
    const Extent n = output.extent();
    const std::int64_t across = std::min(n.x, kSide), down = std::min(n.y, kSide);
    std::int64_t seeing = 0;
    for (std::int64_t j = 0; j < down; ++j)
        for (std::int64_t i = 0; i < across; ++i)
            seeing += geometry
                          .ray({view, output.begin[0] + (2 * i + 1) * n.x / (2 * across),
                                output.begin[1] + (2 * j + 1) * n.y / (2 * down), 0})
                          .has_value();
    return static_cast<double>(seeing * n.samples()) / static_cast<double>(across * down);
}

/// What runs are measured on.
struct Tiles {
    std::vector<Tile> drawn = {};
    bool are_all = false;  // they hold all of the output
};

/// Which tiles there are, of sides `side`, in each view.
class Tiling {
 public:
    Tiling(const Request& want, const std::array<std::int64_t, 3>& side)
        : n_(want.output()), side_(side), frames_(want.frames) {}

    std::int64_t count(int axis) const { return (n_[axis] + side_[axis] - 1) / side_[axis]; }
    std::int64_t count() const { return count(0) * count(1) * count(2) * frames_; }
    /// @param at  along x, y, z and views, of each 0 to 1
    Tile tile(const std::array<double, 4>& at) const {
        Tile tile{.view = static_cast<int>(at[3] * frames_)};
        for (int axis = 0; axis < 3; ++axis) {
            const auto place = static_cast<std::int64_t>(at[static_cast<std::size_t>(axis)] *
                                                         static_cast<double>(count(axis)));
            tile.output.begin[axis] = place * side_[axis];
            tile.output.end[axis] = std::min(n_[axis], (place + 1) * side_[axis]);
        }
        return tile;
    }
    Tile tile(std::int64_t place) const {
        std::array<double, 4> at{};
        for (int axis = 0; axis < 3; place /= count(axis), ++axis)
            at[static_cast<std::size_t>(axis)] =
                (static_cast<double>(place % count(axis)) + 0.5) / static_cast<double>(count(axis));
        at[3] = (static_cast<double>(place) + 0.5) / frames_;
        return tile(at);
    }

 private:
    Extent n_;
    std::array<std::int64_t, 3> side_;
    int frames_;
};

/// All tiles, where these are few; else some, by the additive recurrence of the generalised golden
/// ratio (Roberts 2018).
/// @param sees  completes a tile; false: it does not see the input
template <class Sees>
Tiles drawn_of(const Tiling& all, std::size_t most, const Sees& sees) {
    constexpr std::array<double, 4> kRatio = {0.8566749, 0.7338918, 0.6287067, 0.5385973};
    Tiles tiles{.are_all = all.count() <= static_cast<std::int64_t>(most)};
    const auto take = [&](Tile tile) {
        const bool known =
            std::any_of(tiles.drawn.begin(), tiles.drawn.end(), [&](const Tile& other) {
                return other.view == tile.view && other.output == tile.output;
            });
        if (!known && sees(tile)) tiles.drawn.push_back(tile);
    };
    if (tiles.are_all) {
        for (std::int64_t place = 0; place < all.count(); ++place) take(all.tile(place));
        return tiles;
    }
    for (int i = 1; i <= kTries && tiles.drawn.size() < most; ++i) {
        std::array<double, 4> at{};
        for (std::size_t axis = 0; axis < at.size(); ++axis)
            at[axis] = std::fmod(0.5 + kRatio[axis] * i, 1.0);
        take(all.tile(at));
    }
    return tiles;
}

/// Pictures are made whole where they are not too large: views where these are many, parts of a
/// view where it is very large. An edge may well do another thing on a part of the input, where
/// slices begin elsewhere and empty bricks are others, so that each part is made from all of it.
Tiles tiles_of_pictures(const Request& want) {
    const ViewGeometry geometry(want);
    const Extent n = want.output();
    const bool few = n.x * n.y <= kMostPixels / std::min(want.frames, kPictures);
    const auto part = static_cast<std::int64_t>(std::sqrt(kMostPixels / kPictures));
    const Tiling all(want, {few ? n.x : part, few ? n.y : part, 1});
    return drawn_of(all, kPictures, [&](Tile& tile) {
        tile.input = Region::all(want.input);
        tile.weight = pixels_seeing(geometry, tile.view, tile.output);
        return tile.weight > 0;
    });
}

/// Boxes of a warp, each made from the part of the input that it sees.
Tiles tiles_of_warp(const Request& want, bool whole_input) {
    const ViewGeometry geometry(want);
    const std::int64_t side = want.output().z > 1 ? kSideOfBox : 2 * kSideOfBox;
    return drawn_of(Tiling(want, {side, side, side}), kBoxes, [&](Tile& tile) {
        tile.input = seen_by(want, geometry, tile.view, tile.output);
        if (tile.input.empty()) return false;
        if (whole_input) tile.input = Region::all(want.input);
        tile.weight = static_cast<double>(tile.output.extent().samples());
        return true;
    });
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

/// The samples of a box; of all of the input itself, which must stay alive.
std::shared_ptr<const Data> part_of(const Data& input, const Region& box,
                                    std::pmr::memory_resource* memory) {
    if (box == Region::all(input.what.extent)) return {std::shared_ptr<const Data>(), &input};
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

/// From each vertex that some are reached from, or that reaches them, the next edge towards them.
class Nearest {
 public:
    enum class Way { from, to };

    Nearest(const TransformGraph& spanned, const std::vector<Graph::vertex_descriptor>& ends,
            Way way)
        : graph_(spanned.graph), way_(way), met_(boost::num_vertices(graph_)) {
        std::queue<Graph::vertex_descriptor> open;
        for (const auto end : ends) {
            open.push(end);
            met_[end] = true;
        }
        for (; !open.empty(); open.pop()) {
            const auto visit = [&](const Graph::edge_descriptor& arc) {
                const auto next =
                    way == Way::from ? boost::target(arc, graph_) : boost::source(arc, graph_);
                if (met_[next]) return;
                met_[next] = true;
                by_.emplace(next, arc);
                open.push(next);
            };
            if (way == Way::from)
                for (const auto arc :
                     boost::make_iterator_range(boost::out_edges(open.front(), graph_)))
                    visit(arc);
            else
                for (const auto arc :
                     boost::make_iterator_range(boost::in_edges(open.front(), graph_)))
                    visit(arc);
        }
    }

    bool meets(Graph::vertex_descriptor at) const { return met_[at]; }
    /// The fewest edges between a vertex and an end, in their order.
    Arcs path(Graph::vertex_descriptor at) const {
        Arcs path;
        while (by_.contains(at)) {
            path.push_back(by_.at(at));
            at = way_ == Way::from ? boost::source(path.back(), graph_)
                                   : boost::target(path.back(), graph_);
        }
        if (way_ == Way::from) std::reverse(path.begin(), path.end());
        return path;
    }

 private:
    const Graph& graph_;
    Way way_;
    std::vector<bool> met_;
    std::map<Graph::vertex_descriptor, Graph::edge_descriptor> by_;
};

/// The shortest path through an edge, and one for each other extent that the edge is given by edges
/// that copy samples: where the input was cropped, slices begin elsewhere.
std::vector<Arcs> shortest_paths(const TransformGraph& spanned, const Catalogue& catalogue,
                                 const Ask& ask, const Demand& edge) {
    const Nearest from(spanned, spanned.sources, Nearest::Way::from);
    const Nearest to(spanned, spanned.targets, Nearest::Way::to);
    const auto copies = [&](const Graph::edge_descriptor& arc) {
        const Arc& step = spanned.graph[arc];
        return catalogue[static_cast<std::size_t>(step.edge)].error_of(step.offer, ask).copies;
    };
    Arcs shortest;
    std::map<std::array<std::int64_t, 3>, Arcs> paths;
    const auto keep = [](Arcs& known, const Arcs& path) {
        if (known.empty() || path.size() < known.size()) known = path;
    };
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Arc& step = spanned.graph[arc];
        const auto before = boost::source(arc, spanned.graph),
                   behind = boost::target(arc, spanned.graph);
        if (!edge.fits(catalogue[static_cast<std::size_t>(step.edge)], step.offer.with) ||
            !from.meets(before) || !to.meets(behind))
            continue;
        Arcs path = from.path(before);
        const bool copied = std::all_of(path.begin(), path.end(), copies);
        path.push_back(arc);
        const Arcs rest = to.path(behind);
        path.insert(path.end(), rest.begin(), rest.end());
        const Extent& n = step.offer.from.extent;
        keep(shortest, path);
        if (copied) keep(paths[{n.x, n.y, n.z}], path);
    }
    if (paths.empty() && !shortest.empty()) return {shortest};
    std::vector<Arcs> all;
    for (auto& [extent, path] : paths) all.push_back(std::move(path));
    return all;
}

/// Runs one edge whole, region by region.
std::shared_ptr<Data> run_edge(const Transition& edge, const Offer& offer, const Ask& ask,
                               const Data& in, std::pmr::memory_resource* memory) {
    Context context;
    context.memory = memory;
    const Partition parts = edge.parts(offer, ask);
    auto out = std::make_shared<Data>(edge.attaches ? Data::sharing(in, offer.to)
                                                    : Data::make(offer.to, memory));
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
    double weight = 0;
    double square = 0, variance = 0;  // of the error, and of this estimate of it
    double range = 0;                 // that counts as an error of 1 there [value]
};

/// A tile, and the reference of it, which all edges are held against.
class MeasuredTile {
 public:
    /// @param compared  so many output samples; 0: all
    MeasuredTile(const Data& input, const Request& want, const Phantom* formula, const Tile& tile,
                 std::int64_t compared, std::pmr::memory_resource* memory)
        : weight_(tile.weight),
          part_(request_of(want, tile)),
          data_(part_of(input, tile.input, memory)),
          field_(*data_, want.field, formula),
          compared_(compared),
          memory_(memory) {}

    const Request& want() const { return part_; }
    const Data& data() const { return *data_; }

    /// @param path  with the edge, of which the result has `gain` times the error
    std::optional<Measured> measure(const Data& result, double gain) {
        // Of another seed than that of --verify, so that this is not the same draw again.
        constexpr std::uint64_t kSeed = 0x5eed;
        if (!verifier_) verifier_.emplace(part_, field_, compared_, kSeed, memory_);
        Verified verified;
        try {
            verifier_->frame(0, result);
            verified = verifier_->finish();
        } catch (...) {
            verifier_.reset();
            throw;
        }
        if (verified.samples == 0 || !std::isfinite(verified.nrmse) || !(gain > 0))
            return std::nullopt;
        const double square = std::pow(verified.nrmse, 2), scale = verified.range / gain;
        // The upper end lies so many standard errors above, or more where the tail is heavy.
        constexpr double kOf95Percent = 1.959964;
        const double error = (std::pow(verified.high, 2) - square) / kOf95Percent;
        return Measured{weight_, square * scale * scale, std::pow(error * scale * scale, 2),
                        verified.range};
    }

 private:
    double weight_;
    Request part_;
    std::shared_ptr<const Data> data_;
    ReferenceField field_;
    std::int64_t compared_;
    std::pmr::memory_resource* memory_;
    std::optional<Verifier> verifier_;
};

/// Paths through an edge, and where there is none, through what else was asked for before it.
std::vector<Arcs> paths_through(const Catalogue& catalogue, const Ask& ask,
                                const Representation& input, const Demand& edge,
                                const Demands& asked, TransformGraph& spanned) {
    std::vector<Demand> before;
    for (const Demand& other : asked.via)
        if (other.name != edge.name) before.push_back(other);
    before.push_back(edge);
    for (const std::vector<Demand>& via : {std::vector<Demand>{edge}, before}) {
        spanned = expand(catalogue, ask, {{input}}, {.via = via});
        std::vector<Arcs> paths = shortest_paths(spanned, catalogue, ask, edge);
        if (!paths.empty()) return paths;
    }
    return {};
}

/// Whether a path has room in the memory that a request may take. Where it has none, it is not
/// taken either.
bool has_room(const Catalogue& catalogue, const Ask& ask, const Data& data, const Arcs& path,
              const TransformGraph& spanned, const std::optional<double>& most) {
    if (!most) return true;
    double bytes = data.what.bytes();
    for (const auto arc : path) {
        const Arc& step = spanned.graph[arc];
        const Transition& by = catalogue[static_cast<std::size_t>(step.edge)];
        bytes += step.offer.to.own_bytes() + by.work(step.offer, ask, 0).workspace;
    }
    return bytes <= *most;
}

/// What the first steps of paths make once for all views, a spectrum for one: tiles of pictures
/// share it, as the views of the request do.
class MadeOnce {
 public:
    MadeOnce(const Ask& whole, const Data& input, std::pmr::memory_resource* memory)
        : whole_(whole), input_(input), memory_(memory) {}

    struct Start {
        std::shared_ptr<const Data> data;
        std::size_t steps = 0;  // that made it
    };
    Start start(const Catalogue& catalogue, const Arcs& path, const TransformGraph& spanned) {
        std::vector<Offer> offers;
        std::string key;
        Representation from = input_.what;
        for (const auto arc : path) {
            const Arc& step = spanned.graph[arc];
            Offer offer = edge_of(catalogue, step).offer(from, whole_, step.offer.with);
            // What a tile's own request would make of the step is another thing.
            if (!offer.refused.empty() || offer.to.placed.one_a_view() ||
                offer.to.key() != step.offer.to.key())
                break;
            key += fmt::format("{} {} {}\n", step.edge, step.offer.with.text(), offer.to.key());
            from = offer.to;
            offers.push_back(std::move(offer));
        }
        std::shared_ptr<const Data>& made = made_[key];
        if (!made) {
            std::shared_ptr<const Data> data(std::shared_ptr<const Data>(), &input_);
            for (std::size_t i = 0; i < offers.size(); ++i)
                data = run_edge(edge_of(catalogue, spanned.graph[path[i]]), offers[i], whole_,
                                *data, memory_);
            made = std::move(data);
        }
        return {made, offers.size()};
    }

 private:
    static const Transition& edge_of(const Catalogue& catalogue, const Arc& step) {
        return catalogue[static_cast<std::size_t>(step.edge)];
    }

    Ask whole_;
    const Data& input_;
    std::pmr::memory_resource* memory_;
    std::map<std::string, std::shared_ptr<const Data>> made_;
};

/// A path that was run on a tile.
struct Ran {
    std::shared_ptr<const Data> made;
    double gain = 1;  // by which the edges behind the measured one scale its error
};

/// @param once  null: nothing is shared
Ran run_path(const MeasuredTile& tile, const Catalogue& catalogue, const Ask& ask,
             const std::string& name, const Arcs& path, const TransformGraph& spanned,
             MadeOnce* once, std::pmr::memory_resource* memory) {
    MadeOnce::Start start{{std::shared_ptr<const Data>(), &tile.data()}};
    if (once) start = once->start(catalogue, path, spanned);
    Ran ran{start.data};
    bool passed = false;
    for (std::size_t i = 0; i < path.size(); ++i) {
        const Arc& step = spanned.graph[path[i]];
        const Transition& by = catalogue[static_cast<std::size_t>(step.edge)];
        if (i >= start.steps) ran.made = run_edge(by, step.offer, ask, *ran.made, memory);
        if (passed) ran.gain *= by.error_of(step.offer, ask).gain;
        passed = passed || name == by.name;
    }
    return ran;
}

/// A path with a step before an edge that rounds or blurs what the edge reads.
struct Disturbed {
    Arcs path;
    double size = 0;  // RMS of that step's error [value of the edge's input]
};

/// One for each edge that may come before `edge` and adds an error of its own: by the parameters
/// that add most.
/// @param clean  a path that none of the edges on it is looked for
std::vector<Disturbed> disturbed_paths(const TransformGraph& spanned, const Catalogue& catalogue,
                                       const Ask& ask, const Demand& edge, const Arcs& clean) {
    const auto by_of = [&](const Graph::edge_descriptor& arc) -> const Transition& {
        return catalogue[static_cast<std::size_t>(spanned.graph[arc].edge)];
    };
    const auto size_of = [&](const Graph::edge_descriptor& arc) {
        const Error error = by_of(arc).error_of(spanned.graph[arc].offer, ask);
        return error.known && !error.copies ? std::hypot(error.bias, error.noise) : 0.0;
    };
    std::map<Graph::vertex_descriptor, Graph::edge_descriptor> measured;  // by input
    std::vector<Graph::vertex_descriptor> read;
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph)))
        if (edge.fits(by_of(arc), spanned.graph[arc].offer.with) &&
            measured.emplace(boost::source(arc, spanned.graph), arc).second)
            read.push_back(boost::source(arc, spanned.graph));
    const Nearest from(spanned, spanned.sources, Nearest::Way::from);
    const Nearest to_edge(spanned, read, Nearest::Way::to);
    const Nearest to(spanned, spanned.targets, Nearest::Way::to);
    std::map<std::string, Disturbed> largest;
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Transition& by = by_of(arc);
        const auto is_it = [&](const Graph::edge_descriptor& other) {
            return by_of(other).name == by.name;
        };
        if (by.name == edge.name || std::any_of(clean.begin(), clean.end(), is_it)) continue;
        const auto before = boost::source(arc, spanned.graph),
                   behind = boost::target(arc, spanned.graph);
        if (!from.meets(before) || !to_edge.meets(behind)) continue;
        const double size = size_of(arc);
        if (!(size > largest[by.name].size) || !std::isfinite(size)) continue;
        Arcs path = from.path(before);
        path.push_back(arc);
        const Arcs between = to_edge.path(behind);
        path.insert(path.end(), between.begin(), between.end());
        const auto reads = between.empty() ? behind : boost::target(between.back(), spanned.graph);
        path.push_back(measured.at(reads));
        const Arcs rest = to.path(boost::target(path.back(), spanned.graph));
        path.insert(path.end(), rest.begin(), rest.end());
        largest[by.name] = {std::move(path), size};
    }
    std::vector<Disturbed> all;
    for (auto& [name, disturbed] : largest)
        if (disturbed.size > 0) all.push_back(std::move(disturbed));
    return all;
}

/// RMS of the difference of two results of one representation, of values that both have.
double difference_of(const Data& a, const Data& b) {
    if (a.what.key() != b.what.key() || a.what.type != Type::f32) return 0;
    const std::int64_t count = a.what.samples() * a.what.channels;
    double squares = 0;
    std::int64_t both = 0;
    for (std::int64_t i = 0; i < count; ++i) {
        const double difference =
            static_cast<double>(a.as<float>()[i]) - static_cast<double>(b.as<float>()[i]);
        if (!std::isfinite(difference)) continue;
        squares += difference * difference;
        ++both;
    }
    return both ? std::sqrt(squares / static_cast<double>(both)) : 0;
}

/// The result of running an edge on one tile, and its gain of errors of the input.
struct OnTile {
    Measured error;
    std::optional<double> gain = {};  // absent: no edge before it adds an error, or none was run
};

/// Of the paths through an edge the one that errs most. The gain is that of the edge before it that
/// disturbs its result most, over that one's own error.
/// @param with_gain  runs the edge once more for each edge that may come before it
std::optional<OnTile> measure_on(MeasuredTile& tile, const Catalogue& catalogue, const Demand& edge,
                                 const Demands& asked, const Scene& seen,
                                 const std::optional<double>& most_bytes, bool with_gain,
                                 MadeOnce* once, std::pmr::memory_resource* memory) {
    const Ask ask{tile.want(), seen};
    TransformGraph spanned;
    std::optional<OnTile> worst;
    Arcs clean;
    Ran undisturbed;
    const auto run = [&](const Arcs& path) {
        return run_path(tile, catalogue, ask, edge.name, path, spanned, once, memory);
    };
    for (const Arcs& path : paths_through(catalogue, ask, tile.data().what, edge, asked, spanned)) {
        if (!has_room(catalogue, ask, tile.data(), path, spanned, most_bytes)) continue;
        const Ran ran = run(path);
        const auto measured = tile.measure(*ran.made, ran.gain);
        if (!measured || (worst && measured->square <= worst->error.square)) continue;
        worst = OnTile{*measured};
        clean = path;
        undisturbed = ran;
    }
    if (!worst || !with_gain) return worst;
    for (const Disturbed& other : disturbed_paths(spanned, catalogue, ask, edge, clean)) {
        if (!has_room(catalogue, ask, tile.data(), other.path, spanned, most_bytes)) continue;
        const Ran ran = run(other.path);
        const double change = difference_of(*ran.made, *undisturbed.made) / undisturbed.gain;
        // Jumps of both meet in the same pixels: squares may add up to more than their sum.
        double added = 0;
        if (tile.want().job->of_rays() && tile.want().mode->threshold)
            if (const auto both = tile.measure(*ran.made, ran.gain))
                added = both->square - worst->error.square;
        const double gain = std::sqrt(std::max(change * change, added)) / other.size;
        if (std::isfinite(gain)) worst->gain = std::max(worst->gain.value_or(0), gain);
    }
    return worst;
}

/// What edges know of a tile before they run.
Scene scene_of(const Scene& scene, const Statistics& statistics, const Tile& tile,
               const Extent& input) {
    if (tile.input == Region::all(input)) return scene;
    Scene seen = unseen_scene(statistics);
    seen.occupied = Region::all(tile.input.extent());
    seen.occupied_fraction = 1;
    seen.facts = scene.facts;
    seen.likely = scene.likely;
    return seen;
}

/// An RMS error as a promise: raised by standard errors, as ErrorTally says.
///
/// Tiles of a few views, or of one, are all there are: each is a stratum with the standard error of
/// its own draw. The Verifier stratifies that: what lies around the largest and smallest results is
/// drawn in any case, half of the rest in proportion to how far off a cheap guess finds the result.
/// So pixels at outlines, where intermediate images change from missing to meeting, are met as
/// often as they matter. Where more tiles exist than were drawn, these are clusters, and what they
/// differ by counts.
ErrorEstimate estimate_on(const std::vector<Measured>& tiles, bool are_all) {
    if (!are_all) {
        ErrorTally tally;
        for (const Measured& tile : tiles) {
            tally.add(tile.square, tile.weight);
            tally.close();
        }
        return estimate_of(std::array{Stratum{.tally = tally}});
    }
    double weights = 0, square = 0, variance = 0;
    for (const Measured& tile : tiles) weights += tile.weight;
    for (const Measured& tile : tiles) {
        const double share = tile.weight / weights;
        square += share * tile.square;
        variance += share * share * tile.variance;
    }
    return {std::sqrt(square),
            std::sqrt(square + ErrorTally::kStandardErrors * std::sqrt(variance))};
}

/// Edges without an answer about errors, by the fact that will tell it.
std::map<std::string, Demand> edges_to_measure(const Catalogue& catalogue, const Ask& ask,
                                               const Representation& input, const Demands& asked) {
    std::map<std::string, Demand> edges;
    const TransformGraph spanned = expand(catalogue, ask, {{input}}, {.via = asked.via});
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Transition& edge = catalogue[static_cast<std::size_t>(spanned.graph[arc].edge)];
        const Parameters& with = spanned.graph[arc].offer.with;
        if (!edge.error) edges.try_emplace(fact_of_runs(edge, with), Demand{edge.name, with});
    }
    return edges;
}

}  // namespace

void measure_runs(const Catalogue& catalogue, const Demands& asked, const Data& input,
                  const Statistics& statistics, const Request& want, const Phantom* formula,
                  Scene& scene, std::pmr::memory_resource* memory) {
    if (!has_silent_edges(catalogue)) return;
    const std::map<std::string, Demand> edges =
        edges_to_measure(catalogue, {want, scene}, input.what, asked);
    if (edges.empty()) return;
    const bool pictures = want.job->of_rays();
    // A formula is told by the input's indices, of which a part has others.
    const Tiles tiles =
        pictures ? tiles_of_pictures(want) : tiles_of_warp(want, formula != nullptr);
    std::map<std::string, std::vector<Measured>> measured;
    std::map<std::string, double> gains;
    const auto count = static_cast<std::int64_t>(tiles.drawn.size());
    const std::int64_t rays = pictures && want.mode->threshold ? kJumpingRays : kRays;
    std::vector<std::optional<MeasuredTile>> made(tiles.drawn.size());
    for (const auto& [fact, edge] : edges) {
        MadeOnce once({want, scene}, input, memory);
        for (std::size_t i = 0; i < made.size(); ++i) {
            const Tile& drawn = tiles.drawn[i];
            std::optional<MeasuredTile>& tile = made[i];
            try {
                if (!tile)
                    tile.emplace(input, want, formula, drawn, pictures ? rays / count : 0, memory);
                const Scene seen = scene_of(scene, statistics, drawn, want.input);
                // All tiles show the same data: one tells the gain.
                if (const auto found =
                        measure_on(*tile, catalogue, edge, asked, seen, want.budget.bytes,
                                   !gains.contains(fact), pictures ? &once : nullptr, memory)) {
                    measured[fact].push_back(found->error);
                    if (found->gain) gains[fact] = *found->gain;
                }
            } catch (const RequestError&) {  // not of this tile
            } catch (const RunError&) {
            } catch (const std::bad_alloc&) {
            }
        }
    }
    for (const auto& [fact, gain] : gains)
        scene.facts[gain_of_runs(FactName(fact))] = scene.likely[gain_of_runs(FactName(fact))] =
            gain;
    for (const auto& [fact, found] : measured) {
        const bool all = tiles.are_all && found.size() == tiles.drawn.size();
        const ErrorEstimate error = estimate_on(found, all && pictures);
        // Whole pictures show which difference will count as 1, better than a preview does.
        double range = 0;
        for (const Measured& tile : found) range = std::max(range, tile.range);
        const double scale = pictures && range > 0 ? scene.range / range : 1;
        scene.facts[fact] = scale * error.upper;
        scene.likely[fact] = scale * error.likely;
    }
}

}  // namespace edgewise
