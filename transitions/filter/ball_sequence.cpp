#include "transitions/filter/ball_sequence.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <tuple>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

using Step = std::array<std::int64_t, 3>;

/// A line of 2 n + 1 samples, `step` apart.
struct PeriodicLine {
    Step step;
    std::int64_t n;
};

/// Steps point forward in memory.
SmallVector<PeriodicLine> lines_of(const BallSequence& of) {
    SmallVector<PeriodicLine> lines;
    const auto add = [&](std::int64_t n, std::initializer_list<Step> steps) {
        for (const Step& step : steps)
            if (n > 0) lines.push_back({step, n});
    };
    add(of.box, {{1, 0, 0}, {0, 1, 0}});
    add(of.face, {{1, 1, 0}, {-1, 1, 0}});
    if (of.axes == 2) return lines;
    add(of.box, {{0, 0, 1}});
    add(of.face, {{1, 0, 1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, 1}});
    add(of.body, {{1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {-1, -1, 1}});
    return lines;
}

/// How far a sequence reaches in a direction of length 1.
double support(const BallSequence& of, const std::array<double, 3>& direction) {
    double reach = 0, most = 0;
    for (const double along : direction) most = std::max(most, std::abs(along));
    for (const PeriodicLine& line : lines_of(of)) {
        double along = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            along += double(line.step[axis]) * direction[axis];
        reach += double(line.n) * std::abs(along);
    }
    return reach + double(of.crosses) * most;
}

/// Mean square error of its reach, over directions of an octant.
double misfit(const BallSequence& of, double radius) {
    constexpr int kAngles = 7;
    double sum = 0, weight = 0;
    for (int i = 0; i < kAngles; ++i)
        for (int j = 0; j < (of.axes == 2 ? 1 : kAngles); ++j) {
            const double across = (i + 0.5) / kAngles * M_PI / 2, up = j * M_PI / 2 / kAngles;
            const double off = support(of, {std::cos(across) * std::cos(up),
                                            std::sin(across) * std::cos(up), std::sin(up)}) -
                               radius;
            sum += std::cos(up) * off * off, weight += std::cos(up);
        }
    return sum / weight;
}

int axes_of_ball(const Neighbourhood& of) { return of.extent().z == 1 ? 2 : 3; }

/// Outputs start so many samples before those that they belong to: what is read lies ahead.
struct Ahead {
    SmallVector<SmallVector<std::ptrdiff_t>> reads;  // of one pass over the tile after another
    std::ptrdiff_t start = 0;
};

/// The passes over a padded tile as one row of values.
Ahead passes_ahead(const BallSequence& of, const TileShape& shape) {
    Ahead all;
    for (const PeriodicLine& line : lines_of(of)) {
        const std::ptrdiff_t step = shape.place(line.step[0], line.step[1], line.step[2]);
        for (std::int64_t have = 1, want = 2 * line.n + 1; have < want;) {
            const std::int64_t more = std::min(have, want - have);
            all.reads.push_back({0, more * step});
            have += more;
        }
        all.start += line.n * step;
    }
    const std::ptrdiff_t row = shape.row, far = of.axes == 2 ? row : shape.slice;
    SmallVector<std::ptrdiff_t> cross = {0, far - 1, far, far + 1, 2 * far};
    if (of.axes == 3) cross.insert(cross.end(), {far - row, far + row});
    for (std::int64_t i = 0; i < of.crosses; ++i) all.reads.push_back(cross);
    all.start += of.crosses * far;
    return all;
}

template <class T>
void run_sequence(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Ahead passes = passes_ahead(ball_sequence(run.of.size, axes_of_ball(run.of)), shape);
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        const std::int64_t count =
            shape.slice * (n.z + run.of.extent().z - 2) + shape.row * (n.y + run.of.extent().y - 1);
        kernels::Block<T> values(static_cast<std::size_t>(count + 2 * kernels::kRowStep),
                                 tile.memory);
        const T* first = tile.first(run.of);
        std::memcpy(values.data(), first, static_cast<std::size_t>(count) * sizeof(T));
        std::fill_n(values.data() + count, 2 * kernels::kRowStep, T{});
        // Rows run on into the next: what lies between them reaches no sample of the tile.
        for (const SmallVector<std::ptrdiff_t>& reads : passes.reads) {
            const std::ptrdiff_t farthest = *std::max_element(reads.begin(), reads.end());
            kernels::extreme_row(values.data(), reads.data(), reads.size(), least, values.data(),
                                 count - farthest);
        }
        const T* here =
            values.data() - shape.place(run.of.low[0], run.of.low[1], run.of.low[2]) - passes.start;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                std::memcpy(tile.out_row(y, z), here + y * shape.row + z * shape.slice,
                            static_cast<std::size_t>(n.x) * sizeof(T));
    });
}

/// What the sequence does to the largest tile.
struct OfTile {
    TileShape shape;
    Ahead passes;

    explicit OfTile(const PassAsk& ask)
        : shape(ask.of, tile_for(ask.of, ask.from.extent, bytes_of(ask.type))),
          passes(passes_ahead(ball_sequence(ask.of.size, axes_of_ball(ask.of)), shape)) {}
    double values_a_sample() const noexcept {
        return double(shape.values()) / double(shape.tile.samples());
    }
};

std::string not_by_sequence(const PassAsk& ask) {
    const Neighbourhood& of = ask.of;
    // Counting the places of larger ones takes longer than the filter.
    const double most = axes_of_ball(of) == 2 ? 64 : 32;
    if (of.rule != Neighbourhood::Rule::largest && of.rule != Neighbourhood::Rule::least)
        return "sums and medians are not those of their parts";
    if (of.shape != Stencil::Shape::ball || !of.flat()) return "the kernel is no flat ball";
    if (of.size < 1 || of.size > most)
        return fmt::format("needs a radius of 1 to {}, which is {}", most, of.size);
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite", ask.scene.non_finite);
    const std::int64_t differing =
        differing_places(ball_sequence(of.size, axes_of_ball(of)), of.size);
    const double allowed = ask.with.number("differs");
    if (double(differing) > allowed * double(of.places()))
        return fmt::format(
            "{} places differ from the ball's {}, a share of {:.3f}; differs={} allows fewer",
            differing, of.places(), double(differing) / double(of.places()), allowed);
    return {};
}

}  // namespace

BallSequence ball_sequence(double radius, int axes) {
    const auto reach = static_cast<std::int64_t>(std::floor(radius));
    constexpr std::int64_t kCrosses = 3;  // each costs as much as a line of any length
    SmallVector<std::pair<double, BallSequence>> fits;
    for (std::int64_t crosses = 0; crosses <= std::min(kCrosses, reach); ++crosses)
        for (std::int64_t face = 0; face <= reach; ++face)
            for (std::int64_t body = 0; body <= (axes == 2 ? 0 : reach); ++body) {
                BallSequence one{axes, 0, face, body, crosses};
                one.box = reach - one.radius();
                if (one.box < 0) break;
                fits.emplace_back(misfit(one, radius), one);
            }
    const auto nearer = [](const auto& a, const auto& b) { return a.first < b.first; };
    // Of equals the first of the loops above; a stable sort would allocate.
    std::sort(fits.begin(), fits.end(), [](const auto& a, const auto& b) {
        const auto order = [](const auto& fit) {
            return std::tuple(fit.first, fit.second.crosses, fit.second.face, fit.second.body);
        };
        return order(a) < order(b);
    });
    // The best of them are counted where that takes no time.
    constexpr std::size_t kCounted = 6;
    constexpr double kCountable = 20'000;
    if (std::pow(2 * double(reach) + 1, axes) > kCountable) return fits.front().second;
    fits.resize(std::min(fits.size(), kCounted));
    for (auto& [fit, one] : fits) fit = double(differing_places(one, radius));
    return std::min_element(fits.begin(), fits.end(), nearer)->second;
}

SmallVector<std::uint8_t> places_of(const BallSequence& sequence) {
    const std::int64_t r = sequence.radius(), side = 2 * r + 1;
    const std::int64_t slice = side * side, count = sequence.axes == 2 ? slice : slice * side;
    SmallVector<std::uint8_t> now(static_cast<std::size_t>(count)), next;
    now[static_cast<std::size_t>(count / 2)] = 1;
    // No place reaches the ends of the box before the last step.
    const auto widen = [&](const SmallVector<std::int64_t>& steps) {
        next = now;
        for (const std::int64_t step : steps)
            for (std::int64_t i = step; i < count; ++i) {
                next[static_cast<std::size_t>(i)] |= now[static_cast<std::size_t>(i - step)];
                next[static_cast<std::size_t>(i - step)] |= now[static_cast<std::size_t>(i)];
            }
        now.swap(next);
    };
    for (const PeriodicLine& line : lines_of(sequence))
        for (std::int64_t i = 0; i < line.n; ++i)
            widen({line.step[0] + line.step[1] * side + line.step[2] * slice});
    SmallVector<std::int64_t> cross = {1, side};
    if (sequence.axes == 3) cross.push_back(slice);
    for (std::int64_t i = 0; i < sequence.crosses; ++i) widen(cross);
    return now;
}

std::int64_t differing_places(const BallSequence& sequence, double radius) {
    const SmallVector<std::uint8_t> made = places_of(sequence);
    const std::int64_t r = sequence.radius(), deep = sequence.axes == 2 ? 0 : r;
    std::int64_t differing = 0;
    std::size_t at = 0;
    for (std::int64_t z = -deep; z <= deep; ++z)
        for (std::int64_t y = -r; y <= r; ++y)
            for (std::int64_t x = -r; x <= r; ++x, ++at) {
                const bool inside = double(x * x + y * y + z * z) <= radius * radius;
                differing += inside != (made[at] != 0);
            }
    return differing;
}

Transition filter_ball_sequence() {
    return filtering_edge({
        .name = "filter.ball_sequence",
        .source = "Adams 1993; Jones and Soille 1996",
        .parameters = {{"differs",
                        number(0, 2, {0.25}, "places that may differ, as a share of the ball's")}},
        .on_demand = true,
        .refused = not_by_sequence,
        .operations =
            [](const PassAsk& ask) {
                const OfTile tile(ask);
                double comparisons = 0;
                for (const auto& reads : tile.passes.reads)
                    comparisons += 2.0 * double(reads.size() - 1);
                return comparisons * tile.values_a_sample();
            },
        // Each pass goes over the whole tile.
        .lines = [](const PassAsk& ask) -> Lines {
            const OfTile tile(ask);
            const auto bytes = static_cast<double>(bytes_of(ask.type));
            double streams =
                0;  // that a pass reads, each a line apart from the one before, and writes
            for (SmallVector<std::ptrdiff_t> reads : tile.passes.reads) {
                std::sort(reads.begin(), reads.end());
                streams += 2;
                for (std::size_t i = 1; i < reads.size(); ++i)
                    streams += double(reads[i] - reads[i - 1]) * bytes >= kLineBytes;
            }
            return {.count = streams * tile.values_a_sample() * bytes / kLineBytes,
                    .span = static_cast<double>(tile.shape.values()) * bytes};
        },
        .error = [](const PassAsk& ask) -> Error {
            const BallSequence sequence = ball_sequence(ask.of.size, axes_of_ball(ask.of));
            return differing_places(sequence, ask.of.size) == 0 ? Error{} : Error::unknown();
        },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_sequence<decltype(sample)>(run); });
            },
    });
}

}  // namespace edgewise
