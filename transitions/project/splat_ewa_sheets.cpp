#include "transitions/project/splat_ewa_sheets.hpp"

#include <algorithm>
#include <cmath>

#include "graph/spread.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/splat_ewa_sheets.hpp"
#include "transitions/project/classified_rows.hpp"
#include "transitions/project/gaussian_sums.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/project/splat_ewa_view.hpp"

namespace edgewise {
namespace {

using kernels::EwaSheets;
using kernels::EwaSplat;

constexpr std::int64_t kTilePitch = SheetTile::kWidth + kernels::kEwaRoom;
constexpr SheetTile::Layout kTileLayout = {
    .floats = kTilePitch * (SheetTile::kHeight + 1), .first = 0, .pitch = kTilePitch};

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (!is_whole(from)) return Offer::no("footprints of one picture are added in one memory");
    if (std::string reason = no_classified_splats(ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (want.eye)
        for (int variant = 0; variant < want.views.different(); ++variant)
            if (std::string reason = no_ewa_distance(from, want, want.views.first_view(variant));
                !reason.empty())
                return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, want), .with = with};
}

/// The axis that the ray through the middle of the picture is steepest to.
int steepest_axis(const kernels::Rays& rays, const Request& want) {
    const std::array<double, 3> d = rays.direction.at(static_cast<double>(want.screen.x - 1) / 2,
                                                      static_cast<double>(want.screen.y - 1) / 2);
    int along = 2;
    for (const int axis : {1, 0})
        if (std::abs(d[static_cast<std::size_t>(axis)]) >
            std::abs(d[static_cast<std::size_t>(along)]))
            along = axis;
    return along;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    constexpr double kVoxel = 90, kPixel = 45, kSheetPixel = 45, kPixelSums = 1000, kRow = 60;
    const EwaSplat splat = ewa_view_of(offer.from, ask.want, view, offer.with);
    std::array<double, 2> reach = ewa_spread_of(splat, offer.from.extent);
    for (double& side : reach)
        side = EwaSplat::kRadius * std::sqrt(splat.variance * side + splat.low_pass);
    const auto [right, down] = reach;
    const double voxels = voxels_seen(offer.from, ask);
    const auto pixels = static_cast<double>(offer.to.samples());
    const Extent& n = offer.to.extent;
    const auto width = static_cast<double>(std::min(SheetTile::kWidth, n.x));
    const auto height = static_cast<double>(std::min(SheetTile::kHeight, n.y));
    // Tiles share the voxels at their edges, but no pixel, and look at all rows.
    const double twice = (1 + 2 * right / width) * (1 + 2 * down / height);
    // Vectors of eight pixels, of rows that begin anywhere.
    const double writes = voxels * (2 * right + 8) * (2 * down + 1);
    const int along = steepest_axis(rays_of(offer.from, ask.want, view), ask.want);
    const auto slices = static_cast<double>(offer.from.extent[along]);
    const double rows = static_cast<double>(offer.from.samples()) /
                        static_cast<double>(offer.from.extent[axes_by_slices(along)[0]]);
    return {.operations = ClassifiedRows::operations(offer.from, ask) + twice * kVoxel * voxels +
                          kPixel * writes + (kSheetPixel * slices + kSpanOperations) * pixels +
                          kPixelSums * std::min(pixels, writes) +
                          kRow * rows * pixels / (width * height),
            .streamed = 2 * offer.from.bytes() + offer.to.bytes() +
                        2 * ClassifiedRows::bytes(offer.from, ask),
            .gathers = 4 * writes,
            .scratch = SheetTile::bytes(kTileLayout) + kArraySlack,
            .workspace = ClassifiedRows::bytes(offer.from, ask)};
}

/// The length inside that sums over depth stand for, over what a constant's would be.
class LengthOfSums {
 public:
    LengthOfSums(const Data& in, const Request& want, int view, const EwaSplat& splat)
        : sums_(rays_of(in.what, want, view, -0.5), in.what.extent, splat.variance,
                splat.low_pass) {
        cast_.volume.extent = in.what.extent;
        cast_.rays = rays_of(in.what, want, view, -0.5);
    }
    float at(std::int64_t x, std::int64_t y) const {
        const auto px = static_cast<double>(x), py = static_cast<double>(y);
        const double length = ray_path(cast_, px, py).length;
        const double all = length > 0 ? sums_.along(px, py) : 0;
        if (!(all > 0)) return 0;
        // A slanted ray is longer than its extent in depth.
        const std::array<double, 3> m = cast_.rays.measure.at(px, py);
        return static_cast<float>(length * std::hypot(m[0], m[1], m[2]) / (std::abs(m[2]) * all));
    }

 private:
    kernels::RayCast cast_;
    GaussianSums sums_;
};

/// Slices from front to back: no ray crosses the plane of slices that the eye lies in.
class SliceOrder {
 public:
    SliceOrder(const kernels::Rays& rays, int along, std::int64_t slices, bool eye)
        : slices_(slices) {
        const auto axis = static_cast<std::size_t>(along);
        if (eye) {
            const double at = std::ceil(rays.origin.base[axis]);
            first_ = static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(slices)));
        } else {
            first_ = rays.direction.base[axis] < 0 ? slices : 0;
        }
    }
    /// Up from the first one, then down from the one before it.
    std::int64_t at(std::int64_t i) const {
        const std::int64_t up = slices_ - first_;
        return i < up ? first_ + i : slices_ - 1 - i;
    }

 private:
    std::int64_t slices_, first_;
};

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const kernels::Rays rays = rays_of(in.what, want, context.view, -0.5);
    const int along = steepest_axis(rays, want);
    ClassifiedRows classified(in, want, along, 1, context);
    EwaSheets of{ewa_view_of(in.what, want, context.view, offer.with), classified.rows()};
    const LengthOfSums lengths(in, want, context.view, of.splat);
    const std::int64_t slices = in.what.extent[along];
    const SliceOrder order(rays, along, slices, want.eye.has_value());
    for_tiles(region, SheetTile::kWidth, SheetTile::kHeight, context, [&](const Region& part) {
        SheetTile tile(part, kTileLayout, context.memory);
        for (std::int64_t y = 0; y < part.extent().y; ++y)
            for (std::int64_t x = 0; x < part.extent().x; ++x)
                tile.length(x, y) = lengths.at(part.begin[0] + x, part.begin[1] + y);
        bool seen = true;
        for (std::int64_t i = 0; i < slices && seen; ++i) {
            const std::int64_t slice = order.at(i);
            if (!of.rows.has(slice)) continue;
            if (context.stopped()) return;
            kernels::add_to_ewa_sheet(of, slice, tile.sheet(), tile.plane());
            seen = tile.composite();
        }
        tile.finish(out);
    });
}

/// A picture is one region: it is cut into tiles inside, which share the voxels.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

}  // namespace

Transition splat_ewa_sheets() {
    Transition edge;
    edge.name = "project.splat_ewa_sheets";
    edge.source = "Zwicker, Pfister, van Baar, Gross 2001; Westover 1990";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"sigma", number(0.4, 2, {0.6}, "standard deviation of the kernel, in voxels")},
        {"lowpass", number(0, 2, {0.6}, "standard deviation added to footprints, in pixels")}};
    edge.on_demand = true;  // casts blur less, do not pop, and take less time
    edge.offer = offer;
    edge.work = work;
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
