#include "transitions/filter/forward.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"

namespace edgewise {
namespace {

/// Places of a row of the kernel from the first to the last that counts.
template <class T>
struct WeightRow {
    std::int64_t x, y, z;    // the first, counted from the sample that is read
    SmallVector<T> weights;  // 0 where none counts
    bool full = true;        // all count
};

template <class T>
SmallVector<WeightRow<T>> weight_rows(const Neighbourhood& of) {
    SmallVector<WeightRow<T>> rows;
    const std::int64_t wide = of.extent().x;
    std::size_t at = 0;
    for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
        for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y) {
            const double* row = of.weights.data() + at;
            at += static_cast<std::size_t>(wide);
            const auto counts = [&](double weight) { return of.counts(weight); };
            const double* first = std::find_if(row, row + wide, counts);
            if (first == row + wide) continue;
            const double* end = row + wide;
            while (!of.counts(end[-1])) --end;
            WeightRow<T> made{of.low[0] + (first - row), y, z, {}};
            for (const double* weight = first; weight < end; ++weight) {
                made.full = made.full && of.counts(*weight);
                made.weights.push_back(static_cast<T>(of.counts(*weight) ? *weight : 0));
            }
            rows.push_back(std::move(made));
        }
    return rows;
}

/// What in(p + k) w(k) adds to out(p), of one sample and one row of the kernel.
/// @param at  of the sample in the tile
template <class T>
void scatter(const WeightRow<T>& row, T value, const std::array<std::int64_t, 3>& at,
             const Tile<T>& tile) {
    const std::int64_t y = at[1] - row.y, z = at[2] - row.z;
    if (y < 0 || y >= tile.extent.y || z < 0 || z >= tile.extent.z) return;
    // Weight i belongs to place row.x + i, and goes to sample at - row.x - i.
    const std::int64_t last = at[0] - row.x;
    const auto count = static_cast<std::int64_t>(row.weights.size());
    const std::int64_t begin = std::max<std::int64_t>(0, last - tile.extent.x + 1),
                       end = std::min(count, last + 1);
    T* out = tile.out_row(y, z) + last;
    for (std::int64_t i = begin; i < end; ++i) {
        const T weight = row.weights[static_cast<std::size_t>(i)];
        if (row.full || weight != 0) out[-i] += weight * value;
    }
}

/// Goes over the rows of the padded tile: their samples, how many, and the place of the first in
/// the tile.
template <class T, class Take>
void each_row(const PassRun& run, const Tile<T>& tile, const Take& take) {
    const Extent n = tile.extent, reach = run.of.extent();
    const T* first = tile.first(run.of);
    for (std::int64_t z = 0; z < n.z + reach.z - 1; ++z)
        for (std::int64_t y = 0; y < n.y + reach.y - 1; ++y)
            take(first + y * tile.shape.row + z * tile.shape.slice, n.x + reach.x - 1,
                 std::array<std::int64_t, 3>{run.of.low[0], y + run.of.low[1], z + run.of.low[2]});
}

/// Goes over the samples of the padded tile other than `skipped`, with their places in the tile.
/// Those that are skipped are looked at many at once.
template <class T, class Take>
void each_sample_but(T skipped, const PassRun& run, const Tile<T>& tile, const Take& take) {
    constexpr std::int64_t kBlock = 64;
    each_row(run, tile, [&](const T* row, std::int64_t n, std::array<std::int64_t, 3> at) {
        for (std::int64_t begin = 0; begin < n; begin += kBlock, at[0] += kBlock) {
            const std::int64_t count = std::min(kBlock, n - begin);
            const T* from = row + begin;
            int others = 0;
            for (std::int64_t x = 0; x < count; ++x) others |= from[x] != skipped;
            if (!others) continue;
            for (std::int64_t x = 0; x < count; ++x)
                if (from[x] != skipped)
                    take(from[x], std::array<std::int64_t, 3>{at[0] + x, at[1], at[2]});
        }
    });
}

template <class T>
void fill_tile(const Tile<T>& tile, T value) {
    for (std::int64_t z = 0; z < tile.extent.z; ++z)
        for (std::int64_t y = 0; y < tile.extent.y; ++y)
            std::fill_n(tile.out_row(y, z), tile.extent.x, value);
}

template <class T>
void run_sums(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const SmallVector<WeightRow<T>> rows = weight_rows<T>(run.of);
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        fill_tile(tile, T{});
        each_sample_but(T{}, run, tile, [&](T value, const std::array<std::int64_t, 3>& at) {
            for (const WeightRow<T>& row : rows) scatter(row, value, at, tile);
        });
    });
}

/// Places of a row of the kernel that follow one another and have one height.
template <class T>
struct HeightRun {
    std::int64_t x, y, z;  // the first, counted from the sample that is read
    std::int64_t count;
    T height;
};

template <class T>
SmallVector<HeightRun<T>> height_runs(const Neighbourhood& of) {
    SmallVector<HeightRun<T>> runs;
    std::size_t at = 0;
    for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
        for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y) {
            bool inside = false;
            for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x, ++at) {
                const double weight = of.weights[at];
                const bool counts = of.counts(weight);
                if (counts) {
                    const auto height = static_cast<T>(weight);
                    if (!inside || runs.back().height != height)
                        runs.push_back({x, y, z, 0, height});
                    ++runs.back().count;
                }
                inside = counts;
            }
        }
    return runs;
}

/// Order of a pass: of least it is turned round.
template <class T, bool least>
struct Order {
    static bool before(T a, T b) { return least ? b < a : a < b; }
    static T raised(T value, T height) {
        if constexpr (std::is_floating_point_v<T>)
            return least ? value - height : value + height;
        else
            return value;
    }
    /// Before all others.
    static T lowest() {
        using Limits = std::numeric_limits<T>;
        if constexpr (Limits::has_infinity) return least ? Limits::infinity() : -Limits::infinity();
        return least ? Limits::max() : Limits::lowest();
    }
};

/// Outputs that a sample reaches with one height become it where they are lower. NaN stays NaN, and
/// takes what it reaches.
template <class T, bool least>
void raise(const HeightRun<T>& run, T value, const std::array<std::int64_t, 3>& at,
           const Tile<T>& tile) {
    const std::int64_t y = at[1] - run.y, z = at[2] - run.z;
    if (y < 0 || y >= tile.extent.y || z < 0 || z >= tile.extent.z) return;
    const std::int64_t last = at[0] - run.x;
    const std::int64_t begin = std::max<std::int64_t>(0, last - run.count + 1),
                       end = std::min(tile.extent.x, last + 1);
    const T raised = Order<T, least>::raised(value, run.height);
    T* out = tile.out_row(y, z);
    if (raised != raised) {
        for (std::int64_t x = begin; x < end; ++x) out[x] = raised;
        return;
    }
    for (std::int64_t x = begin; x < end; ++x)
        out[x] = Order<T, least>::before(out[x], raised) ? raised : out[x];
}

/// No result is lower than the lowest sample of the tile raised by the largest height: that is
/// where results start, and such samples need not be scattered.
template <class T, bool least>
void run_extremes(const PassRun& run) {
    using By = Order<T, least>;
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const SmallVector<HeightRun<T>> runs = height_runs<T>(run.of);
    T most = runs.front().height;
    for (const HeightRun<T>& each : runs) most = std::max(most, each.height);
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        T lowest = Order<T, !least>::lowest();
        each_row(run, tile, [&](const T* row, std::int64_t n, const auto&) {
            T low = lowest;
            for (std::int64_t x = 0; x < n; ++x) low = By::before(row[x], low) ? row[x] : low;
            lowest = low;
        });
        const T start = By::raised(lowest, most);
        // Infinite samples or heights may make NaN: nothing is left out then.
        bool skips = true;
        if constexpr (std::is_floating_point_v<T>) skips = std::isfinite(start);
        fill_tile(tile, skips ? start : By::lowest());
        const auto scattered = [&](T value, const std::array<std::int64_t, 3>& at) {
            for (const HeightRun<T>& each : runs) raise<T, least>(each, value, at, tile);
        };
        if (skips) return each_sample_but(lowest, run, tile, scattered);
        each_row(run, tile, [&](const T* row, std::int64_t n, std::array<std::int64_t, 3> at) {
            for (std::int64_t x = 0; x < n; ++x, ++at[0]) scattered(row[x], at);
        });
    });
}

template <class T>
void run_forward(const PassRun& run) {
    if (run.of.rule == Neighbourhood::Rule::largest) return run_extremes<T, false>(run);
    if (run.of.rule == Neighbourhood::Rule::least) return run_extremes<T, true>(run);
    if constexpr (std::is_floating_point_v<T>) run_sums<T>(run);
}

/// The share of samples that are scattered, as far as the statistics tell.
double scattered_share(const PassAsk& ask) {
    const Scene& scene = ask.scene;
    const double skipped = ask.of.of_sum()                               ? 0
                           : ask.of.rule == Neighbourhood::Rule::largest ? scene.low
                                                                         : scene.high;
    return scene.commonest == skipped ? scene.occupied_fraction : 1;
}

}  // namespace

Transition filter_forward() {
    return filtering_edge({
        .name = "filter.forward",
        .source = "[W93] FIGURE 10, EQ 6-9",
        .refused = [](const PassAsk& ask) -> std::string {
            if (ask.of.rule == Neighbourhood::Rule::median)
                return "a median is neither a sum nor an extreme";
            if (ask.of.places() == 0 && !ask.of.of_sum()) return "no place of the kernel counts";
            return {};
        },
        .operations =
            [](const PassAsk& ask) {
                // One by one: vectors hold eight.
                constexpr double kAlone = 8, kLooked = 4;
                const double share = scattered_share(ask);
                if (ask.of.of_sum()) return kLooked + 2 * kAlone * share * double(ask.of.places());
                // A run of the kernel takes as long whatever the type.
                constexpr double kRun = 180, kSeen = 12;
                const double width = double(bytes_of(ask.type)) / sizeof(float);
                const double runs = double(height_runs<double>(ask.of).size());
                return (kSeen + share * kRun * runs) / width;
            },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_forward<decltype(sample)>(run); });
            },
        .trials = sum_trials,
        .factors = {{"", 3.5}},
    });
}

}  // namespace edgewise
