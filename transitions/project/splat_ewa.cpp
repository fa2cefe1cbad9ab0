#include "transitions/project/splat_ewa.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/splat_ewa.hpp"
#include "transitions/project/gaussian_sums.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/project/splat_ewa_view.hpp"
#include "transitions/project/splat_view.hpp"

namespace edgewise {
namespace {

using kernels::EwaSplat;
using kernels::SplatSums;

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_slices(want); !reason.empty()) return Offer::no(std::move(reason));
    const Combine combine = want.mode->combine;
    if (combine != Combine::sum && combine != Combine::mean)
        return Offer::no("whole footprints add up: only integrals and means have no order");
    if (!is_whole(from)) return Offer::no("footprints of one picture are added in one memory");
    if (want.field == Field::nearest)
        return Offer::no("labels: kernels that overlap would make new values of them");
    if (ask.scene.non_finite > 0)
        return Offer::no(
            fmt::format("{} samples are not finite, and so would be what a kernel "
                        "makes of them",
                        ask.scene.non_finite));
    if (want.eye)
        for (int variant = 0; variant < want.views.different(); ++variant)
            if (std::string reason = no_ewa_distance(from, want, want.views.first_view(variant));
                !reason.empty())
                return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, want), .with = with};
}

/// Rows of a band. Footprints at its edge are worked out twice, but no pixel.
std::int64_t rows_of(const Extent& picture) {
    constexpr std::int64_t kLeast = 32, kBands = 16;
    return std::max(kLeast, (picture.y + kBands - 1) / kBands);
}

std::int64_t pitch_of(std::int64_t width) { return width + kernels::kEwaRoom; }

/// Whether what empty samples add has to be told from the length of a ray.
bool needs_lengths(const EmptySample& empty, const Request& want) {
    return want.mode->divides || empty.value != want.zero;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    constexpr double kVoxel = 90, kPixel = 30, kPixelSums = 1000;
    const EwaSplat splat = ewa_view_of(offer.from, ask.want, view, offer.with);
    std::array<double, 2> reach = ewa_spread_of(splat, offer.from.extent);
    for (double& side : reach)
        side = EwaSplat::kRadius * std::sqrt(splat.variance * side + splat.low_pass);
    const auto [right, down] = reach;
    const double voxels = samples_splatted(offer.from, ask);
    const auto pixels = static_cast<double>(offer.to.samples());
    const std::int64_t rows = rows_of(offer.to.extent);
    // Vectors of eight pixels, of rows that begin anywhere.
    const double writes = voxels * (2 * right + 8) * (2 * down + 1);
    const double twice = 1 + 2 * down / static_cast<double>(rows);
    const bool lengths = needs_lengths(empty_sample(offer.from.values, ask.scene), ask.want);
    return {.operations = static_cast<double>(offer.from.samples()) + twice * kVoxel * voxels +
                          kPixel * writes + (lengths ? kSpanOperations : 6) * pixels +
                          kPixelSums * std::min(pixels, writes),
            .streamed = offer.from.bytes() + 3 * offer.to.bytes(),
            .gathers = writes,
            .scratch = 4.0 * static_cast<double>(pitch_of(offer.to.extent.x) * (rows + 1)) +
                       static_cast<double>(sizeof(kernels::Splatted)) *
                           static_cast<double>(offer.from.extent.x),
            .workspace = SplatSpans::bytes(offer.from.extent)};
}

/// An upper estimate. What a kernel blurs goes with its variance, of which that of first order has
/// a sixth: details that are smaller than kernels lose less.
Error error(const Offer& offer, const Ask& ask) {
    constexpr double kLinear = 1.0 / 6, kStep = 0.25;
    const EwaSplat splat = ewa_view_of(offer.from, ask.want, 0, offer.with);
    const auto [right, down] = ewa_spread_of(splat, offer.from.extent);
    const auto blur = [&](double spread) { return splat.variance + splat.low_pass / spread; };
    Error error = cast_error(splat_kernel(), kStep, ask);
    error.bias *= std::max(1.0, blur(std::min(right, down)) / kLinear);
    // What is left of ripples along two sides, of a picture that is even.
    const double square = std::pow(std::numbers::pi, 2);
    const double ripple = 2 * std::exp(-2 * square * blur(std::max(right, down)));
    const bool divides = ask.want.mode->divides;
    const double length = divides ? 1 : mean_length(offer.from, ask.want, 0) * ask.want.unit;
    const double value = ask.scene.mean - (divides ? 0 : ask.want.zero);
    error.noise = std::hypot(error.noise, ripple * value * length);
    // A cast's error says little of the blur where the field is as smooth as the cast: a guess.
    error.known = false;
    return error;
}

/// What sums become.
class EwaFinish {
 public:
    EwaFinish(const Data& in, const Request& want, int view, const EmptySample& empty,
              const EwaSplat& splat)
        : want_(want),
          empty_(empty),
          lengths_(needs_lengths(empty, want)),
          sums_(rays_of(in.what, want, view, -0.5), in.what.extent, splat.variance,
                splat.low_pass) {
        cast_.volume = kernels::grid_of(in);
        cast_.rays = rays_of(in.what, want, view, -0.5);
        cast_.miss = rule_miss(want);
    }

    /// @param sum  of pixel (x, y), an integral over depth of stored numbers
    float operator()(float sum, std::int64_t x, std::int64_t y) const {
        const auto px = static_cast<double>(x), py = static_cast<double>(y);
        const bool divides = want_.mode->divides;
        if (sum == 0 && !lengths_) return 0;
        const double length = ray_path(cast_, px, py).length;
        if (length == 0) return static_cast<float>(divides ? cast_.miss : 0);
        // Near faces kernels reach beyond them: what is left inside stands for all of the length.
        double mean = empty_.value;
        if (sum != 0) mean += cast_.volume.values.slope * mean_of(sum, px, py);
        return static_cast<float>(divides ? mean : (mean - want_.zero) * length * want_.unit);
    }

 private:
    double mean_of(float sum, double px, double py) const {
        // A slanted ray is longer than its extent in depth.
        const std::array<double, 3> m = cast_.rays.measure.at(px, py);
        const double slanted = std::hypot(m[0], m[1], m[2]) / std::abs(m[2]);
        const double all = sums_.along(px, py);
        return all > 0 ? static_cast<double>(sum) * slanted / all : 0;
    }

    const Request& want_;
    EmptySample empty_;
    bool lengths_;
    kernels::RayCast cast_;
    GaussianSums sums_;
};

/// A picture is one region: it is cut into bands inside.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const EmptySample empty = empty_sample(in.what.values, ask.scene);
    EwaSplat splat = ewa_view_of(in.what, ask.want, context.view, offer.with);
    kernels::Splat rows;
    rows.volume = splat.volume = kernels::grid_of(in);
    rows.empty = splat.empty = empty.stored;
    SplatSpans spans(rows, context);
    splat.spans = spans.data();
    const EwaFinish finish(in, ask.want, context.view, empty, splat);
    const std::int64_t width = region.extent().x, depth = in.what.extent.z;
    for_tiles(region, width, rows_of(out.what.extent), context, [&](const Region& band) {
        const auto floats = static_cast<std::size_t>(pitch_of(width) * (band.extent().y + 1));
        kernels::Block<float> block(floats, context.memory);
        std::fill_n(block.data(), floats, 0.0f);
        kernels::Block<kernels::Splatted> row(static_cast<std::size_t>(in.what.extent.x),
                                              context.memory);
        const SplatSums sums{.begin = {band.begin[0], band.begin[1]},
                             .end = {band.end[0], band.end[1]},
                             .first = block.data(),
                             .pitch = pitch_of(width)};
        constexpr std::int64_t kSlices = 8;  // between looks at whether to stop
        for (std::int64_t z = 0; z < depth; z += kSlices) {
            if (context.stopped()) return;
            kernels::splat_ewa(splat, z, std::min(z + kSlices, depth), sums, row.data());
        }
        for (std::int64_t y = band.begin[1]; y < band.end[1]; ++y) {
            const float* sum = sums.first + (y - band.begin[1]) * sums.pitch;
            float* pixel = out.at<float>(band.begin[0], y, 0);
            for (std::int64_t x = 0; x < width; ++x)
                pixel[x] = finish(sum[x], band.begin[0] + x, y);
        }
    });
}

}  // namespace

Transition splat_ewa() {
    Transition edge;
    edge.name = "project.splat_ewa";
    edge.source = "Zwicker, Pfister, van Baar, Gross 2001; Mueller and Yagel 1996";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"sigma", number(0.4, 2, {0.6}, "standard deviation of the kernel, in voxels")},
        {"lowpass", number(0, 2, {0.6}, "standard deviation added to footprints, in pixels")}};
    edge.on_demand = true;  // project.splat does what it can for less, with less blur
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
