#include "transitions/filter/recursive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <vector>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/waves.hpp"

namespace edgewise {
namespace {

using kernels::kWaveLines;

/// Responses amplitude x pole^n to an impulse n samples ago, of which the real parts are added.
struct GaussWaves {
    std::array<std::complex<double>, kernels::kWaves> pole, amplitude;

    /// Deriche's fit of fourth order, scaled so that all weights sum to 1.
    explicit GaussWaves(double sigma) {
        using namespace std::complex_literals;
        constexpr std::array<std::array<double, 4>, kernels::kWaves> kFit = {
            {{1.6800, 3.7350, 1.7830, 0.6318}, {-0.6803, -0.2598, 1.7230, 1.9970}}};
        for (std::size_t w = 0; w < pole.size(); ++w) {
            const auto [cosine, sine, decay, turn] = kFit[w];
            // cosine x cos + sine x sin of an angle: the real part of this times exp(i angle).
            amplitude[w] = cosine - sine * 1.0i;
            pole[w] = std::exp((-decay + turn * 1.0i) / sigma);
        }
        double sum = -at(0);
        for (std::size_t w = 0; w < pole.size(); ++w)
            sum += 2 * (amplitude[w] / (1.0 - pole[w])).real();
        for (auto& each : amplitude) each /= sum;
    }
    /// The weight of a sample n places away.
    double at(std::int64_t n) const {
        double weight = 0;
        for (std::size_t w = 0; w < pole.size(); ++w)
            weight += (amplitude[w] * std::pow(pole[w], static_cast<double>(n))).real();
        return weight;
    }
    kernels::Waves in_f32() const {
        kernels::Waves waves;
        for (std::size_t w = 0; w < pole.size(); ++w) {
            const std::complex<double> settled = amplitude[w] / (1.0 - pole[w]);
            waves.pole_real[w] = static_cast<float>(pole[w].real());
            waves.pole_imaginary[w] = static_cast<float>(pole[w].imag());
            waves.real[w] = static_cast<float>(amplitude[w].real());
            waves.imaginary[w] = static_cast<float>(amplitude[w].imag());
            waves.settled_real[w] = static_cast<float>(settled.real());
            waves.settled_imaginary[w] = static_cast<float>(settled.imag());
        }
        return waves;
    }
};

/// The sum of |difference| of the two kernels along one axis.
double difference_of(double sigma) {
    const Stencil exact = Stencil::gauss(sigma, 1);
    const GaussWaves waves(sigma);
    const std::int64_t radius = exact.centre()[0];
    double all = 0;
    // Far out the waves are below all that f64 tells.
    for (std::int64_t n = -8 * radius - 8; n <= 8 * radius + 8; ++n) {
        const double weight = std::abs(n) <= radius ? exact.at(n + radius, 0, 0) : 0;
        all += std::abs(waves.at(std::abs(n)) - weight);
    }
    return all;
}

std::string not_recursive(const PassAsk& ask) {
    if (!ask.of.of_sum() || ask.of.shape != Stencil::Shape::gauss)
        return "the kernel is no Gaussian";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} values are not finite, and recursions would never lose them",
                           ask.scene.non_finite);
    return {};
}

/// A box of values, which is filtered along one axis after another, in place.
struct Values {
    float* first;
    Extent n;
    std::array<std::int64_t, 3> step;
};

void filter_along(int axis, const Values& values, const kernels::Waves& waves,
                  std::pmr::memory_resource* memory) {
    const auto k = static_cast<std::size_t>(axis);
    const std::int64_t n = values.n[axis], step = values.step[k];
    kernels::Block<float> in(static_cast<std::size_t>(n * kWaveLines), memory),
        out(static_cast<std::size_t>(n * kWaveLines), memory);
    const std::size_t side = axis == 0 ? 1 : 0, other = axis == 2 ? 1 : 2;
    const std::int64_t apart = values.step[side];
    for (std::int64_t b = 0; b < values.n[static_cast<int>(other)]; ++b)
        for (std::int64_t a = 0; a < values.n[static_cast<int>(side)]; a += kWaveLines) {
            float* at = values.first + a * apart + b * values.step[other];
            const std::int64_t lines = std::min(kWaveLines, values.n[static_cast<int>(side)] - a);
            for (std::int64_t i = 0; i < n; ++i) {
                float* to = in.data() + i * kWaveLines;
                for (std::int64_t l = 0; l < lines; ++l) to[l] = at[i * step + l * apart];
                for (std::int64_t l = lines; l < kWaveLines; ++l) to[l] = to[lines - 1];
            }
            kernels::waves_forward(waves, in.data(), out.data(), n);
            kernels::waves_backward(waves, in.data(), out.data(), n);
            for (std::int64_t i = 0; i < n; ++i) {
                const float* from = out.data() + i * kWaveLines;
                for (std::int64_t l = 0; l < lines; ++l) at[i * step + l * apart] = from[l];
            }
        }
}

template <class T>
void run_recursive(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const kernels::Waves waves = GaussWaves(run.of.size).in_f32();
    const Extent reach = run.of.extent();
    const auto work = [&](const Tile<T>& tile) {
        const Extent n{tile.extent.x + reach.x - 1, tile.extent.y + reach.y - 1,
                       tile.extent.z + reach.z - 1};
        kernels::Block<float> values(static_cast<std::size_t>(n.samples()), tile.memory);
        const T* first = tile.first(run.of);
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x)
                    values[static_cast<std::size_t>(x + n.x * (y + n.y * z))] =
                        static_cast<float>(first[x + y * tile.shape.row + z * tile.shape.slice]);
        for (int axis = 0; axis < 3; ++axis)
            if (reach[axis] > 1)
                filter_along(axis, {values.data(), n, {1, n.x, n.x * n.y}}, waves, tile.memory);
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y)
                for (std::int64_t x = 0; x < tile.extent.x; ++x)
                    tile.out_row(y, z)[x] = static_cast<T>(values[static_cast<std::size_t>(
                        x - run.of.low[0] +
                        n.x * (y - run.of.low[1] + n.y * (z - run.of.low[2])))]);
    };
    run_tiles<T>(run, shape, work, TileReads::in_place);
}

}  // namespace

Transition filter_recursive() {
    return filtering_edge({
        .name = "filter.recursive",
        .source = "Deriche 1993",
        .refused = not_recursive,
        .operations =
            [](const PassAsk& ask) {
                const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
                const Extent reach = ask.of.extent();
                double axes = 0, margin = 1;
                for (int axis = 0; axis < 3; ++axis) {
                    axes += reach[axis] > 1;
                    margin *= 1 + double(reach[axis] - 1) / double(tile[axis]);
                }
                // Waves are in f32, whatever the samples are.
                const double wide = 4 / double(bytes_of(ask.type));
                return 36 * wide * axes * margin;
            },
        .error = [](const PassAsk& ask) -> Error {
            int axes = 0;
            for (int axis = 0; axis < 3; ++axis) axes += ask.of.extent()[axis] > 1;
            const double largest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high));
            // Both kernels sum to 1: only what differs from the middle of the range counts. A wave
            // remembers the rounding of some sigma samples; f32, with the tenfold of what a sum of
            // their squares has, since amplitudes cancel.
            return {
                .bias = 0.5 * axes * difference_of(ask.of.size) * (ask.scene.high - ask.scene.low),
                .noise = 10 * 0x1p-24 * largest * std::sqrt(axes * std::max(1.0, ask.of.size))};
        },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_recursive<double>(run);
                else
                    run_recursive<float>(run);
            },
        .trials = sum_trials,
        .factors = {{"", 1.3}},
    });
}

}  // namespace edgewise
