#include "transitions/filter/backward.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"

namespace edgewise {
namespace {

/// The places that count and their weights, for tiles of one shape.
template <class T>
struct Taps {
    SmallVector<std::ptrdiff_t> places;
    SmallVector<T> weights;

    Taps(const Neighbourhood& of, const TileShape& shape) {
        std::size_t at = 0;
        for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
            for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y)
                for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x, ++at) {
                    if (!of.counts(of.weights[at])) continue;
                    places.push_back(shape.place(x, y, z));
                    weights.push_back(static_cast<T>(of.weights[at]));
                }
    }
};

/// Whether sums go over a box, row by row, in which every place counts.
bool is_full_sum(const Neighbourhood& of) { return of.of_sum() && of.full(); }

/// Whether extremes are found by comparisons alone, of floating types too.
bool is_by_comparison(const Neighbourhood& of, bool finite) {
    return !of.of_sum() && of.flat() && finite;
}

Extent tile_of(const Neighbourhood& of, const Extent& whole, std::size_t bytes) {
    Extent tile = tile_for(of, whole, bytes);
    if (!is_full_sum(of) || whole.z > 1) return tile;
    // So many rows of samples as are read at once suit the nearest cache.
    tile.x = std::min<std::int64_t>(384, whole.x);
    tile.y = std::min<std::int64_t>(64, whole.y);
    return tile;
}

template <class T>
void run_full_sum(const PassRun& run) {
    const TileShape shape(run.of, tile_of(run.of, run.in.extent, sizeof(T)));
    const SmallVector<T> weights(run.of.weights.begin(), run.of.weights.end());
    const Extent n = run.of.extent();
    const kernels::WeightBox<T> box{weights.data(), n.x, n.y, n.z};
    run_tiles<T>(
        run, shape,
        [&](const Tile<T>& tile) {
            for (std::int64_t z = 0; z < tile.extent.z; ++z)
                kernels::sum_rows(tile.first(run.of) + z * tile.shape.slice, tile.shape.row,
                                  tile.shape.slice, box, tile.out_row(0, z), tile.row,
                                  tile.extent.x, tile.extent.y);
        },
        TileReads::in_place_but_frames);
}

template <class T>
void run_taps(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Taps<T> of_copies(run.of, shape), in_place(run.of, {run.of, shape.tile, run.in});
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    // Heights and NaN take more than comparisons.
    const bool by_comparison = is_by_comparison(run.of, run.finite);
    const auto work = [&](const Tile<T>& tile) {
        const Taps<T>& taps = &tile.shape == &shape ? of_copies : in_place;
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y) {
                const T* in = tile.in_row(y, z);
                T* out = tile.out_row(y, z);
                const std::int64_t n = tile.extent.x;
                const std::size_t count = taps.places.size();
                if constexpr (std::is_floating_point_v<T>) {
                    if (by_comparison)
                        kernels::extreme_row(in, taps.places.data(), count, least, out, n);
                    else if (run.of.of_sum())
                        kernels::sum_row(in, taps.places.data(), taps.weights.data(), count, false,
                                         out, n);
                    else
                        kernels::grey_row(in, taps.places.data(), taps.weights.data(), count, least,
                                          out, n);
                } else {
                    kernels::extreme_row(in, taps.places.data(), count, least, out, n);
                }
            }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place_but_frames);
}

template <class T>
void run_backward(const PassRun& run) {
    if constexpr (std::is_floating_point_v<T>)
        if (is_full_sum(run.of)) return run_full_sum<T>(run);
    run_taps<T>(run);
}

}  // namespace

Transition filter_backward() {
    return filtering_edge({
        .name = "filter.backward",
        .source = "[W93] FIGURE 10, EQ 6-9",
        .refused = [](const PassAsk& ask) -> std::string {
            if (ask.of.rule == Neighbourhood::Rule::median)
                return "a median is neither a sum nor an extreme";
            if (ask.of.places() == 0 && !ask.of.of_sum()) return "no place of the kernel counts";
            return {};
        },
        // Each place is read, multiplied and added, or compared.
        .operations =
            [](const PassAsk& ask) {
                const double reads = is_full_sum(ask.of) ? 0.25 : 1;  // four rows share them
                const bool compares =
                    is_integer(ask.type) || is_by_comparison(ask.of, ask.scene.non_finite == 0);
                // Else two sums, a comparison, which of both are NaN, and which counts.
                const double each = ask.of.of_sum() ? 2 + reads : compares ? 2 : 8;
                return each * double(ask.of.places());
            },
        .in_place = true,
        .variant = [](const PassAsk& ask) -> std::string_view {
            return is_full_sum(ask.of) ? "rows" : "";
        },
        .scratch =
            [](const PassAsk& ask) {
                const std::size_t bytes = bytes_of(ask.type);
                const TileShape shape(ask.of, tile_of(ask.of, ask.from.extent, bytes));
                return 2 * static_cast<double>(shape.values() + 2 * kernels::kRowStep) *
                       static_cast<double>(bytes);
            },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_backward<decltype(sample)>(run); });
            },
        .trials = sum_and_extreme_trials,
        .factors = {{"", 0.82}, {"/rows", 0.41}},
    });
}

}  // namespace edgewise
