#include "transitions/spectrum/faded_picture.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tbb/parallel_for.h>

#include "transitions/kernels/spectrum_picture.hpp"
#include "transitions/spectrum/gradients.hpp"
#include "transitions/spectrum/moments.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

constexpr double kPixelOperations = 50;  // three slabs, and the integral of light

Extent faded_period(const Representation& slice) {
    return {2 * (slice.extent.x - 1), slice.extent.y, 1};
}

Offer faded_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const std::string reason =
        from.content == "lit" ? no_lit_projection(ask) : no_faded_projection(ask);
    if (!reason.empty()) return Offer::no(reason);
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

Work faded_work(const Offer& offer, const Ask&, int /*view*/) {
    const Extent period = faded_period(offer.from);
    return {.operations = kernels::picture_operations(period, offer.to.extent) +
                          kPixelOperations * static_cast<double>(offer.to.samples()),
            .streamed = 3 * offer.from.bytes() + 2 * offer.to.bytes(),
            .scratch = kernels::picture_scratch(period),
            .workspace = kernels::picture_workspace(period, offer.to.extent)};
}

/// Where the ray of a pixel is inside the input's box.
class Inside {
 public:
    Inside(const Request& want, int view)
        : want_(want),
          back_(want.views.at(view).matrix().inverse()),
          nearest_(nearest_corner(want, view)) {}

    struct Depths {
        double from = 0, to = 0;  // [file unit]; from == to: nowhere
    };
    Depths at(double x, double y) const {
        double from = -std::numeric_limits<double>::infinity(), to = -from;
        for (int axis = 0; axis < 3; ++axis) {
            const double start = back_(axis, 0) * x + back_(axis, 1) * y + back_(axis, 3);
            const double step = back_(axis, 2);
            const double high = static_cast<double>(want_.input[axis]) - 0.5;
            if (std::abs(step) < kAcross) {
                if (start < -0.5 || start > high) return {};
                continue;
            }
            const double a = (-0.5 - start) / step, b = (high - start) / step;
            from = std::max(from, std::min(a, b));
            to = std::min(to, std::max(a, b));
        }
        if (!(from < to)) return {};
        return {std::max(0., (from - nearest_) * want_.unit), (to - nearest_) * want_.unit};
    }

 private:
    static constexpr double kAcross = 1e-12;  // the ray runs across the axis
    const Request& want_;
    Mat4 back_;
    double nearest_;
};

/// The integral of light between two depths.
double light_between(const DepthCue& cue, double from, double to) noexcept {
    const double k = cue.per_length;
    if (k == 0) return to - from;
    if (!cue.linear) return std::exp(-k * from) * -std::expm1(-k * (to - from)) / k;
    const double last = std::min(to, 1 / k);
    return last > from ? (last - from) * (1 - k * (from + last) / 2) : 0;
}

/// The integral of the light of a constant, whose gradient is 0, between two depths.
double light_between(const Request& want, double from, double to) noexcept {
    return want.cue ? light_between(*want.cue, from, to)
                    : want.shading.material.ambient * (to - from);
}

void faded_run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
               Context& context) {
    const Request& want = ask.want;
    const Extent& picture = out.what.extent;
    float* pixels = out.as<float>();
    kernels::picture_of_slice(in.as<kernels::Complex>(), faded_period(in.what), picture, pixels,
                              context.memory, [&] { return context.stopped(); });
    context.poll();
    const Inside inside(want, context.view);
    const double constant = offer.from.values.offset;
    const bool mean = want.mode->slices == ModeTraits::Slices::mean;
    // No mean of light that falls off lies outside these. What light adds has no such ends.
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const double low = want.cue ? std::min(0., ask.scene.low) : -kFar,
                 high = want.cue ? std::max(0., ask.scene.high) : kFar;
    tbb::parallel_for(std::int64_t{0}, picture.y, [&](std::int64_t y) {
        if (context.stopped()) return;
        float* row = pixels + y * picture.x;
        for (std::int64_t x = 0; x < picture.x; ++x) {
            const auto [from, to] = inside.at(static_cast<double>(x), static_cast<double>(y));
            const double light = light_between(want, from, to), length = to - from;
            double value = mean ? want.miss : 0;
            if (length > 0)
                value = mean ? std::clamp(row[x] / std::max(length, kShortestRay * want.unit) +
                                              constant * light / length,
                                          low, high)
                             : row[x] + (constant - want.zero) * light;
            row[x] = static_cast<float>(value);
        }
    });
    context.poll();
}

}  // namespace

Transition spectrum_faded_picture() {
    Transition edge;
    edge.name = "spectrum.faded_picture";
    edge.source = "Totsuka, Levoy 1993; counts of FFTW's manual";
    edge.joins = {{"slice/faded", "screen/picture"}, {"slice/lit", "screen/picture"}};
    edge.offer = faded_offer;
    edge.work = faded_work;
    edge.error = exact;  // all that the spectra get wrong is counted where they are made
    edge.run = faded_run;
    return edge;
}

}  // namespace edgewise
