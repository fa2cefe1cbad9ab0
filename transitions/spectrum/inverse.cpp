#include "transitions/spectrum/inverse.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/spectrum_picture.hpp"
#include "transitions/spectrum/pixel_of_sum.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr double kChordOperations = 30;  // three slabs: two products, two sums, two comparisons ...
constexpr double kCurveOperations = 40;  // of a pixel that is a function of the sum: calls, exp

Extent period_of(const Representation& slice) {
    return {2 * (slice.extent.x - 1), slice.extent.y, 1};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

Work work(const Offer& offer, const Ask& ask, int /*view*/) {
    const Extent period = period_of(offer.from);
    const double pixels = static_cast<double>(offer.to.samples());
    const bool curved =
        ask.want.mode->slices == ModeTraits::Slices::integral && !grows_with_length(ask.want);
    return {.operations = kernels::picture_operations(period, offer.to.extent) +
                          (kChordOperations + (curved ? kCurveOperations : 0)) * pixels,
            .streamed = 3 * offer.from.bytes() + 2 * offer.to.bytes(),
            .scratch = kernels::picture_scratch(period),
            .workspace = kernels::picture_workspace(period, offer.to.extent)};
}

/// Puts back what every voxel of the box lost, and nothing outside of it.
class Constant {
 public:
    Constant(const Offer& offer, const Ask& ask, int view)
        : want_(ask.want),
          scene_(ask.scene),
          chord_(want_.input, kernels::affine_of(want_.views.at(view).matrix())),
          constant_(offer.from.values.offset),
          sums_(grows_with_length(want_)) {}

    float operator()(float integral, std::int64_t x, std::int64_t y) const {
        const double depth = chord_.at(static_cast<double>(x), static_cast<double>(y)),
                     length = depth * want_.unit;
        if (sums_)
            return length > 0 ? static_cast<float>(integral + (constant_ - want_.zero) * length)
                              : 0.f;
        if (want_.mode->slices == ModeTraits::Slices::integral)
            return static_cast<float>(
                pixel_of_sum(want_, integral / want_.unit + constant_ * depth, depth));
        if (!(length > 0)) return static_cast<float>(want_.miss);
        // No mean lies outside the values.
        return static_cast<float>(
            std::clamp(integral / std::max(length, kShortestRay * want_.unit) + constant_,
                       scene_.low, scene_.high));
    }

 private:
    const Request& want_;
    const Scene& scene_;
    kernels::Chord chord_;
    double constant_;
    bool sums_;  // its pixels are the sums themselves
};

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    const Extent& picture = out.what.extent;
    float* pixels = out.as<float>();
    kernels::picture_of_slice(in.as<kernels::Complex>(), period_of(in.what), picture, pixels,
                              context.memory, [&] { return context.stopped(); });
    context.poll();
    const Constant constant(offer, ask, context.view);
    tbb::parallel_for(std::int64_t{0}, picture.y, [&](std::int64_t y) {
        if (context.stopped()) return;
        float* row = pixels + y * picture.x;
        for (std::int64_t x = 0; x < picture.x; ++x) row[x] = constant(row[x], x, y);
    });
    context.poll();
}

}  // namespace

Transition spectrum_inverse() {
    Transition edge;
    edge.name = "spectrum.inverse";
    edge.source = "Malzbender 1993; counts of FFTW's manual";
    edge.joins = {{"slice/spectrum", "screen/picture"}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    // Every pixel is made of every sample, so that the picture stays whole.
    edge.error = exact;  // all that a spectrum gets wrong is counted by spectrum.forward
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials(Combine::sum);
        join(all, picture_trials(Combine::mean));
        return all;
    };
    edge.factors = {{"", 4.7}};
    return edge;
}

}  // namespace edgewise
