#include "graph/modes/surface.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "graph/request.hpp"

namespace edgewise {
namespace {

// state: 1 where the ray has met the surface; its light there; the first and the last value, less
// the level, NaN where there is none; where on the ray the last one is [t]. Samples that are not
// finite are outside: the surface is open there.

enum : std::size_t { kHit, kLight, kFirst, kLast, kLastAt };
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool is_passed(double before, double after) {
    return std::isfinite(before) && std::isfinite(after) && (before >= 0) != (after >= 0);
}

void take(Stretch& stretch, double above, double piece) {
    if (std::isnan(stretch.state[kFirst])) stretch.state[kFirst] = above;
    stretch.state[kLast] = std::isfinite(above) ? above : kNone;
    if (std::isfinite(above)) stretch.length += piece;
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    auto& state = stretch.state;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double above = values[i] - want.level();
        if (state[kHit] == 0 && is_passed(state[kLast], above)) state[kHit] = state[kLight] = 1;
        take(stretch, above, pieces[i]);
    }
}

/// A place where the field passes the level, by false position with halved ends (Dowell and
/// Jarratt 1971), which never leaves the interval.
double root_between(double a, double above_a, double b, double above_b, double level,
                    const std::function<double(double)>& value) {
    constexpr int kMost = 64;
    constexpr double kWithin = 1e-12;
    for (int i = 0; i < kMost && std::abs(b - a) > kWithin * (1 + std::abs(a)); ++i) {
        const double middle = b - above_b * (b - a) / (above_b - above_a);
        const double above = value(middle) - level;
        if (!std::isfinite(above)) break;
        if (above == 0) return middle;
        if ((above >= 0) != (above_b >= 0)) {
            a = b;
            above_a = above_b;
        } else {
            above_a /= 2;
        }
        b = middle;
        above_b = above;
    }
    return b;
}

void follow(Stretch& stretch, double t, double value, double piece, const AlongRay& along,
            const Request& want) {
    auto& state = stretch.state;
    const double above = value - want.level();
    if (state[kHit] == 0 && is_passed(state[kLast], above)) {
        const Lit lit = along.lit(
            root_between(state[kLastAt], state[kLast], t, above, want.level(), along.value));
        state[kHit] = 1;
        state[kLight] = lit.diffuse + lit.specular;
    }
    take(stretch, above, piece);
    state[kLastAt] = t;
}

}  // namespace

/// The first place of a ray where the field passes a level, whether it rises or falls: the surface
/// is open at the volume's faces and at those of a clip. White, lit by its gradient.
const ModeTraits surface_mode = {
    .name = "surface",
    .help = "first hit of --isovalue, lit",
    .combine = Combine::hit,
    .channels = 4,
    .over_background = true,
    .takes_level = true,
    .takes_light = true,
    .takes_cue = true,
    .shade = Shade::phong,
    .first_hit = true,
    .skips = ModeTraits::Levels::values,
    .kept = "the surface would end where samples were left out",
    .operations = 4,
    .timed_as = "mip",
    .guess = {0.15, 0.05, 0.03},
    .gain = [](bool noise, double, double, double range) { return (noise ? 1.0 : 3.0) / range; },
    .empty = [](Stretch& stretch) { stretch.state[kFirst] = stretch.state[kLast] = kNone; },
    .add = add,
    .follow = follow,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            auto& state = stretch.state;
            if (state[kHit] == 0) {
                const bool between = is_passed(state[kLast], behind.state[kFirst]);
                state[kHit] = between ? 1 : behind.state[kHit];
                state[kLight] = between ? 1 : behind.state[kLight];
            }
            if (std::isnan(state[kFirst])) state[kFirst] = behind.state[kFirst];
            if (!std::isnan(behind.state[kFirst])) {
                state[kLast] = behind.state[kLast];
                state[kLastAt] = behind.state[kLastAt];
            }
        },
    .result =
        [](const Stretch& stretch, const Request&, double* values) {
            std::fill_n(values, 3, stretch.state[kLight]);
            values[3] = stretch.state[kHit];
        },
};

}  // namespace edgewise
