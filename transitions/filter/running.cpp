#include "transitions/filter/running.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

std::string not_running(const PassAsk& ask) {
    if (!ask.of.of_sum()) return "extremes and medians are no sums";
    const bool equal = ask.of.full() && std::all_of(ask.of.weights.begin(), ask.of.weights.end(),
                                                    [](double weight) { return weight == 1; });
    if (!equal) return "the weights of the kernel's box are not all equal";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite, and running sums would never lose them",
                           ask.scene.non_finite);
    return {};
}

double running_operations(const PassAsk& ask) {
    const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
    const Extent reach = ask.of.extent();
    // Sums are in f64, whatever the samples are: each takes a read, a conversion, an addition and a
    // write. That along rows has no vectors: two reads, a difference, an addition, a conversion, a
    // write.
    const double wide = 4 * 8 / double(bytes_of(ask.type)), alone = 6 * ask.alone();
    const double columns = 1 + double(reach.x - 1) / double(tile.x),
                 rows = 1 + double(reach.y - 1) / double(tile.y);
    const double across = 2 * wide * columns * (1 + rows * (reach.z > 1 ? 1 : 0));
    // The first sum of each tile has as many terms as the box.
    const double starts =
        wide * columns *
        (double(reach.y) / double(tile.y) + rows * double(reach.z - 1) / double(tile.z));
    return across + starts + alone;
}

/// sums += sign x a row.
template <class T>
void add_row(double* sums, const T* row, double sign, std::int64_t n) {
    for (std::int64_t i = 0; i < n; ++i) sums[i] += sign * static_cast<double>(row[i]);
}

template <class T>
void run_running(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Extent reach = run.of.extent();
    const auto work = [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        const std::int64_t wide = n.x + reach.x - 1, rows = n.y + reach.y - 1;
        // Sums over slices, of all padded rows; then over those rows, of one.
        const bool is_deep = reach.z > 1;
        kernels::Block<double> over_slices(static_cast<std::size_t>(is_deep ? wide * rows : 1),
                                           tile.memory);
        kernels::Block<double> over_rows(static_cast<std::size_t>(wide), tile.memory);
        const T* first = tile.first(run.of);
        if (is_deep) std::fill_n(over_slices.data(), wide * rows, 0.0);
        const auto add_slice = [&](std::int64_t z, double sign) {
            for (std::int64_t y = 0; y < rows; ++y)
                add_row(over_slices.data() + y * wide,
                        first + y * tile.shape.row + z * tile.shape.slice, sign, wide);
        };
        for (std::int64_t z = 0; z < reach.z - 1; ++z) add_slice(z, 1);
        for (std::int64_t z = 0; z < n.z; ++z) {
            if (is_deep) add_slice(z + reach.z - 1, 1);
            std::fill_n(over_rows.data(), wide, 0.0);
            const auto add = [&](std::int64_t y, double sign) {
                if (is_deep)
                    add_row(over_rows.data(), over_slices.data() + y * wide, sign, wide);
                else
                    add_row(over_rows.data(), first + y * tile.shape.row + z * tile.shape.slice,
                            sign, wide);
            };
            for (std::int64_t y = 0; y < reach.y - 1; ++y) add(y, 1);
            for (std::int64_t y = 0; y < n.y; ++y) {
                add(y + reach.y - 1, 1);
                const double* sums = over_rows.data();
                double sum = 0;
                for (std::int64_t x = 0; x < reach.x; ++x) sum += sums[x];
                T* out = tile.out_row(y, z);
                out[0] = static_cast<T>(sum);
                // Only one addition waits for the one before it.
                for (std::int64_t x = 1; x < n.x; ++x) {
                    sum += sums[x + reach.x - 1] - sums[x - 1];
                    out[x] = static_cast<T>(sum);
                }
                add(y, -1);
            }
            if (is_deep) add_slice(z, -1);
        }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place);
}

}  // namespace

Transition filter_running() {
    return filtering_edge({
        .name = "filter.running",
        .source = "McDonnell 1981",
        .refused = not_running,
        .operations = running_operations,
        .in_place = true,
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_running<double>(run);
                else
                    run_running<float>(run);
            },
        .trials = sum_trials,
    });
}

}  // namespace edgewise
