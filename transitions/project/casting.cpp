#include "transitions/project/casting.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

constexpr int kPackets = 96;
constexpr std::int64_t kSide = 4;  // pixels of a packet, about as many as the kernel steps together

struct Counted {
    double all = 0, taken = 0, bricks = 0;
};

/// One packet, whose corner is pixel (x, y).
Counted count(kernels::RayCast cast, const kernels::Bricks& bricks, std::int64_t x, std::int64_t y,
              std::int64_t width, std::int64_t height) {
    std::array<float, kSide * kSide * 4> pixels;
    Counted counted;
    for (std::int64_t j = 0; j < height; ++j)
        for (std::int64_t i = 0; i < width; ++i)
            counted.all +=
                ray_path(cast, static_cast<double>(x + i), static_cast<double>(y + j)).length;
    std::int64_t taken = 0;
    cast.taken = &taken;
    ray_cast(cast, x, y, width, height, pixels.data(), width * 4);
    counted.taken = static_cast<double>(taken);
    taken = 0;
    cast.bricks = &bricks;
    ray_cast(cast, x, y, width, height, pixels.data(), width * 4);
    counted.bricks = static_cast<double>(taken);
    return counted;
}

}  // namespace

void measure_casting(const Data& input, const Request& want, std::map<std::string, double>& facts,
                     std::pmr::memory_resource* memory) {
    const bool leaves_out = want.mode == Mode::mip || want.mode == Mode::composite;
    if (want.job != Job::render || !leaves_out || want.axes != 3) return;
    const kernels::Optics optics = optics_of(want, input.what.values);
    kernels::RayCast cast{.volume = kernels::grid_of(input),
                          .hold = kernels::Hold::zoh,
                          .rule = combine_of(want.mode),
                          .optics = &optics,
                          .bound = kTerminated};
    const auto bricks =
        bricks_of(cast.volume, want.mode == Mode::composite ? &optics : nullptr, memory, nullptr);
    // Spread evenly (Roberts 2018).
    constexpr std::array<double, 3> ratio = {0.8191725, 0.6710436, 0.5497005};
    Counted sum;
    double pixels = 0;
    for (int packet = 0; packet < kPackets; ++packet) {
        const auto at = [&](int axis, std::int64_t range) {
            return static_cast<std::int64_t>(std::fmod(0.5 + ratio[axis] * (packet + 1), 1.0) *
                                             static_cast<double>(range));
        };
        const int view = static_cast<int>(at(2, want.frames));
        cast.rays = rays_of(input.what, want, view, -0.5);
        const std::int64_t x = at(0, want.screen.x) / kSide * kSide,
                           y = at(1, want.screen.y) / kSide * kSide;
        const std::int64_t width = std::min(kSide, want.screen.x - x),
                           height = std::min(kSide, want.screen.y - y);
        const Counted counted = count(cast, *bricks, x, y, width, height);
        sum.all += counted.all;
        sum.taken += counted.taken;
        sum.bricks += counted.bricks;
        pixels += static_cast<double>(width * height);
    }
    facts["cast/all"] = sum.all / pixels;
    facts["cast/taken"] = sum.taken / pixels;
    facts["cast/bricks"] = sum.bricks / pixels;
}

}  // namespace edgewise
