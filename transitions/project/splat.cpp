#include "transitions/project/splat.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/splat.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"

namespace edgewise {
namespace {

constexpr double kCastStep = 0.25;  // of rays that are as good as footprints

/// What footprints are integrals of.
const Filter& kernel() { return field_filter(Field::linear); }

/// One view, without samples.
struct SplatView {
    kernels::Splat splat;
    std::array<int, 2> across{};     // axes of the volume
    int along = 2;                   // the axis that rays are steepest to
    std::array<double, 2> slopes{};  // voxels of `across` a voxel of `along`
    double slice = 1;                // length of a ray from one voxel of `along` to the next [t]
    std::array<double, 2> step{};    // from a pixel to its neighbours, the longest [voxel]
    double widest = 0;               // pixels of the largest footprint along a row or column
};

std::uint32_t fixed(double voxels) {
    return static_cast<std::uint32_t>(
        std::llround(voxels * static_cast<double>(1 << kernels::kPlaceBits)));
}

SplatView view_of(const Representation& from, const Request& want, int view) {
    const kernels::Rays rays = rays_of(from, want, view);
    const auto& d = rays.direction.base;
    SplatView made;
    for (int axis : {1, 0})
        if (std::abs(d[static_cast<std::size_t>(axis)]) >
            std::abs(d[static_cast<std::size_t>(made.along)]))
            made.along = axis;
    const auto along = static_cast<std::size_t>(made.along);
    made.across = {made.along == 0 ? 1 : 0, made.along == 2 ? 1 : 2};
    made.slice = 1 / std::abs(d[along]);
    for (std::size_t i = 0; i < 2; ++i) {
        const auto axis = static_cast<std::size_t>(made.across[i]);
        const double slope = d[axis] / d[along];
        made.slopes[i] = slope;
        // A ray crosses slice k at o + (k - o_along) slope.
        const auto crossing = [&](const std::array<double, 3>& o) {
            return o[axis] - slope * o[along];
        };
        kernels::PlaceAcross& place = made.splat.across[i];
        // From the table's first entry, and half a cell more: the nearest one is taken.
        const double middle =
            (kernels::Footprints::entries(slope) / 2 + 0.5) / kernels::Footprints::kCells;
        place.base = fixed(crossing(rays.origin.base) + middle);
        place.px = fixed(crossing(rays.origin.x));
        place.py = fixed(crossing(rays.origin.y));
        place.voxel[along] = fixed(slope);
        place.voxel[axis] = fixed(-1);
        made.step[i] =
            std::max(std::abs(crossing(rays.origin.x)), std::abs(crossing(rays.origin.y)));
    }
    const Mat4 map = residual(from, want, view);
    for (int i = 0; i < 2; ++i) {
        kernels::PlaceOnScreen& place = made.splat.place[static_cast<std::size_t>(i)];
        place.base = map(i, 3);
        double reach = 0, moved = 0;
        for (int axis = 0; axis < 3; ++axis) {
            place.voxel[static_cast<std::size_t>(axis)] = map(i, axis);
            reach += std::abs(map(i, axis)) * (from.extent[axis] == 1 ? 0.5 : 1);
            if (axis != made.along) moved += std::abs(map(i, axis));
        }
        // Half a cell, and what places in fixed point are off by after 2^13 pixels and voxels.
        constexpr double kOff = 0.5 / kernels::Footprints::kCells + 0.01;
        reach += kOff * moved;
        made.splat.reach[static_cast<std::size_t>(i)] = reach;
        made.splat.patch[static_cast<std::size_t>(i)] = static_cast<int>(std::floor(2 * reach)) + 1;
        made.widest = std::max(made.widest, 2 * reach);
    }
    return made;
}

/// Why footprints of a view are too large or too small, or "".
std::string no_footprints(const Representation& from, const Request& want, int view) {
    constexpr double kWidest = 64, kFarthest = 2048;
    const SplatView of = view_of(from, want, view);
    if (of.widest > kWidest)
        return fmt::format("view {}: a footprint is {:.3g} pixels wide; at most {}", view,
                           of.widest, kWidest);
    // Places wrap around at twice as far, and vectors reach beyond a footprint.
    const double pixels = of.splat.patch[0] + of.splat.patch[1] + 20;
    const double apart = pixels * std::max(of.step[0], of.step[1]);
    if (apart > kFarthest)
        return fmt::format("view {}: pixels written at once lie within {:.4g} voxels; at most {}",
                           view, apart, kFarthest);
    return {};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (want.mode->combine != Combine::sum && want.mode->combine != Combine::mean)
        return Offer::no("whole footprints add up: only integrals and means have no order");
    if (want.eye) return Offer::no("the eye is at a finite distance: footprints differ by voxel");
    if (std::string reason = no_slices(want); !reason.empty()) return Offer::no(std::move(reason));
    if (!is_whole(from)) return Offer::no("footprints of one picture are added in one memory");
    if (std::string reason = not_read_by(kernel(), {.labels = want.field == Field::nearest});
        !reason.empty())
        return Offer::no(std::move(reason));
    if (ask.scene.non_finite > 0)
        return Offer::no(fmt::format(
            "{} samples are not finite: rays would miss all that is interpolated from them",
            ask.scene.non_finite));
    for (int variant = 0; variant < want.views.different(); ++variant)
        if (std::string reason = no_footprints(from, want, want.views.first_view(variant));
            !reason.empty())
            return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, want), .with = with};
}

/// Samples that are not of the commonest value. What was cropped away was.
double splatted(const Offer& offer, const Ask& ask) {
    return std::min(static_cast<double>(offer.from.samples()),
                    ask.scene.occupied_fraction * static_cast<double>(ask.want.input.samples()));
}

/// The stored number that adds nothing, and what it stands for.
struct Empty {
    float stored = 0;
    double value = 0;
};
Empty empty_of(const ValueMap& values, const Scene& scene) {
    Empty empty;
    if (values.slope != 0)
        empty.stored = static_cast<float>((scene.commonest - values.offset) / values.slope);
    if (!std::isfinite(empty.stored)) empty.stored = 0;
    empty.value = values(static_cast<double>(empty.stored));
    return empty;
}

/// Whether what empty samples add has to be told from the length of a ray.
bool needs_lengths(const Empty& empty, const Request& want) {
    return want.mode->divides || empty.value != want.zero;
}

/// Rows of a band: footprints at its edge are added twice.
std::int64_t rows_of(const SplatView& of, const Extent& picture) {
    constexpr std::int64_t kLeast = 32, kBands = 16;
    return std::max(
        {kLeast, 4 * std::int64_t{of.splat.patch[1]}, (picture.y + kBands - 1) / kBands});
}

std::int64_t pitch_of(const kernels::Splat& splat, std::int64_t width) {
    using kernels::SplatSums;
    return SplatSums::left(splat) + width + SplatSums::right(splat);
}

std::int64_t floats_of(const kernels::Splat& splat, std::int64_t width, std::int64_t rows) {
    using kernels::SplatSums;
    return pitch_of(splat, width) * (SplatSums::above(splat) + rows + SplatSums::below(splat));
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const SplatView of = view_of(offer.from, ask.want, view);
    constexpr int kVector = 4;  // pixels of a row that are written at least
    const auto along_row = (of.splat.patch[0] + kVector - 1) / kVector * kVector;
    const double voxels = splatted(offer, ask);
    const double writes = voxels * along_row * of.splat.patch[1];
    const auto samples = static_cast<double>(offer.from.samples());
    const auto pixels = static_cast<double>(offer.to.samples());
    const std::int64_t rows = rows_of(of, offer.to.extent);
    // Bands share the voxels at their edges.
    const double twice = 1 + of.splat.patch[1] / static_cast<double>(rows);
    const double table = kernels::Footprints::bytes(of.slopes);
    const bool lengths = needs_lengths(empty_of(offer.from.values, ask.scene), ask.want);
    constexpr int kFaces = 27;  // tables: of voxels inside and at the volume's faces
    return {.operations = twice * (4 * samples + 30 * voxels) + 10 * writes +
                          table * kernels::Footprints::kSections +
                          (lengths ? kSpanOperations + 3 : 3) * pixels,
            .streamed = twice * offer.from.bytes() + 3 * offer.to.bytes(),
            .gathers = writes,
            .scratch = 4.0 * static_cast<double>(floats_of(of.splat, offer.to.extent.x, rows)) +
                       static_cast<double>(sizeof(kernels::Splatted)) *
                           static_cast<double>(offer.from.extent.x),
            .workspace = kFaces * table};
}

Error error(const Offer&, const Ask& ask) {
    Error error = cast_error(kernel(), kCastStep, ask);
    // A ray is moved along both axes, by any part of half a cell either way: RMS of a uniform
    // distribution. Half of the range a voxel is a steep slope. It differs from slice to slice.
    const double moved = std::sqrt(2.0 / 12) / kernels::Footprints::kCells;
    const double sample = 0.5 * moved * (ask.scene.high - ask.scene.low);
    error.noise = std::hypot(error.noise, error.noise_gain * sample);
    return error;
}

/// What sums of a band become.
class Finish {
 public:
    Finish(const Data& in, const Request& want, int view, const Empty& empty, double slice)
        : want_(want),
          empty_(empty),
          scale_(in.what.values.slope * slice),
          lengths_(needs_lengths(empty, want)) {
        cast_.volume = kernels::grid_of(in);
        cast_.hold = kernels::Hold::foh;
        cast_.rule = want.mode->combine;
        cast_.rays = rays_of(in.what, want, view, -0.5);
        cast_.unit = want.unit;
        cast_.zero = want.zero;
        cast_.miss = rule_miss(want);
    }

    /// @param sum  of pixel (x, y), in stored numbers and voxels of the axis along rays
    float operator()(float sum, std::int64_t x, std::int64_t y) const {
        const double added = scale_ * static_cast<double>(sum);  // [value t]
        if (!lengths_) return static_cast<float>(added * want_.unit);
        const kernels::RayPath path =
            ray_path(cast_, static_cast<double>(x), static_cast<double>(y));
        if (!want_.mode->divides)
            return static_cast<float>((added + (empty_.value - want_.zero) * path.length) *
                                      want_.unit);
        if (!path.hit()) return static_cast<float>(cast_.miss);
        // Where a ray enters and leaves is known to a part of a cell, which a short ray shows.
        constexpr double kShort = 8;
        if (path.length < kShort) return cast(x, y);
        return static_cast<float>(empty_.value + added / path.length);
    }

 private:
    float cast(std::int64_t x, std::int64_t y) const {
        kernels::RayCast cast = cast_;
        cast.step = kCastStep;
        float mean = 0;
        kernels::ray_cast(cast, x, y, 1, 1, &mean, 1);
        return mean;
    }

    const Request& want_;
    Empty empty_;
    double scale_;
    bool lengths_;
    kernels::RayCast cast_;  // a step of 1: lengths are in t
};

/// A picture is one region: it is cut into bands inside, which share the tables.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    using kernels::SplatSums;
    const Empty empty = empty_of(in.what.values, ask.scene);
    SplatView of = view_of(in.what, ask.want, context.view);
    kernels::Footprints footprints(of.across, of.along, of.slopes, context.memory);
    kernels::Splat& splat = of.splat;
    splat.volume = kernels::grid_of(in);
    splat.empty = empty.stored;
    splat.footprints = &footprints;
    const Finish finish(in, ask.want, context.view, empty, of.slice);
    const std::int64_t width = region.extent().x;
    const Extent& n = in.what.extent;
    for_tiles(region, width, rows_of(of, out.what.extent), context, [&](const Region& band) {
        const auto floats = static_cast<std::size_t>(floats_of(splat, width, band.extent().y));
        kernels::Block<float> block(floats, context.memory);
        std::fill_n(block.data(), floats, 0.0f);
        kernels::Block<kernels::Splatted> row(static_cast<std::size_t>(n.x), context.memory);
        SplatSums sums{.begin = {band.begin[0], band.begin[1]},
                       .end = {band.end[0], band.end[1]},
                       .pitch = pitch_of(splat, width)};
        sums.first = block.data() + SplatSums::above(splat) * sums.pitch + SplatSums::left(splat);
        constexpr std::int64_t kSlices = 8;  // between polls
        for (std::int64_t z = 0; z < n.z; z += kSlices) {
            if (context.stopped()) return;
            kernels::splat(splat, z, std::min(z + kSlices, n.z), sums, row.data());
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
    return edge;
}

}  // namespace edgewise
