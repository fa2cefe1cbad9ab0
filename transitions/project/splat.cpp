#include "transitions/project/splat.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/splat.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/project/splat_view.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::Footprints;
using kernels::SplatSums;

constexpr double kCastStep = 0.25;  // of rays that are as good as footprints

SplatView view_of(const Representation& from, const Request& want, int view) {
    return splat_view_of(from, want, view, Footprints::Shape{}.cells, Footprints::Depth::whole);
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_splatting(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    const Combine combine = ask.want.mode->combine;
    if (combine != Combine::sum && combine != Combine::mean)
        return Offer::no("whole footprints add up: only integrals and means have no order");
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

/// Whether what empty samples add has to be told from the length of a ray.
bool needs_lengths(const EmptySample& empty, const Request& want) {
    return want.mode->divides || empty.value != want.zero;
}

/// Rows of a band. Footprints at its edge are added twice.
std::int64_t rows_of(const SplatView& of, const Extent& picture) {
    constexpr std::int64_t kLeast = 32, kBands = 16;
    return std::max(
        {kLeast, 4 * std::int64_t{of.splat.patch[1]}, (picture.y + kBands - 1) / kBands});
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const SplatView of = view_of(offer.from, ask.want, view);
    const double voxels = samples_splatted(offer.from, ask);
    const auto samples = static_cast<double>(offer.from.samples());
    const auto pixels = static_cast<double>(offer.to.samples());
    const std::int64_t rows = rows_of(of, offer.to.extent);
    const double twice = 1 + of.splat.patch[1] / static_cast<double>(rows);
    const double writes = twice * voxels * of.pixels_written();
    const double table = of.shape.bytes();
    const bool lengths = needs_lengths(empty_sample(offer.from.values, ask.scene), ask.want);
    constexpr int kFaces = 27;  // tables: of voxels inside and at the volume's faces
    return {.operations = samples + twice * 30 * voxels + 13 * writes +
                          table / sizeof(float) * 4 * kernels::kSections +
                          (lengths ? kSpanOperations + 3 : 3) * pixels,
            .streamed = offer.from.bytes() + 3 * offer.to.bytes(),
            // From the table, and the sums themselves.
            .gathers = 2 * writes,
            .scratch =
                4.0 * static_cast<double>(SplatSums::floats_of(of.splat, offer.to.extent.x, rows)) +
                static_cast<double>(sizeof(kernels::Splatted)) *
                    static_cast<double>(offer.from.extent.x),
            .workspace = kFaces * table + SplatSpans::bytes(offer.from.extent)};
}

/// An upper bound of the samples' variance, over the square of their range. Samples differ from the
/// commonest value by at most the range. Where that is the least or greatest value, their mean
/// difference is known too.
double variance_at_most(const Scene& scene) {
    const double range = scene.high - scene.low, off = std::abs(scene.mean - scene.commonest);
    const bool at_end = scene.commonest <= scene.low || scene.commonest >= scene.high;
    const double share = scene.occupied_fraction;
    return at_end && off > 0 && range > 0 ? std::min(share, off / range) : share;
}

Error error(const Offer&, const Ask& ask) {
    Error error = cast_error(splat_kernel(), kCastStep, ask);
    // A ray is moved along both axes, by any part of half a cell either way: RMS of a uniform
    // distribution. It differs from slice to slice.
    const double moved = std::sqrt(2.0 / 12) / Footprints::Shape{}.cells;
    // Neighbours that know nothing of each other differ by sqrt(2) standard deviations, of which
    // interpolation across leaves sqrt(2 / 3). Of smoother samples half of the range a voxel is a
    // lot.
    const double range = ask.scene.high - ask.scene.low;
    const double slope = std::min(0.5, std::sqrt(4.0 / 3 * variance_at_most(ask.scene)));
    const double sample = moved * slope * range;
    error.noise = std::hypot(error.noise, error.noise_gain * sample);
    return error;
}

/// What sums become.
class Finish {
 public:
    Finish(const Data& in, const Request& want, int view, const EmptySample& empty, double slice)
        : want_(want),
          empty_(empty),
          scale_(in.what.values.slope * slice),
          lengths_(needs_lengths(empty, want)) {
        cast_.volume = kernels::grid_of(in);
        cast_.rule = want.mode->combine;
        cast_.rays = rays_of(in.what, want, view, -0.5);
        cast_.step = kCastStep;
        cast_.unit = want.unit;
        cast_.zero = want.zero;
        cast_.miss = rule_miss(want);
        for (std::size_t axis = 0; axis < 3; ++axis)
            inverse_[axis] = kernels::inverse_stride(cast_.rays.direction.base[axis]);
    }

    /// @param sum  of pixel (x, y), in stored numbers and voxels of the axis along rays
    float operator()(float sum, std::int64_t x, std::int64_t y) const {
        const double added = scale_ * static_cast<double>(sum);  // [value t]
        if (!lengths_) return static_cast<float>(added * want_.unit);
        const double length = length_of(static_cast<double>(x), static_cast<double>(y));
        if (!want_.mode->divides)
            return static_cast<float>((added + (empty_.value - want_.zero) * length) * want_.unit);
        if (length == 0) return static_cast<float>(cast_.miss);
        // Where a ray enters and leaves is known to a part of a cell, which a short ray shows.
        constexpr double kShort = 8;
        if (length < kShort) return mean_of(x, y);
        return static_cast<float>(empty_.value + added / length);
    }

 private:
    /// Of the part of a ray that is inside [t].
    double length_of(double x, double y) const {
        const std::array<double, 3> origin = cast_.rays.origin.at(x, y);
        double low = -std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t axis = 0; axis < 3; ++axis)
            kernels::clip(origin[axis], inverse_[axis], kernels::low_face(cast_, axis),
                          kernels::high_face(cast_, axis), low, high);
        return low < high ? high - low : 0;
    }
    float mean_of(std::int64_t x, std::int64_t y) const {
        float mean = 0;
        kernels::ray_cast(cast_, x, y, 1, 1, &mean, 1);
        return mean;
    }

    const Request& want_;
    EmptySample empty_;
    double scale_;
    bool lengths_;
    kernels::RayCast cast_;
    std::array<double, 3> inverse_{};
};

/// A picture is one region: it is cut into bands inside, which share the tables.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const EmptySample empty = empty_sample(in.what.values, ask.scene);
    SplatView of = view_of(in.what, ask.want, context.view);
    Footprints footprints(of.shape, context.memory);
    kernels::Splat& splat = of.splat;
    splat.volume = kernels::grid_of(in);
    splat.empty = empty.stored;
    splat.footprints = &footprints;
    SplatSpans spans(splat, context);
    splat.spans = spans.data();
    const Finish finish(in, ask.want, context.view, empty, of.slice);
    const std::int64_t width = region.extent().x, depth = in.what.extent.z;
    for_tiles(region, width, rows_of(of, out.what.extent), context, [&](const Region& band) {
        const auto floats =
            static_cast<std::size_t>(SplatSums::floats_of(splat, width, band.extent().y));
        kernels::Block<float> block(floats, context.memory);
        std::fill_n(block.data(), floats, 0.0f);
        kernels::Block<kernels::Splatted> row(static_cast<std::size_t>(in.what.extent.x),
                                              context.memory);
        const SplatSums sums{.begin = {band.begin[0], band.begin[1]},
                             .end = {band.end[0], band.end[1]},
                             .first = block.data() + SplatSums::first_of(splat, width),
                             .pitch = SplatSums::pitch_of(splat, width)};
        constexpr std::int64_t kSlices = 8;  // between looks at whether to stop
        for (std::int64_t z = 0; z < depth; z += kSlices) {
            if (context.stopped()) return;
            kernels::splat(splat, z, std::min(z + kSlices, depth), sums, row.data());
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

Transition splat() {
    Transition edge;
    edge.name = "project.splat";
    edge.source = "Westover 1990";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials(Combine::sum);
        join(all, picture_trials(Combine::mean));
        return all;
    };
    edge.factors = {{"", 1.26}};
    return edge;
}

}  // namespace edgewise
