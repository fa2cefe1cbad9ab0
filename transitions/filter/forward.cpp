#include "transitions/filter/forward.hpp"

#include <algorithm>
#include <vector>

#include "transitions/filter/filtering_edge.hpp"

namespace edgewise {
namespace {

/// Places of a row of the kernel from the first to the last that counts.
template <class T>
struct WeightRow {
    std::int64_t x, y, z;    // the first, counted from the sample that is read
    std::vector<T> weights;  // 0 where none counts
    bool full = true;        // all count
};

template <class T>
std::vector<WeightRow<T>> weight_rows(const Neighbourhood& of) {
    std::vector<WeightRow<T>> rows;
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

template <class T>
void run_forward(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const std::vector<WeightRow<T>> rows = weight_rows<T>(run.of);
    const Extent reach = run.of.extent();
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y) std::fill_n(tile.out_row(y, z), n.x, T{});
        const T* first = tile.first(run.of);
        for (std::int64_t z = 0; z < n.z + reach.z - 1; ++z)
            for (std::int64_t y = 0; y < n.y + reach.y - 1; ++y) {
                const T* from = first + y * shape.row + z * shape.slice;
                for (std::int64_t x = 0; x < n.x + reach.x - 1; ++x) {
                    if (from[x] == 0) continue;
                    for (const WeightRow<T>& row : rows)
                        scatter(row, from[x],
                                {x + run.of.low[0], y + run.of.low[1], z + run.of.low[2]}, tile);
                }
            }
    });
}

}  // namespace

Transition filter_forward() {
    return filtering_edge({
        .name = "filter.forward",
        .source = "[W93] FIGURE 10, EQ 6-9",
        .refused = [](const PassAsk& ask) -> std::string {
            return ask.of.of_sum() ? "" : "what samples scatter is added up; extremes are gathered";
        },
        .operations =
            [](const PassAsk& ask) {
                // One by one: vectors hold eight.
                constexpr double kAlone = 8, kLooked = 4;
                const bool sparse = ask.scene.commonest == 0;
                const double share = sparse ? ask.scene.occupied_fraction : 1;
                return kLooked + 2 * kAlone * share * double(ask.of.places());
            },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_forward<double>(run);
                else
                    run_forward<float>(run);
            },
    });
}

}  // namespace edgewise
