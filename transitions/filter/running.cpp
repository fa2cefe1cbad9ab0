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
    // Sums are in f64, whatever the samples are; that along rows has no vectors.
    const double wide = 8 / double(bytes_of(ask.type)), alone = 6 * wide;
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
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        const std::int64_t wide = n.x + reach.x - 1, rows = n.y + reach.y - 1;
        // Sums over slices, of all padded rows; then over those rows, of one.
        kernels::Block<double> over_slices(static_cast<std::size_t>(wide * rows), tile.memory);
        kernels::Block<double> over_rows(static_cast<std::size_t>(wide), tile.memory);
        const T* first = tile.first(run.of);
        std::fill_n(over_slices.data(), wide * rows, 0.0);
        const auto add_slice = [&](std::int64_t z, double sign) {
            for (std::int64_t y = 0; y < rows; ++y)
                add_row(over_slices.data() + y * wide, first + y * shape.row + z * shape.slice,
                        sign, wide);
        };
        for (std::int64_t z = 0; z < reach.z - 1; ++z) add_slice(z, 1);
        for (std::int64_t z = 0; z < n.z; ++z) {
            add_slice(z + reach.z - 1, 1);
            std::fill_n(over_rows.data(), wide, 0.0);
            const auto row = [&](std::int64_t y) { return over_slices.data() + y * wide; };
            for (std::int64_t y = 0; y < reach.y - 1; ++y)
                add_row(over_rows.data(), row(y), 1, wide);
            for (std::int64_t y = 0; y < n.y; ++y) {
                add_row(over_rows.data(), row(y + reach.y - 1), 1, wide);
                double sum = 0;
                for (std::int64_t x = 0; x < reach.x - 1; ++x) sum += over_rows[std::size_t(x)];
                T* out = tile.out_row(y, z);
                for (std::int64_t x = 0; x < n.x; ++x) {
                    sum += over_rows[static_cast<std::size_t>(x + reach.x - 1)];
                    out[x] = static_cast<T>(sum);
                    sum -= over_rows[static_cast<std::size_t>(x)];
                }
                add_row(over_rows.data(), row(y), -1, wide);
            }
            add_slice(z, -1);
        }
    });
}

}  // namespace

Transition filter_running() {
    return filtering_edge({
        .name = "filter.running",
        .source = "McDonnell 1981",
        .refused = not_running,
        .operations = running_operations,
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_running<double>(run);
                else
                    run_running<float>(run);
            },
    });
}

}  // namespace edgewise
