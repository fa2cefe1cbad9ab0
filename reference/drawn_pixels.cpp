#include "reference/drawn_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <tbb/parallel_for.h>
#include <tuple>

#include "reference/jumps.hpp"
#include "reference/preview_short.hpp"

namespace edgewise {
namespace {

// Pixels that are looked at: so many, or fewer as their rays together are so long [unit].
constexpr double kFewestLooked = 1024, kMostLooked = 6144;
constexpr double kLookedLength = 6144 * 160.0;
constexpr double kTries = 16 * kMostLooked;
constexpr double kGlanced = 4;  // times as many are asked for their rays: where few meet the input
constexpr double kEven = 0.5;   // of the draws

/// Roots of how far each cast is off, in terms of all: what is left of squares after a regression
/// grows with them.
std::vector<double> roughness_of(std::span<const DrawnPixels::Looked> looked) {
    std::vector<double> rough(looked.size(), 0);
    for (std::size_t cast = 0; cast < RayLook::kCasts; ++cast) {
        double sum = 0;
        for (const auto& [at, look] : looked) sum += look.squares[cast];
        for (std::size_t i = 0; i < rough.size() && sum > 0; ++i)
            rough[i] += looked[i].look.squares[cast] / sum;
    }
    for (double& value : rough) value = std::sqrt(value);
    return rough;
}

}  // namespace

// Those that would be drawn more often than once are certain, and leave the others more.
std::vector<double> expected_draws(std::span<const double> rough, double draws) {
    std::vector<double> share(rough.size()), expected(rough.size(), 0);
    const double sum = std::accumulate(rough.begin(), rough.end(), 0.0);
    const double even = 1 / static_cast<double>(rough.size());
    for (std::size_t i = 0; i < rough.size(); ++i)
        share[i] = sum > 0 ? kEven * even + (1 - kEven) * rough[i] / sum : even;
    double left = draws, rest = 1;  // of draws, and of shares, for those that are not certain
    for (bool again = true; again && rest > 0;) {
        again = false;
        const double scale = left / rest;
        for (std::size_t i = 0; i < rough.size(); ++i)
            if (expected[i] < 1 && share[i] * scale >= 1) {
                expected[i] = 1;
                left -= 1;
                rest -= share[i];
                again = true;
            }
    }
    for (std::size_t i = 0; i < rough.size(); ++i)
        if (expected[i] < 1) expected[i] = std::clamp(share[i] * left / rest, 0.0, 1.0);
    return expected;
}

std::array<Auxiliary, RayLook::kCasts> DrawnPixels::auxiliaries() const {
    std::array<Auxiliary, RayLook::kCasts> known;
    std::vector<double> squares(looked.size());
    for (std::size_t cast = 0; cast < known.size(); ++cast) {
        for (std::size_t i = 0; i < looked.size(); ++i) squares[i] = looked[i].look.squares[cast];
        known[cast] = Auxiliary::over(squares, pixels);
    }
    return known;
}

std::vector<OutputSample> some_of(std::span<const OutputSample> from, std::size_t most) {
    std::vector<OutputSample> some(std::min(from.size(), most));
    for (std::size_t i = 0; i < some.size(); ++i)
        some[i] = from[(2 * i + 1) * from.size() / (2 * some.size())];
    return some;
}

namespace {

/// Neighbours of a list of pixels, that are drawn together.
struct Neighbours {
    OutputSample corner;
    double count = 0, rough = 0;  // rough: of all together
};

/// In order of views and rows. @param rough  of each pixel, or none
std::vector<Neighbours> cells_of(std::span<const OutputSample> from, std::span<const double> rough,
                                 int side) {
    const auto corner_of = [side](const OutputSample& at) {
        return OutputSample{at.view, at.x / side * side, at.y / side * side, 0};
    };
    const auto key = [&](std::size_t i) {
        const OutputSample corner = corner_of(from[i]);
        return std::tuple(corner.view, corner.y, corner.x);
    };
    std::vector<std::size_t> order(from.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    std::vector<Neighbours> cells;
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i == 0 || key(order[i - 1]) < key(order[i]))
            cells.push_back({.corner = corner_of(from[order[i]])});
        ++cells.back().count;
        if (!rough.empty()) cells.back().rough += rough[order[i]];
    }
    return cells;
}

}  // namespace

DrawnPixels draw_rough(const Request& want, const ReferenceField& field,
                       const ViewGeometry& geometry, std::span<const OutputSample> from,
                       double draws, int side) {
    DrawnPixels pixels;
    std::vector<Neighbours> cells = cells_of(from, {}, side);
    // Neighbours of which more are in the list stand for more.
    const double mean = static_cast<double>(from.size()) / static_cast<double>(cells.size());
    if (static_cast<double>(cells.size()) <= draws) {
        for (const Neighbours& cell : cells)
            pixels.drawn.push_back({.corner = cell.corner, .weight = cell.count / mean});
        return pixels;
    }
    pixels.looked.resize(from.size());
    tbb::parallel_for(std::size_t{0}, from.size(), [&](std::size_t i) {
        pixels.looked[i] = {from[i], look_at(*geometry.ray(from[i]), want, field)};
    });
    if (want.mode->threshold) {
        std::vector<RayLook> looks;
        for (const DrawnPixels::Looked& looked : pixels.looked) looks.push_back(looked.look);
        pixels.nearby = nearby_of(looks, lowered_by(want));
        for (DrawnPixels::Looked& looked : pixels.looked) count_nearby(looked.look, pixels.nearby);
    }
    cells = cells_of(from, roughness_of(pixels.looked), side);
    std::vector<double> rough;
    for (const Neighbours& cell : cells) rough.push_back(cell.rough);
    for (const auto& [place, chance, weight] : draw_in_proportion(rough, draws))
        pixels.drawn.push_back({.corner = cells[place].corner,
                                .weight = weight * cells[place].count / mean,
                                .chance = chance});
    return pixels;
}

std::vector<RoughDraw> draw_in_proportion(std::span<const double> rough, double draws) {
    // At equal distances along the sorted ones, so that rough and smooth are met in proportion.
    std::vector<std::size_t> order(rough.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return rough[a] < rough[b]; });
    std::vector<double> sorted;
    for (const std::size_t place : order) sorted.push_back(rough[place]);
    const std::vector<double> expected = expected_draws(sorted, draws);
    std::vector<RoughDraw> drawn;
    double passed = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const double before = std::floor(passed + 0.5);
        passed += expected[i];
        if (std::floor(passed + 0.5) > before)
            drawn.push_back({order[i], expected[i],
                             draws / (static_cast<double>(sorted.size()) * expected[i])});
    }
    return drawn;
}

namespace {

/// Pixels with rays that are not short, spread evenly over views and pixels.
struct Met {
    std::vector<OutputSample> at;
    double reach = 0, tries = 0;  // reach: how long their rays together are [unit]

    void meet(const OutputSample& pixel, const Request& want, const ViewGeometry& geometry) {
        ++tries;
        const std::optional<RaySpan> ray = geometry.ray(pixel);
        if (!ray || ShortRays::class_of(*ray, want) != ShortRays::kClasses) return;
        at.push_back(pixel);
        reach += ray->high - ray->low;
    }
};

/// By the additive recurrence of the generalised golden ratio in two dimensions (Roberts 2018). In
/// three its first two have a relation, 35 pixels long, and leave stripes of one view unseen.
Met meet_some(const Request& want, const ViewGeometry& geometry, double times) {
    constexpr std::array<double, 3> ratio = {0.7548776662466927, 0.5698402909980532,
                                             std::numbers::e - 2};
    Met met;
    const auto looked = [&] { return static_cast<double>(met.at.size()); };
    while (met.tries < kTries * times && looked() < kMostLooked * times &&
           (looked() < kFewestLooked * std::min(1.0, times) || met.reach < kLookedLength * times)) {
        std::array<double, 3> u;
        for (int axis = 0; axis < 3; ++axis)
            u[axis] = std::fmod(0.5 + ratio[axis] * (met.tries + 1), 1.0);
        met.meet({static_cast<int>(u[2] * want.frames),
                  static_cast<std::int64_t>(u[0] * static_cast<double>(want.screen.x)),
                  static_cast<std::int64_t>(u[1] * static_cast<double>(want.screen.y)), 0},
                 want, geometry);
    }
    return met;
}

Met meet_all(const Request& want, const ViewGeometry& geometry) {
    Met met;
    for (int view = 0; view < want.frames; ++view)
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x)
                met.meet({view, x, y, 0}, want, geometry);
    return met;
}

}  // namespace

DrawnPixels draw_pixels(const Request& want, const ReferenceField& field,
                        const ViewGeometry& geometry, int fewest, int most, double length, int side,
                        double times) {
    const double all = static_cast<double>(want.screen.x * want.screen.y) * want.frames;
    const double looks = kMostLooked * times;
    const auto too_many = [&](const Met& met) {
        return all > looks &&
               (static_cast<double>(met.at.size()) > looks || met.reach > kLookedLength * times);
    };
    const bool few = all <= kGlanced * looks;
    Met met = few ? meet_all(want, geometry) : meet_some(want, geometry, times);
    if (few && too_many(met)) met = meet_some(want, geometry, times);
    const auto count = static_cast<double>(met.at.size());
    const double draws = std::clamp(std::ceil(length * count / std::max(met.reach, 1e-9)),
                                    static_cast<double>(fewest), static_cast<double>(most));
    DrawnPixels pixels = draw_rough(want, field, geometry, met.at, draws * times, side);
    pixels.pixels = all * count / std::max(1.0, met.tries);
    return pixels;
}

}  // namespace edgewise
