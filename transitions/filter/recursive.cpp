#include "transitions/filter/recursive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <vector>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

constexpr int kWaves = 2;
constexpr std::int64_t kLines = 16;  // that go side by side

/// Responses amplitude x pole^n to an impulse n samples ago, of which the real parts are added.
struct Waves {
    std::array<std::complex<double>, kWaves> pole, amplitude;

    /// Deriche's fit of fourth order, scaled so that all weights sum to 1.
    explicit Waves(double sigma) {
        using namespace std::complex_literals;
        constexpr std::array<std::array<double, 4>, kWaves> kFit = {
            {{1.6800, 3.7350, 1.7830, 0.6318}, {-0.6803, -0.2598, 1.7230, 1.9970}}};
        for (std::size_t w = 0; w < kWaves; ++w) {
            const auto [cosine, sine, decay, turn] = kFit[w];
            // cosine x cos + sine x sin of an angle: the real part of this times exp(i angle).
            amplitude[w] = cosine - sine * 1.0i;
            pole[w] = std::exp((-decay + turn * 1.0i) / sigma);
        }
        double sum = -at(0);
        for (std::size_t w = 0; w < kWaves; ++w) sum += 2 * (amplitude[w] / (1.0 - pole[w])).real();
        for (auto& each : amplitude) each /= sum;
    }
    /// The weight of a sample n places away.
    double at(std::int64_t n) const {
        double weight = 0;
        for (std::size_t w = 0; w < kWaves; ++w)
            weight += (amplitude[w] * std::pow(pole[w], static_cast<double>(n))).real();
        return weight;
    }
};

/// The sum of |difference| of the two kernels along one axis.
double difference_of(double sigma) {
    const Stencil exact = Stencil::gauss(sigma, 1);
    const Waves waves(sigma);
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

/// Lines side by side: values [i * kLines + l] of line l.
class Recursion {
 public:
    explicit Recursion(const Waves& waves) : waves_(waves) {}

    /// out += what comes from before, the sample itself included, or (`backward`) from behind.
    void add(const double* in, double* out, std::int64_t n, bool backward) const {
        for (std::size_t w = 0; w < kWaves; ++w) {
            const double pr = waves_.pole[w].real(), pi = waves_.pole[w].imag();
            const double ar = waves_.amplitude[w].real(), ai = waves_.amplitude[w].imag();
            const std::complex<double> settled = waves_.amplitude[w] / (1.0 - waves_.pole[w]);
            const std::int64_t first = backward ? n - 1 : 0, step = backward ? -1 : 1;
            double real[kLines], imaginary[kLines];
            // As if the first sample had always been there.
            for (std::int64_t l = 0; l < kLines; ++l) {
                real[l] = settled.real() * in[first * kLines + l];
                imaginary[l] = settled.imag() * in[first * kLines + l];
            }
            for (std::int64_t k = 0, i = first; k < n; ++k, i += step) {
                const double* from = in + i * kLines;
                double* to = out + i * kLines;
                for (std::int64_t l = 0; l < kLines; ++l) {
                    const double r = pr * real[l] - pi * imaginary[l];
                    const double m = pr * imaginary[l] + pi * real[l];
                    // Backward the sample itself is left out: it has been counted.
                    if (backward) to[l] += r;
                    real[l] = r + ar * from[l];
                    imaginary[l] = m + ai * from[l];
                    if (!backward) to[l] += real[l];
                }
            }
        }
    }

 private:
    const Waves& waves_;
};

/// A box of values, which is filtered along one axis after another, in place.
struct Values {
    float* first;
    Extent n;
    std::array<std::int64_t, 3> step;
};

void filter_along(int axis, const Values& values, const Recursion& recursion,
                  std::pmr::memory_resource* memory) {
    const auto k = static_cast<std::size_t>(axis);
    const std::int64_t n = values.n[axis];
    kernels::Block<double> in(static_cast<std::size_t>(n * kLines), memory),
        out(static_cast<std::size_t>(n * kLines), memory);
    const std::size_t side = axis == 0 ? 1 : 0, other = axis == 2 ? 1 : 2;
    for (std::int64_t b = 0; b < values.n[static_cast<int>(other)]; ++b)
        for (std::int64_t a = 0; a < values.n[static_cast<int>(side)]; a += kLines) {
            float* at = values.first + a * values.step[side] + b * values.step[other];
            const std::int64_t lines = std::min(kLines, values.n[static_cast<int>(side)] - a);
            for (std::int64_t i = 0; i < n; ++i)
                for (std::int64_t l = 0; l < kLines; ++l)
                    in[static_cast<std::size_t>(i * kLines + l)] = static_cast<double>(
                        at[i * values.step[k] + std::min(l, lines - 1) * values.step[side]]);
            std::fill_n(out.data(), n * kLines, 0.0);
            recursion.add(in.data(), out.data(), n, false);
            recursion.add(in.data(), out.data(), n, true);
            for (std::int64_t i = 0; i < n; ++i)
                for (std::int64_t l = 0; l < lines; ++l)
                    at[i * values.step[k] + l * values.step[side]] =
                        static_cast<float>(out[static_cast<std::size_t>(i * kLines + l)]);
        }
}

template <class T>
void run_recursive(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Waves waves(run.of.size);
    const Recursion recursion(waves);
    const Extent reach = run.of.extent();
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n{tile.extent.x + reach.x - 1, tile.extent.y + reach.y - 1,
                       tile.extent.z + reach.z - 1};
        kernels::Block<float> values(static_cast<std::size_t>(n.samples()), tile.memory);
        const T* first = tile.first(run.of);
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x)
                    values[static_cast<std::size_t>(x + n.x * (y + n.y * z))] =
                        static_cast<float>(first[x + y * shape.row + z * shape.slice]);
        for (int axis = 0; axis < 3; ++axis)
            if (reach[axis] > 1)
                filter_along(axis, {values.data(), n, {1, n.x, n.x * n.y}}, recursion, tile.memory);
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y)
                for (std::int64_t x = 0; x < tile.extent.x; ++x)
                    tile.out_row(y, z)[x] = static_cast<T>(values[static_cast<std::size_t>(
                        x - run.of.low[0] +
                        n.x * (y - run.of.low[1] + n.y * (z - run.of.low[2])))]);
    });
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
                // Waves are in f64, whatever the samples are.
                const double wide = 8 / double(bytes_of(ask.type));
                return 36 * wide * axes * margin;
            },
        .error = [](const PassAsk& ask) -> Error {
            int axes = 0;
            for (int axis = 0; axis < 3; ++axis) axes += ask.of.extent()[axis] > 1;
            // Both kernels sum to 1: only what differs from the middle of the range counts.
            return {.bias =
                        0.5 * axes * difference_of(ask.of.size) * (ask.scene.high - ask.scene.low)};
        },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_recursive<double>(run);
                else
                    run_recursive<float>(run);
            },
    });
}

}  // namespace edgewise
