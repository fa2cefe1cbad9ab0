#include "graph/modes/surface.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "graph/label_surface.hpp"
#include "graph/request.hpp"

namespace edgewise {
namespace {

// state: 1 where the ray has met the surface; its light there; the first and the last value, less
// the level, NaN where there is none; where on the ray the last one is [t]; how far values go to
// the other side of the level than the first one, of one stretch alone. Samples that are not finite
// are outside: the surface is open there. Of labels: 1 where the ray has met one; its diffuse
// light, before that where the last sample without a label lies; its specular light, NaN before;
// NaN; the label, before that 1 where there is such a sample. Stretches that are joined then take
// over the first label alone.

enum : std::size_t { kHit, kLight, kFirst, kLast, kLastAt, kBeyond };
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool is_passed(double before, double after) {
    return std::isfinite(before) && std::isfinite(after) && (before >= 0) != (after >= 0);
}

/// Where none of the values is known yet, `above` is the first.
void reach(Stretch& stretch, double above) {
    double& beyond = stretch.state[kBeyond];
    const double across = stretch.state[kFirst] >= 0 ? -above : above;
    if (!(beyond >= across)) beyond = across;
}

void take(Stretch& stretch, double above, double piece) {
    if (std::isnan(stretch.state[kFirst])) stretch.state[kFirst] = above;
    stretch.state[kLast] = std::isfinite(above) ? above : kNone;
    if (!std::isfinite(above)) return;
    reach(stretch, above);
    stretch.length += piece;
}

void meet_label(Stretch& stretch, double label, const Lit& lit) {
    stretch.state[kHit] = 1;
    stretch.state[kLight] = lit.diffuse;
    stretch.state[kFirst] = lit.specular;
    stretch.state[kLastAt] = label;
}

void add(Stretch& stretch, std::span<const double> values, const double* pieces,
         const Request& want) {
    auto& state = stretch.state;
    if (shows_labels(want)) {
        stretch.each_finite(values, pieces, [&](double value, double) {
            if (state[kHit] == 0 && is_label(want, value)) meet_label(stretch, value, Lit{});
        });
        return;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double above = values[i] - want.level();
        if (state[kHit] == 0 && is_passed(state[kLast], above)) state[kHit] = state[kLight] = 1;
        take(stretch, above, pieces[i]);
    }
}

/// A place where the field passes the level, between two that lie on its sides; the first one
/// behind it where the field jumps. By inverse quadratic interpolation where three values lie on a
/// curve that has an inverse, else by halves (Chandrupatla 1997): a jump, of which one side nearly
/// is the level, takes no more steps than halves do.
double root_between(double a, double above_a, double b, double above_b, double level,
                    const std::function<double(double)>& value) {
    constexpr int kMost = 64;
    constexpr double kWithin = 1e-12;
    const bool behind = above_b >= 0;
    double c = a, above_c = above_a, t = 0.5;  // c: the end before the last one
    for (int i = 0; i < kMost; ++i) {
        const double least = kWithin * (1 + std::abs(a)) / std::abs(b - a);
        if (!(least < 0.5)) break;
        const double place = a + std::clamp(t, least, 1 - least) * (b - a);
        const double above = value(place) - level;
        if (!std::isfinite(above)) break;
        const bool as_a = (above >= 0) == (above_a >= 0);
        c = as_a ? a : b;
        above_c = as_a ? above_a : above_b;
        if (!as_a) {
            b = a;
            above_b = above_a;
        }
        a = place;
        above_a = above;
        const double xi = (a - b) / (c - b), phi = (above_a - above_b) / (above_c - above_b);
        const bool inverse = phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi;
        t = inverse ? above_a / (above_b - above_a) * above_c / (above_b - above_c) +
                          (c - a) / (b - a) * above_a / (above_c - above_a) * above_b /
                              (above_c - above_b)
                    : 0.5;
    }
    return (above_a >= 0) == behind ? a : b;
}

/// The first place with a label between one that has none and one that has.
double first_label(double a, double b, const AlongRay& along, const Request& want) {
    constexpr int kMost = 64;
    constexpr double kWithin = 1e-12;
    for (int i = 0; i < kMost && std::abs(b - a) > kWithin * (1 + std::abs(a)); ++i) {
        const double middle = (a + b) / 2;
        (is_label(want, along.value(middle)) ? b : a) = middle;
    }
    return b;
}

void follow_to_label(Stretch& stretch, double t, double value, double piece, const AlongRay& along,
                     const Request& want) {
    auto& state = stretch.state;
    if (std::isfinite(value)) stretch.length += piece;
    if (state[kHit] != 0) return;
    if (!is_label(want, value)) {
        state[kLight] = t;
        state[kLastAt] = 1;
        return;
    }
    const double at = state[kLastAt] != 0 ? first_label(state[kLight], t, along, want) : t;
    meet_label(stretch, along.value(at), along.lit(at));
}

void follow(Stretch& stretch, double t, double value, double piece, const AlongRay& along,
            const Request& want) {
    if (shows_labels(want)) return follow_to_label(stretch, t, value, piece, along, want);
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

// A ray that does not meet the surface shows what is behind; what one shows that would is not
// known.
const Threshold kThreshold = {
    .margin =
        [](const Stretch& stretch, const Request& want) {
            return shows_labels(want) ? kNone : stretch.state[kBeyond];
        },
    .flip = nullptr,
};

constexpr Shade kShades[] = {Shade::phong, Shade::torrance_sparrow};

}  // namespace

/// The first place of a ray where the field passes a level, whether it rises or falls: the surface
/// is open at the volume's faces and at those of a clip. White, lit by its gradient.
const ModeTraits surface_mode = {
    .name = "surface",
    .help = "first hit of @isovalue, lit",
    .combine = Combine::hit,
    .channels = 4,
    .over_background = true,
    .takes_level = true,
    .shades = kShades,
    .takes_cue = true,
    .shade = Shade::phong,
    .first_hit = true,
    .threshold = &kThreshold,
    .skips = ModeTraits::Levels::values,
    .kept = "the surface would end where samples were left out",
    .operations = 4,
    .timed_as = "mip",
    .guess = {0.15, 0.05, 0.03},
    .gain = [](bool noise, double, double, double range) { return (noise ? 1.0 : 3.0) / range; },
    .empty =
        [](Stretch& stretch) {
            stretch.state[kFirst] = stretch.state[kLast] = stretch.state[kBeyond] = kNone;
        },
    .add = add,
    .follow = follow,
    .append =
        [](Stretch& stretch, const Stretch& behind) {
            auto& state = stretch.state;
            if (state[kHit] != 0) return;
            const bool between = is_passed(state[kLast], behind.state[kFirst]);
            state[kHit] = between ? 1 : behind.state[kHit];
            state[kLight] = between ? 1 : behind.state[kLight];
            if (std::isnan(state[kFirst])) state[kFirst] = behind.state[kFirst];
            if (!std::isnan(behind.state[kFirst])) {
                state[kLast] = behind.state[kLast];
                state[kLastAt] = behind.state[kLastAt];
            }
        },
    .result =
        [](const Stretch& stretch, const Request& want, double* values) {
            const auto& state = stretch.state;
            values[3] = state[kHit];
            std::fill_n(values, 3, state[kHit] != 0 ? state[kLight] : 0);
            if (state[kHit] == 0 || !shows_labels(want)) return;
            const std::array<double, 3> color = color_of_label(want, state[kLastAt]);
            for (std::size_t c = 0; c < 3; ++c)
                values[c] = color[c] * state[kLight] + state[kFirst];
        },
};

}  // namespace edgewise
