#include "transitions/filter/runs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fmt/format.h>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

/// Places of a row of the kernel that follow one another.
struct Run {
    std::int64_t x, y, z;  // the first, counted from the sample
    std::int64_t length;

    /// The longest run of 2^level samples that fits.
    int level() const noexcept { return std::bit_width(static_cast<std::uint64_t>(length)) - 1; }
};

SmallVector<Run> runs_of(const Neighbourhood& of) {
    SmallVector<Run> runs;
    std::size_t at = 0;
    for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
        for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y) {
            bool inside = false;
            for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x, ++at) {
                const bool counts = of.counts(of.weights[at]);
                if (counts && !inside) runs.push_back({x, y, z, 0});
                if (counts) ++runs.back().length;
                inside = counts;
            }
        }
    return runs;
}

int levels_of(const SmallVector<Run>& runs) {
    int most = 0;
    for (const Run& run : runs) most = std::max(most, run.level());
    return most + 1;
}

/// Extremes over `have` values become those over more: of values at these places.
struct Widening {
    SmallVector<std::int64_t> places;  // the first is 0
    std::int64_t left;                 // values more than are asked for in the end
};

/// Fourfold while that is not too much: of each value read and written a pass makes as much as two
/// doublings, which would read and write twice.
SmallVector<Widening> widenings(std::int64_t length) {
    constexpr std::int64_t kTimes = 4;
    SmallVector<Widening> all;
    for (std::int64_t have = 1; have < length;) {
        const std::int64_t next = std::min(kTimes * have, length);
        Widening one;
        for (std::int64_t at = 0; at + have < next; at += have) one.places.push_back(at);
        one.places.push_back(next - have);
        one.left = length - next;
        all.push_back(std::move(one));
        have = next;
    }
    return all;
}

/// Comparisons for each value, and one more for each pass that reads and writes it.
double widening_operations(std::int64_t length) {
    double operations = 0;
    for (const Widening& one : widenings(length)) operations += 2.0 * double(one.places.size());
    return operations;
}

/// Of boxes: long rows, as each is worked off by itself, and so many that the second cache holds
/// them and few more are read around them.
Extent box_tile(const Neighbourhood& of, const Extent& whole, std::size_t bytes) {
    Extent tile = tile_for(of, whole, bytes);
    if (whole.z > 1) return tile;
    constexpr std::int64_t kRow = 1024, kCached = 1 << 19;
    const Extent reach = of.extent();
    const auto size = static_cast<std::int64_t>(bytes);
    tile.x = std::min(kRow / std::min<std::int64_t>(size, 2), whole.x);
    const std::int64_t rows = kCached / ((tile.x + reach.x) * size) - reach.y;
    tile.y = std::min(std::clamp(rows, tile.y, std::max(tile.y, 8 * reach.y)), whole.y);
    return tile;
}

Extent tile_of(const PassAsk& ask) {
    const std::size_t bytes = bytes_of(ask.type);
    return ask.of.full() ? box_tile(ask.of, ask.from.extent, bytes)
                         : tile_for(ask.of, ask.from.extent, bytes);
}

std::string not_by_runs(const PassAsk& ask) {
    if (ask.of.rule != Neighbourhood::Rule::largest && ask.of.rule != Neighbourhood::Rule::least)
        return "sums and medians are not those of their parts";
    if (!ask.of.flat()) return "the kernel is not flat";
    if (ask.of.places() == 0) return "no place of the kernel counts";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite", ask.scene.non_finite);
    return {};
}

double operations_by_runs(const PassAsk& ask) {
    const Extent tile = tile_of(ask);
    const Extent reach = ask.of.extent();
    const double rows = (1 + double(reach.y - 1) / double(tile.y)) *
                        (1 + double(reach.z - 1) / double(tile.z)),
                 slices = 1 + double(reach.z - 1) / double(tile.z);
    const double call = ask.call(tile.x);
    if (ask.of.full()) {
        const auto along = [&](std::int64_t length) {
            return widening_operations(length) + call * double(widenings(length).size());
        };
        return (along(reach.x) + call) * rows + along(reach.y) * slices + along(reach.z);
    }
    const SmallVector<Run> runs = runs_of(ask.of);
    const int levels = levels_of(runs);
    return (2 * (levels - 1) + call * levels) * rows + 2.0 * double(runs.size()) + call;
}

/// Of shapes that are no box: what a row of results reads of the levels.
Lines lines_by_runs(const PassAsk& ask) {
    if (ask.of.full()) return {};
    const SmallVector<Run> runs = runs_of(ask.of);
    double places = 0;
    for (const Run& run : runs) places += run.length == std::int64_t{1} << run.level() ? 1 : 2;
    const TileShape shape(ask.of, tile_of(ask));
    const auto bytes = static_cast<double>(bytes_of(ask.type));
    return {.count = places * bytes / kLineBytes,
            .span = static_cast<double>(shape.values()) * levels_of(runs) * bytes};
}

/// Rows of values of a tile, or of its results.
template <class T>
struct Rows {
    T* first;
    std::int64_t row, slice;  // values from one to the next

    T* at(std::int64_t y, std::int64_t z) const noexcept { return first + y * row + z * slice; }
};

/// A box: extremes along rows, then columns, then lines of slices. The last pass writes the result,
/// the others work in place.
template <class T>
class BoxTile {
 public:
    BoxTile(const Tile<T>& tile, const Neighbourhood& of,
            const std::array<SmallVector<Widening>, 3>& along, Rows<T> between)
        : tile_(tile),
          between_(between),
          to_{tile.out, tile.row, tile.slice},
          n_(tile.extent),
          rows_(n_.y + of.extent().y - 1),
          slices_(n_.z + of.extent().z - 1),
          least_(of.rule == Neighbourhood::Rule::least),
          along_(along) {
        for (const auto& passes : along_) left_ += passes.size();
    }

    /// @param row  room for a padded row
    void run(T* row) {
        along_rows(row);
        for (const Widening& pass : along_[1]) step(pass, between_.row, n_.y + pass.left, slices_);
        for (const Widening& pass : along_[2]) step(pass, between_.slice, n_.y, n_.z + pass.left);
    }

 private:
    /// Each row while it is in the nearest cache.
    void along_rows(T* padded) {
        const SmallVector<Widening>& passes = along_[0];
        const bool is_last = left_ == passes.size();
        for (std::int64_t z = 0; z < slices_; ++z)
            for (std::int64_t y = 0; y < rows_; ++y) {
                T* out = is_last ? to_.at(y, z) : between_.at(y, z);
                (*tile_.read)(y, z, passes.empty() ? out : padded);
                for (std::size_t i = 0; i < passes.size(); ++i)
                    row(padded, passes[i], 1, i + 1 == passes.size() ? out : padded,
                        n_.x + passes[i].left);
            }
        left_ -= passes.size();
    }
    /// Where it works in place, no row is read that was written.
    void step(const Widening& pass, std::int64_t apart, std::int64_t rows, std::int64_t slices) {
        const Rows<T>& to = --left_ == 0 ? to_ : between_;
        for (std::int64_t z = 0; z < slices; ++z)
            for (std::int64_t y = 0; y < rows; ++y)
                row(between_.at(y, z), pass, apart, to.at(y, z), n_.x);
    }
    void row(const T* in, const Widening& pass, std::int64_t apart, T* out, std::int64_t n) const {
        std::array<std::ptrdiff_t, 4> places{};
        for (std::size_t i = 0; i < pass.places.size(); ++i) places[i] = pass.places[i] * apart;
        kernels::extreme_row(in, places.data(), pass.places.size(), least_, out, n);
    }

    const Tile<T>& tile_;
    Rows<T> between_, to_;
    Extent n_;
    std::int64_t rows_, slices_;
    bool least_;
    const std::array<SmallVector<Widening>, 3>& along_;
    std::size_t left_ = 0;  // passes
};

template <class T>
void run_box(const PassRun& run) {
    const TileShape shape(run.of, box_tile(run.of, run.in.extent, sizeof(T)));
    const Extent reach = run.of.extent();
    const std::array<SmallVector<Widening>, 3> along{widenings(reach.x), widenings(reach.y),
                                                     widenings(reach.z)};
    run_tiles<T>(
        run, shape,
        [&](const Tile<T>& tile) {
            kernels::Block<T> values(
                static_cast<std::size_t>(shape.values() + 2 * kernels::kRowStep), tile.memory);
            kernels::Block<T> row(static_cast<std::size_t>(shape.row + kernels::kRowStep),
                                  tile.memory);
            BoxTile<T>(tile, run.of, along, {values.data(), shape.row, shape.slice})
                .run(row.data());
        },
        TileReads::rows);
}

/// Any shape: each level holds extremes over twice as long runs along rows as the one before it.
template <class T>
void run_shape(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const SmallVector<Run> runs = runs_of(run.of);
    const int levels = levels_of(runs);
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    const std::int64_t level = shape.values() + kernels::kRowStep;
    SmallVector<std::ptrdiff_t> places;
    for (const Run& each : runs) {
        const std::ptrdiff_t row = each.level() * level + shape.place(each.x, each.y, each.z);
        const std::int64_t second = each.length - (std::int64_t{1} << each.level());
        places.push_back(row);
        if (second > 0) places.push_back(row + second);
    }
    const auto work = [&](const Tile<T>& tile) {
        const Extent n = tile.extent, reach = run.of.extent();
        kernels::Block<T> values(static_cast<std::size_t>(level * levels + 2 * kernels::kRowStep),
                                 tile.memory);
        const T* first = tile.first(run.of);
        const std::int64_t wide = n.x + reach.x - 1;
        for (std::int64_t z = 0; z < n.z + reach.z - 1; ++z)
            for (std::int64_t y = 0; y < n.y + reach.y - 1; ++y) {
                const std::int64_t at = y * shape.row + z * shape.slice;
                std::memcpy(values.data() + at, first + y * tile.shape.row + z * tile.shape.slice,
                            static_cast<std::size_t>(wide) * sizeof(T));
                for (int l = 1; l < levels; ++l) {
                    const std::ptrdiff_t both[] = {0, std::ptrdiff_t{1} << (l - 1)};
                    kernels::extreme_row(values.data() + (l - 1) * level + at, both, 2, least,
                                         values.data() + l * level + at,
                                         wide - (std::int64_t{1} << l) + 1);
                }
            }
        const T* here = values.data() - shape.place(run.of.low[0], run.of.low[1], run.of.low[2]);
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                kernels::extreme_row(here + y * shape.row + z * shape.slice, places.data(),
                                     places.size(), least, tile.out_row(y, z), n.x);
    };
    run_tiles<T>(run, shape, work, TileReads::in_place_but_frames);
}

}  // namespace

Transition filter_runs() {
    return filtering_edge({
        .name = "filter.runs",
        .source = "Urbach and Wilkinson 2008",
        .refused = not_by_runs,
        .operations = operations_by_runs,
        .lines = lines_by_runs,
        .in_place = true,
        .scratch =
            [](const PassAsk& ask) {
                const TileShape shape(ask.of, tile_of(ask));
                const int copies = 2 + (ask.of.full() ? 1 : levels_of(runs_of(ask.of)));
                return copies * static_cast<double>(shape.values()) *
                       static_cast<double>(bytes_of(ask.type));
            },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) {
                    if (run.of.full())
                        run_box<decltype(sample)>(run);
                    else
                        run_shape<decltype(sample)>(run);
                });
            },
        .trials = sum_and_extreme_trials,
        .factors = {{"", 1.1}},
    });
}

}  // namespace edgewise
