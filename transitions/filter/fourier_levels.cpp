#include "transitions/filter/fourier_levels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/filter/transformed.hpp"

namespace edgewise {
namespace {

constexpr double kMostLevels = 16;

double stored(const PassAsk& ask, double value) {
    return (value - ask.from.values.offset) / ask.from.values.slope;
}

double levels_in(const PassAsk& ask) {
    return stored(ask, ask.scene.high) - stored(ask, ask.scene.low);
}

std::string not_by_levels(const PassAsk& ask) {
    if (ask.of.of_sum()) return "a sum is one transform: filter.fourier";
    if (ask.of.places() == 0) return "no place of the kernel counts";
    if (ask.of.rule != Neighbourhood::Rule::median && !ask.of.flat())
        return "the kernel is not flat";
    if (!is_integer(ask.type) || !is_integer(ask.from.type)) return "samples are no integers";
    if (levels_in(ask) > kMostLevels)
        return fmt::format("{:.6g} levels, a transform each; at most {:.0f} are tried",
                           levels_in(ask), kMostLevels);
    if (ask.of.border == Border::zero && stored(ask, ask.scene.low) > 0)
        return "0 beyond the samples is below their lowest level";
    if (ask.of.border == Border::zero && stored(ask, ask.scene.high) < 0)
        return "0 beyond the samples is above their highest level";
    constexpr double kSure = 0.125;
    const double noise =
        0x1p-24 * std::log2(Blocks(ask.of, ask.from.extent).values()) * double(ask.of.places());
    if (noise > kSure) return fmt::format("counts would be off by {:.2g}", noise);
    return {};
}

/// So many places must reach a level for the result to reach it.
std::int64_t needed(const Neighbourhood& of) {
    const std::int64_t n = of.places();
    switch (of.rule) {
        case Neighbourhood::Rule::largest:
            return 1;
        case Neighbourhood::Rule::median:
            return n - (n - 1) / 2;
        case Neighbourhood::Rule::least:
        case Neighbourhood::Rule::sum:
            break;
    }
    return n;
}

template <class T>
void run_levels(const PassRun& run) {
    const Blocks blocks(run.of, run.in.extent);
    const Transformed kernel(run.of, blocks.transform, true, run.context.memory);
    const TileShape shape(run.of, blocks.tile);
    const Extent size = blocks.transform, reach = run.of.extent();
    const float enough = static_cast<float>(needed(run.of)) - 0.5f;
    const auto work = [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        kernels::Block<float> real(kernel.values(), tile.memory);
        kernels::Block<Complex> spectrum(kernel.frequencies(), tile.memory);
        T low = *tile.first(run.of), high = low;
        for (std::int64_t z = 0; z < n.z + reach.z - 1; ++z)
            for (std::int64_t y = 0; y < n.y + reach.y - 1; ++y) {
                const T* row = tile.first(run.of) + y * tile.shape.row + z * tile.shape.slice;
                const auto [least, most] = std::minmax_element(row, row + n.x + reach.x - 1);
                low = std::min(low, *least), high = std::max(high, *most);
            }
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y) std::fill_n(tile.out_row(y, z), n.x, low);
        for (std::int64_t level = std::int64_t{low} + 1; level <= std::int64_t{high}; ++level) {
            run.context.poll();
            fill_transform(
                tile, run.of, size,
                [level](T sample) { return std::int64_t{sample} >= level ? 1.0f : 0.0f; },
                real.data());
            kernel.apply(real.data(), spectrum.data());
            for (std::int64_t z = 0; z < n.z; ++z)
                for (std::int64_t y = 0; y < n.y; ++y) {
                    const float* counts = real.data() + size.x * (y + size.y * z);
                    T* out = tile.out_row(y, z);
                    for (std::int64_t x = 0; x < n.x; ++x)
                        if (counts[x] > enough) out[x] = static_cast<T>(level);
                }
        }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place);
}

}  // namespace

Transition filter_fourier_levels() {
    return filtering_edge({
        .name = "filter.fourier_levels",
        .source = "[W93] 2.3; threshold decomposition: Fitch, Coyle, Gallagher 1984",
        .refused = not_by_levels,
        .operations =
            [](const PassAsk& ask) {
                // Transforms are in f32, whatever the samples are.
                const double f32 = 4 / double(bytes_of(ask.type));
                return f32 * std::max(1.0, levels_in(ask)) *
                       transform_operations(Blocks(ask.of, ask.from.extent));
            },
        .scratch = [](const PassAsk& ask) { return Blocks(ask.of, ask.from.extent).scratch(); },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) {
                    using T = decltype(sample);
                    if constexpr (std::is_integral_v<T>) run_levels<T>(run);
                });
            },
        .trials = extreme_trials,
    });
}

}  // namespace edgewise
