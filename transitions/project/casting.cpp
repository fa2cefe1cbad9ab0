#include "transitions/project/casting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "graph/picture_facts.hpp"
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
    double all = 0;          // samples inside the data, of all rays
    kernels::Taken plain{};  // without bricks
    kernels::Taken bricks{};
};

/// One packet, whose corner is pixel (x, y), is added to what was counted.
void count(kernels::RayCast cast, const kernels::Bricks& bricks, std::int64_t x, std::int64_t y,
           std::int64_t width, std::int64_t height, Counted& counted) {
    std::array<float, kSide * kSide * 4> pixels;
    for (std::int64_t j = 0; j < height; ++j)
        for (std::int64_t i = 0; i < width; ++i)
            counted.all +=
                ray_path(cast, static_cast<double>(x + i), static_cast<double>(y + j)).length;
    cast.taken = &counted.plain;
    ray_cast(cast, x, y, width, height, pixels.data(), width * 4);
    cast.taken = &counted.bricks;
    cast.bricks = &bricks;
    ray_cast(cast, x, y, width, height, pixels.data(), width * 4);
}

}  // namespace

void measure_casting(const Data& input, const Request& want, std::map<std::string, double>& facts,
                     std::pmr::memory_resource* memory) {
    const ModeTraits::Levels levels = want.mode->skips;
    if (!want.job->of_rays() || want.deformed() || levels == ModeTraits::Levels::none ||
        want.axes != 3)
        return;
    const kernels::Optics optics = optics_of(want, input.what.values);
    kernels::Optics counting = optics;
    // So that opacities of whole cells are corrected too.
    if (counting.unit == 1) counting.unit = 1 + 1e-6;
    kernels::RayCast cast{.volume = rule_grid(input, want),
                          .hold = kernels::Hold::zoh,
                          .rule = want.mode->combine,
                          .level = want.level(),
                          .optics = &counting,
                          .bound = kTerminated};
    const auto bricks = bricks_beside(
        input, cast.volume, {.optics = levels == ModeTraits::Levels::opacities ? &optics : nullptr},
        memory, nullptr);
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
        const std::optional<kernels::Kept> kept = kept_of(input.what, want, view);
        cast.kept = kept ? &*kept : nullptr;
        const std::int64_t x = at(0, want.screen.x) / kSide * kSide,
                           y = at(1, want.screen.y) / kSide * kSide;
        const std::int64_t width = std::min(kSide, want.screen.x - x),
                           height = std::min(kSide, want.screen.y - y);
        count(cast, *bricks, x, y, width, height, sum);
        pixels += static_cast<double>(width * height);
    }
    const auto share = [](std::int64_t part, double whole) {
        return whole > 0 ? static_cast<double>(part) / whole : 0;
    };
    facts[kCastAll] = sum.all / pixels;
    facts[kCastTaken] = share(sum.plain.samples, pixels);
    facts[kCastBricks] = share(sum.bricks.samples, pixels);
    if (!want.mode->takes_transfer) return;
    facts[kCastCorrected] = share(sum.plain.corrected, sum.all);
    facts[kCastCorrectedEnds] =
        share(sum.plain.corrected_ends, static_cast<double>(sum.plain.ends));
}

}  // namespace edgewise
