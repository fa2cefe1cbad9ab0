#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "graph/label_surface.hpp"
#include "graph/picture_facts.hpp"
#include "graph/range.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/project/combine_model.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/shear_warp_model.hpp"

namespace edgewise {
namespace {

/// RMS errors over the range of the picture where nothing was measured: those of a real MR head,
/// 160 x 232 x 160 samples turned by 30, 20 and 10 degrees, step 1.
double guess(const Filter& filter, Mode mode) {
    const int hold = filter.taps == 1 ? 0 : filter.coefficients ? 2 : 1;
    return mode->guess[static_cast<std::size_t>(hold)];
}

double measured(const Filter& filter, double step, const Ask& ask) {
    return ask.scene.fact(kPictureError(filter.name, step))
        .value_or(guess(filter, ask.want.mode) * std::max(1.0, step) * ask.scene.range);
}

/// Between measured steps linearly; beyond the longest in proportion to the step.
double at_step(const Filter& filter, double step, const Ask& ask) {
    if (step >= kCastSteps.back())
        return measured(filter, kCastSteps.back(), ask) * step / kCastSteps.back();
    if (step <= kCastSteps.front()) return measured(filter, kCastSteps.front(), ask);
    const auto above = std::upper_bound(kCastSteps.begin(), kCastSteps.end(), step);
    const double low = *(above - 1), high = *above, f = (step - low) / (high - low);
    return (1 - f) * measured(filter, low, ask) + f * measured(filter, high, ask);
}

/// How errors of samples pass the combining rule, with the same measurements for blur and noise.
double guessed_gain(bool noise, const Ask& ask) {
    return ask.want.mode->gain(noise, static_cast<double>(ask.want.screen.z), ask.want.unit,
                               range_between(ask.scene.low, ask.scene.high));
}

/// What rays that end early leave out, of the brightest light there is: 1 in each channel.
double terminated(const Ask& ask) {
    if (!ask.want.mode->left) return 0;
    return kTerminated * ask.scene.fact(kEnded).value_or(1);
}

/// How errors of samples pass that a filter reads between. The noise of samples that a spline runs
/// through passes as that of linear interpolation does.
Error gains(const Filter& filter, const Ask& ask) {
    const Field like = filter.taps == 1 ? Field::nearest : Field::linear;
    return {
        .gain = ask.scene.fact(kBlurGain).value_or(guessed_gain(false, ask)),
        .noise_gain =
            ask.scene.fact(kNoiseGain(field_filter(like).name)).value_or(guessed_gain(true, ask))};
}

/// RMS rounding over the range of the picture, of samples that are read by a filter on the way.
/// f32 positions are off by half of 2^-24 of the longest axis at most, on a slope of which half the
/// range a sample is a lot; weights of integer samples have 14 bits. An integral averages both, and
/// adds the rounding of its sum.
double rounding(const Filter& filter, const Ask& ask) {
    constexpr double kFloat = 0x1p-24, kWeights = 2e-5;
    // One of two answers is not rounded. Where rounding decides which it is, and what it changes of
    // the light of a hit, the preview says.
    const Threshold* const threshold = ask.want.mode->threshold;
    const bool of_preview = threshold && (threshold->flip || ask.want.mode->first_hit);
    if (of_preview && !shows_labels(ask.want) && ask.scene.draws > 0) return 0;
    const auto longest =
        static_cast<double>(std::max({ask.want.input.x, ask.want.input.y, ask.want.input.z}));
    const double sample = filter.taps <= 2 ? kWeights : 0.25 * kFloat * longest;
    if (!ask.want.mode->averages) return sample + kFloat;
    const double root =
        std::sqrt(static_cast<double>(std::max<std::int64_t>(1, ask.want.screen.z)));
    return sample / root + kFloat * root;
}

}  // namespace

Error cast_error(const Filter& filter, double step, const Ask& ask) {
    // What a long step misses of edges and shadows does not go with the step.
    const ModeTraits& mode = *ask.want.mode;
    const bool jumps = mode.takes_level || mode.sampled_every > 0 || ask.want.shading.has_shade();
    if (jumps && step > kCastSteps.back()) return Error::unknown();
    Error error = gains(filter, ask);
    error.bias = at_step(filter, step, ask) + terminated(ask);
    error.noise = rounding(filter, ask) * ask.scene.range;
    return error;
}

Error sheared_error(const Filter& filter, double step, const Ask& ask) {
    // Unmeasured: two reconstructions within a slice, none along z, against one along each axis.
    constexpr double kTwice = 1.4;
    Error error = gains(filter, ask);
    error.bias =
        ask.scene.fact(kShearWarpError(filter.name)).value_or(kTwice * at_step(filter, step, ask)) +
        terminated(ask);
    error.noise = rounding(filter, ask) * ask.scene.range;
    return error;
}

Error combined_error(const Ask& ask) {
    // The samples bring the error of their reconstruction; what is added is that of a step of 1.
    // The samples' places on the rays are independent of their errors.
    Error error = gains(field_filter(Field::nearest), ask);
    error.bias = terminated(ask);
    // What reads the samples rounds by itself; sums round here.
    const Filter& exact = field_filter(ask.want.field);
    error.noise = std::hypot(rounding(field_filter(Field::spline), ask) * ask.scene.range,
                             ask.scene.fact(kCombiningError).value_or(at_step(exact, 1, ask)));
    return error;
}

}  // namespace edgewise
