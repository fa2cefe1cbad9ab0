#include "transitions/filter/runs.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <vector>

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

std::vector<Run> runs_of(const Neighbourhood& of) {
    std::vector<Run> runs;
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

int levels_of(const std::vector<Run>& runs) {
    int most = 0;
    for (const Run& run : runs) most = std::max(most, run.level());
    return most + 1;
}

/// Doublings until a run has this length.
int doublings(std::int64_t length) {
    return length == 1 ? 0 : std::bit_width(static_cast<std::uint64_t>(length - 1));
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
    const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
    const Extent reach = ask.of.extent();
    const double rows = (1 + double(reach.y - 1) / double(tile.y)) *
                        (1 + double(reach.z - 1) / double(tile.z)),
                 slices = 1 + double(reach.z - 1) / double(tile.z);
    if (ask.of.full())
        return 2 * (doublings(reach.x) * rows + doublings(reach.y) * slices + doublings(reach.z));
    const std::vector<Run> runs = runs_of(ask.of);
    return 2 * (levels_of(runs) - 1) * rows + 2.0 * double(runs.size());
}

/// Extremes over `length` values become those over pairs of shorter ones, in place, until they are
/// long enough.
/// @param widen  (step, more): with the value `step` places on, for so many values more than are
///               asked for in the end
template <class Widen>
void each_doubling(std::int64_t length, const Widen& widen) {
    for (std::int64_t have = 1; have < length;) {
        const std::int64_t add = std::min(have, length - have);
        have += add;
        widen(add, length - have);
    }
}

/// A row with another behind it: what is read has not been overwritten yet.
template <class T>
void widen_row(T* row, std::ptrdiff_t behind, bool least, std::int64_t n) {
    const std::ptrdiff_t places[] = {0, behind};
    kernels::extreme_row(row, places, 2, least, row, n);
}

/// A box: extremes along rows, then columns, then lines of slices, in place.
template <class T>
void run_box(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Extent reach = run.of.extent();
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        const std::int64_t rows = n.y + reach.y - 1, slices = n.z + reach.z - 1;
        const std::int64_t slice = shape.row * rows;
        kernels::Block<T> values(static_cast<std::size_t>(slice * slices + 2 * kernels::kRowStep),
                                 tile.memory);
        const T* first = tile.first(run.of);
        for (std::int64_t z = 0; z < slices; ++z)
            for (std::int64_t y = 0; y < rows; ++y) {
                T* row = values.data() + y * shape.row + z * slice;
                std::memcpy(row, first + y * shape.row + z * shape.slice,
                            static_cast<std::size_t>(shape.row) * sizeof(T));
                each_doubling(reach.x, [&](std::int64_t step, std::int64_t more) {
                    widen_row(row, step, least, n.x + more);
                });
            }
        for (std::int64_t z = 0; z < slices; ++z)
            each_doubling(reach.y, [&](std::int64_t step, std::int64_t more) {
                for (std::int64_t y = 0; y < n.y + more; ++y)
                    widen_row(values.data() + y * shape.row + z * slice, step * shape.row, least,
                              n.x);
            });
        each_doubling(reach.z, [&](std::int64_t step, std::int64_t more) {
            for (std::int64_t z = 0; z < n.z + more; ++z)
                for (std::int64_t y = 0; y < n.y; ++y)
                    widen_row(values.data() + y * shape.row + z * slice, step * slice, least, n.x);
        });
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                std::memcpy(tile.out_row(y, z), values.data() + y * shape.row + z * slice,
                            static_cast<std::size_t>(n.x) * sizeof(T));
    });
}

/// Any shape: each level holds extremes over twice as long runs along rows as the one before it.
template <class T>
void run_shape(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const std::vector<Run> runs = runs_of(run.of);
    const int levels = levels_of(runs);
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    const std::int64_t level = shape.values() + kernels::kRowStep;
    std::vector<std::ptrdiff_t> places;
    for (const Run& each : runs) {
        const std::ptrdiff_t row = each.level() * level + shape.place(each.x, each.y, each.z);
        const std::int64_t second = each.length - (std::int64_t{1} << each.level());
        places.push_back(row);
        if (second > 0) places.push_back(row + second);
    }
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent, reach = run.of.extent();
        kernels::Block<T> values(static_cast<std::size_t>(level * levels + 2 * kernels::kRowStep),
                                 tile.memory);
        const T* first = tile.first(run.of);
        const std::int64_t wide = n.x + reach.x - 1;
        for (std::int64_t z = 0; z < n.z + reach.z - 1; ++z)
            for (std::int64_t y = 0; y < n.y + reach.y - 1; ++y) {
                const std::int64_t at = y * shape.row + z * shape.slice;
                std::memcpy(values.data() + at, first + at,
                            static_cast<std::size_t>(shape.row) * sizeof(T));
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
    });
}

}  // namespace

Transition filter_runs() {
    return filtering_edge({
        .name = "filter.runs",
        .source = "Urbach and Wilkinson 2008",
        .refused = not_by_runs,
        .operations = operations_by_runs,
        .scratch =
            [](const PassAsk& ask) {
                const TileShape shape(ask.of,
                                      tile_for(ask.of, ask.from.extent, bytes_of(ask.type)));
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
    });
}

}  // namespace edgewise
