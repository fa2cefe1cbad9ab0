// What reading lanes one by one brings against the processor's gathers (slow_gathers.hpp): one
// thread, both ways in turns, and whether their bytes are the same.
//   gathers_benchmark [ROUNDS]
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/slow_gathers.hpp"

namespace {

using namespace edgewise;
using namespace edgewise::kernels;
using Clock = std::chrono::steady_clock;

struct Noise {
    std::vector<std::uint8_t> bytes;
    Grid grid;

    Noise(Type type, Extent extent)
        : bytes(static_cast<std::size_t>(extent.samples()) * bytes_of(type) + kSlack) {
        std::mt19937 random(5);
        if (type == Type::f32) {
            for (std::int64_t i = 0; i < extent.samples(); ++i) {
                const float value = static_cast<float>(random() % 256);
                std::memcpy(bytes.data() + 4 * i, &value, 4);
            }
        } else {
            for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        }
        grid = {.samples = bytes.data(), .type = type, .extent = extent, .values = {}};
    }
};

double milliseconds(const std::function<void()>& work) {
    const auto begin = Clock::now();
    work();
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

double median(std::vector<double> numbers) {
    std::sort(numbers.begin(), numbers.end());
    return numbers[numbers.size() / 2];
}

/// One line of the table. @param make  fills so many floats
void compare(const std::string& name, int rounds, std::int64_t floats,
             const std::function<void(float*)>& make) {
    std::array<std::vector<float>, 2> out;
    for (auto& each : out) each.resize(static_cast<std::size_t>(floats));
    std::array<std::vector<double>, 2> times;
    std::vector<double> ratios;
    for (int round = -1; round < rounds; ++round) {  // the first maps pages
        std::array<double, 2> took{};
        for (const int slow : {round & 1, 1 - (round & 1)}) {
            set_gathers_slow(slow == 1);
            took[static_cast<std::size_t>(slow)] =
                milliseconds([&] { make(out[static_cast<std::size_t>(slow)].data()); });
        }
        if (round < 0) continue;
        for (std::size_t way = 0; way < 2; ++way) times[way].push_back(took[way]);
        ratios.push_back(took[0] / took[1]);
    }
    const bool same =
        std::memcmp(out[0].data(), out[1].data(), static_cast<std::size_t>(floats) * 4) == 0;
    fmt::print("{:<36} {:>10.2f} {:>10.2f} {:>7.2f} {:>6}\n", name, median(times[0]),
               median(times[1]), median(ratios), same ? "yes" : "NO");
}

void compare_warp(const std::string& name, int rounds, Type type, Extent extent, Hold hold) {
    const Noise noise(type, extent);
    const double c = std::cos(0.5236), s = std::sin(0.5236);
    const bool image = extent.z == 1;
    const double turn[3][3] = {{c * c, c * s * s - s * c, c * s * c + s * s},
                               {s * c, s * s * s + c * c, s * s * c - c * s},
                               {-s, c * s, c * c}};
    const double flat[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
    Affine map{};
    for (int i = 0; i < 3; ++i) {
        const auto middle = [&](int axis) { return 0.5 * static_cast<double>(extent[axis] - 1); };
        double moved = middle(i);
        for (int k = 0; k < 3; ++k) {
            const double entry = image ? flat[i][k] : turn[k][i];
            map[static_cast<std::size_t>(4 * i + k)] = entry;
            moved -= entry * middle(k);
        }
        map[static_cast<std::size_t>(4 * i + 3)] = moved;
    }
    const BackwardWarp warp(noise.grid, map, hold, 0);
    const Region all{{0, 0, 0}, {extent.x, extent.y, extent.z}};
    const Extent tile = preferred_tile(extent);
    compare(name, rounds, extent.samples(), [&](float* out) {
        for (std::int64_t z = 0; z < extent.z; z += tile.z)
            for (std::int64_t y = 0; y < extent.y; y += tile.y)
                for (std::int64_t x = 0; x < extent.x; x += tile.x)
                    warp({.samples = out, .held = all},
                         {{x, y, z},
                          {std::min(x + tile.x, extent.x), std::min(y + tile.y, extent.y),
                           std::min(z + tile.z, extent.z)}});
    });
}

void compare_rays(const std::string& name, int rounds, Type type, std::int64_t side, Hold hold,
                  Combine rule) {
    const Noise noise(type, {side, side, side});
    const Optics optics = optics_of(
        std::array{OpticsPoint{0, 0, {0, 0, 0}}, OpticsPoint{255, 0.01, {1, 1, 1}}}, 1, {});
    const double ax = 0.35, ay = 0.52, cx = std::cos(ax), sx = std::sin(ax), cy = std::cos(ay),
                 sy = std::sin(ay);
    RayCast cast{.volume = noise.grid, .hold = hold, .rule = rule, .optics = &optics};
    cast.rays.origin.x = {cy, 0, -sy};
    cast.rays.origin.y = {sy * sx, cx, cy * sx};
    cast.rays.direction.base = {sy * cx, -sx, cy * cx};
    const double middle = 0.5 * static_cast<double>(side - 1);
    for (std::size_t i = 0; i < 3; ++i)
        cast.rays.origin.base[i] = middle * (1 - cast.rays.origin.x[i] - cast.rays.origin.y[i] -
                                             cast.rays.direction.base[i]);
    const std::int64_t channels = rule == Combine::over ? 4 : 1, tile = 64;
    compare(name, rounds, side * side * channels, [&](float* out) {
        for (std::int64_t y = 0; y < side; y += tile)
            for (std::int64_t x = 0; x < side; x += tile)
                ray_cast(cast, x, y, std::min(tile, side - x), std::min(tile, side - y),
                         out + (y * side + x) * channels, side * channels);
    });
}

}  // namespace

int main(int argc, char** argv) {
    const int rounds = argc > 1 ? std::atoi(argv[1]) : 21;
    fmt::print("{:<36} {:>10} {:>10} {:>7} {:>6}\n", "job", "gather [ms]", "loads [ms]", "ratio",
               "same");
    compare_warp("warp f32 2048^2, foh", rounds, Type::f32, {2048, 2048, 1}, Hold::foh);
    compare_warp("warp f32 2048^2, bspline3", rounds, Type::f32, {2048, 2048, 1}, Hold::bspline3);
    compare_warp("warp f32 128^3, foh", rounds, Type::f32, {128, 128, 128}, Hold::foh);
    compare_warp("warp f32 128^3, bspline3", rounds, Type::f32, {128, 128, 128}, Hold::bspline3);
    compare_warp("warp u8 256^3, foh", rounds, Type::u8, {256, 256, 256}, Hold::foh);
    compare_warp("warp u8 256^3, zoh", rounds, Type::u8, {256, 256, 256}, Hold::zoh);
    compare_rays("rays u8 256^3, foh, max", rounds, Type::u8, 256, Hold::foh, Combine::max);
    compare_rays("rays u8 256^3, foh, over", rounds, Type::u8, 256, Hold::foh, Combine::over);
    compare_rays("rays u8 256^3, zoh, sum", rounds, Type::u8, 256, Hold::zoh, Combine::sum);
    compare_rays("rays f32 128^3, foh, sum", rounds, Type::f32, 128, Hold::foh, Combine::sum);
    compare_rays("rays f32 128^3, bspline3, sum", rounds, Type::f32, 128, Hold::bspline3,
                 Combine::sum);
}
