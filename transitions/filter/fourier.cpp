#include "transitions/filter/fourier.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/filter/transformed.hpp"

namespace edgewise {
namespace {

double fourier_noise(const PassAsk& ask) {
    const Blocks blocks(ask.of, ask.from.extent);
    const double largest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high));
    return 0x1p-24 * std::log2(std::max(2.0, blocks.values())) * std::abs(ask.of.scale) *
           ask.of.sum_of_magnitudes() * largest;
}

bool of_integers(const PassAsk& ask) {
    return ask.of.sums_integers(ask.from.type, ask.from.values);
}

std::string not_by_fourier(const PassAsk& ask) {
    if (!ask.of.of_sum()) return "extremes and medians are no products of spectra";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite, and a transform would spread them over tiles",
                           ask.scene.non_finite);
    // A rounding error of four standard deviations must not reach the next integer.
    constexpr double kSure = 0.125;
    const double noise = fourier_noise(ask) / std::abs(ask.of.scale);
    if (of_integers(ask) && noise > kSure)
        return fmt::format("sums of integers would be off by {:.2g}, too much to round", noise);
    return {};
}

/// T: in which samples are handed over
template <class T>
void run_fourier(const PassRun& run) {
    const Blocks blocks(run.of, run.in.extent);
    const Transformed kernel(run.of, blocks.transform, false, run.context.memory);
    const TileShape shape(run.of, blocks.tile);
    const Extent size = blocks.transform;
    const bool rounds = run.of.sums_integers(run.in.type, run.in.values);
    const auto work = [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        kernels::Block<float> real(kernel.values(), tile.memory);
        kernels::Block<Complex> spectrum(kernel.frequencies(), tile.memory);
        fill_transform(
            tile, run.of, size, [](T sample) { return static_cast<float>(sample); }, real.data());
        kernel.apply(real.data(), spectrum.data());
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y) {
                const float* from = real.data() + size.x * (y + size.y * z);
                T* to = tile.out_row(y, z);
                for (std::int64_t x = 0; x < n.x; ++x)
                    to[x] =
                        rounds ? static_cast<T>(std::nearbyint(from[x])) : static_cast<T>(from[x]);
            }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place);
}

}  // namespace

Transition filter_fourier() {
    return filtering_edge({
        .name = "filter.fourier",
        .source = "[W93] 2.3; Stockham 1966",
        .refused = not_by_fourier,
        .operations =
            [](const PassAsk& ask) {
                // Transforms are in f32, whatever the samples are.
                const double f32 = 4 / double(bytes_of(ask.type));
                return f32 * transform_operations(Blocks(ask.of, ask.from.extent));
            },
        .lines =
            [](const PassAsk& ask) {
                return transform_lines({ask.of, ask.from.extent});
            },
        .in_place = true,
        // Transforms along lines that lie apart take longer than operations and lines tell.
        .variant = [](const PassAsk& ask) -> std::string_view {
            return ask.from.extent.z > 1 ? "volume" : "";
        },
        .scratch = [](const PassAsk& ask) { return Blocks(ask.of, ask.from.extent).scratch(); },
        .error = [](const PassAsk& ask) -> Error {
            return {.noise = of_integers(ask) ? 0 : fourier_noise(ask)};
        },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_fourier<double>(run);
                else
                    run_fourier<float>(run);
            },
        .trials = sum_trials,
        .factors = {{"", 2.3}, {"/volume", 4}},
    });
}

}  // namespace edgewise
