#include "transitions/filter/van_herk.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

std::string not_by_van_herk(const PassAsk& ask) {
    if (ask.of.rule != Neighbourhood::Rule::largest && ask.of.rule != Neighbourhood::Rule::least)
        return "sums and medians are no extremes";
    if (!ask.of.flat() || !ask.of.full()) return "the kernel is no flat box";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite", ask.scene.non_finite);
    return {};
}

template <class T>
T extreme_of(T a, T b, bool least) {
    return least ? std::min(a, b) : std::max(a, b);
}

/// out[i] = the extreme_of of in[i .. i + length), one by one.
template <class T>
void along_row(const T* in, T* out, T* to_end, std::int64_t n, std::int64_t length, bool least) {
    const std::int64_t all = n + length - 1;
    for (std::int64_t block = 0; block < all; block += length) {
        const std::int64_t end = std::min(block + length, all);
        to_end[end - 1] = in[end - 1];
        for (std::int64_t i = end - 2; i >= block; --i)
            to_end[i] = extreme_of(in[i], to_end[i + 1], least);
    }
    for (std::int64_t block = 0; block < all; block += length) {
        const std::int64_t end = std::min(block + length, all);
        T from_start = in[block];
        for (std::int64_t i = block; i < end; ++i) {
            from_start = extreme_of(from_start, in[i], least);
            if (i >= length - 1)
                out[i - length + 1] = extreme_of(from_start, to_end[i - length + 1], least);
        }
    }
}

/// The same of `n + length - 1` rows that lie `step` apart, into n rows from the first on.
/// @param scratch  most + 1 rows of so many values, in the same array as all others
template <class T>
class AcrossRows {
 public:
    AcrossRows(T* scratch, std::int64_t most, std::int64_t row)
        : row_(row), to_end_(scratch), from_start_(scratch + most * row) {}

    void run(T* rows, std::int64_t step, std::int64_t n, std::int64_t length, std::int64_t wide,
             bool least) {
        if (length == 1) return;
        const std::int64_t all = n + length - 1;
        const auto both = [&](const T* a, const T* b, T* out) {
            const std::ptrdiff_t places[] = {0, b - a};
            kernels::extreme_row(a, places, 2, least, out, wide);
        };
        for (std::int64_t block = 0; block < all; block += length) {
            const std::int64_t end = std::min(block + length, all);
            std::copy_n(rows + (end - 1) * step, wide, to_end(end - 1));
            for (std::int64_t i = end - 2; i >= block; --i)
                both(rows + i * step, to_end(i + 1), to_end(i));
        }
        for (std::int64_t i = 0; i < all; ++i) {
            if (i % length == 0)
                std::copy_n(rows + i * step, wide, from_start_);
            else
                both(rows + i * step, from_start_, from_start_);
            if (i >= length - 1)
                both(to_end(i - length + 1), from_start_, rows + (i - length + 1) * step);
        }
    }

 private:
    T* to_end(std::int64_t i) { return to_end_ + i * row_; }
    std::int64_t row_;
    T* to_end_;
    T* from_start_;
};

template <class T>
void run_van_herk(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Extent reach = run.of.extent();
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        const std::int64_t rows = n.y + reach.y - 1, slices = n.z + reach.z - 1;
        const std::int64_t slice = tile.row * rows;
        const std::int64_t most = std::max(rows, slices);
        kernels::Block<T> values(
            static_cast<std::size_t>(slice * slices + (most + 1) * tile.row + kernels::kRowStep),
            tile.memory);
        kernels::Block<T> to_end(static_cast<std::size_t>(n.x + reach.x - 1), tile.memory);
        AcrossRows<T> across(values.data() + slice * slices, most, tile.row);
        const T* first = tile.first(run.of);
        for (std::int64_t z = 0; z < slices; ++z)
            for (std::int64_t y = 0; y < rows; ++y) {
                T* row = values.data() + y * tile.row + z * slice;
                along_row(first + y * shape.row + z * shape.slice, row, to_end.data(), n.x, reach.x,
                          least);
                // Whole vectors are read below.
                std::fill(row + n.x, row + tile.row, T{});
            }
        for (std::int64_t z = 0; z < slices; ++z)
            across.run(values.data() + z * slice, tile.row, n.y, reach.y, n.x, least);
        for (std::int64_t y = 0; y < n.y; ++y)
            across.run(values.data() + y * tile.row, slice, n.z, reach.z, n.x, least);
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                std::copy_n(values.data() + y * tile.row + z * slice, n.x, tile.out_row(y, z));
    });
}

}  // namespace

Transition filter_van_herk() {
    return filtering_edge({
        .name = "filter.van_herk",
        .source = "van Herk 1992; Gil and Werman 1993",
        .refused = not_by_van_herk,
        .operations =
            [](const PassAsk& ask) {
                const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
                const Extent reach = ask.of.extent();
                const double rows = (1 + double(reach.y - 1) / double(tile.y)) *
                                    (1 + double(reach.z - 1) / double(tile.z)),
                             slices = 1 + double(reach.z - 1) / double(tile.z);
                // Along rows, one by one: three comparisons, three reads, two writes and which they
                // are of. Across them each comparison of a vector is two reads and a write more.
                constexpr double kAlong = 10, kAcross = 3 * 4;
                return kAlong * ask.alone() * rows + kAcross * (reach.y > 1 ? slices : 0) +
                       kAcross * (reach.z > 1);
            },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_van_herk<decltype(sample)>(run); });
            },
        .trials = extreme_trials,
        .factors = {{"", 0.57}},
    });
}

}  // namespace edgewise
