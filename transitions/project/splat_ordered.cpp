#include "transitions/project/splat_ordered.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/kernels/splat_ordered.hpp"
#include "transitions/project/classified_rows.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/splat_view.hpp"

namespace edgewise {
namespace {

using kernels::Footprints;
using kernels::OrderedSplat;
using kernels::SplatSums;

const char* const kBySample = "sample";
const char* const kBySheet = "sheet";

SplatView whole_footprints(const Representation& from, const Request& want, int view) {
    return splat_view_of(from, want, view, Footprints::Shape{}.cells, Footprints::Depth::whole);
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_splatting(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_classified_splats(ask); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

SheetTile::Layout layout_of(const kernels::Splat& splat) {
    return {.floats = SplatSums::floats_of(splat, SheetTile::kWidth, SheetTile::kHeight),
            .first = SplatSums::first_of(splat, SheetTile::kWidth),
            .pitch = SplatSums::pitch_of(splat, SheetTile::kWidth)};
}

Work work(const Offer& offer, const Ask& ask, int view) {
    constexpr double kVoxel = 40, kComposited = 45, kAdded = 15, kSheetPixel = 45, kRow = 30;
    const SplatView of = whole_footprints(offer.from, ask.want, view);
    const bool sheets = offer.with.word("order") == kBySheet;
    const double voxels = voxels_seen(offer.from, ask);
    const auto pixels = static_cast<double>(offer.to.samples());
    // Tiles share the voxels at their edges, and look at all rows.
    const Extent& n = offer.to.extent;
    const auto width = static_cast<double>(std::min(SheetTile::kWidth, n.x));
    const auto height = static_cast<double>(std::min(SheetTile::kHeight, n.y));
    const double twice = (1 + of.splat.patch[0] / width) * (1 + of.splat.patch[1] / height);
    const double writes = twice * voxels * of.pixels_written();
    const auto slices = static_cast<double>(offer.from.extent[of.shape.along]);
    const double rows = static_cast<double>(offer.from.samples()) /
                        static_cast<double>(offer.from.extent[axes_by_slices(of.shape.along)[0]]);
    const double table = of.shape.bytes();
    constexpr int kFaces = 27;  // tables: of voxels inside and at the volume's faces
    return {.operations =
                ClassifiedRows::operations(offer.from, ask) + kVoxel * twice * voxels +
                (sheets ? kAdded * writes + kSheetPixel * slices * pixels : kComposited * writes) +
                kRow * rows * pixels / (width * height) +
                table / sizeof(float) * 4 * kernels::kSections,
            .streamed = 2 * offer.from.bytes() + offer.to.bytes() +
                        2 * ClassifiedRows::bytes(offer.from, ask),
            // From the table, and the four sums themselves.
            .gathers = 5 * writes,
            .scratch = SheetTile::bytes(layout_of(of.splat)) + kArraySlack,
            .workspace = kFaces * table + ClassifiedRows::bytes(offer.from, ask)};
}

/// One voxel after the other.
class CompositedTile {
 public:
    CompositedTile(const OrderedSplat& of, const Region& tile, std::pmr::memory_resource* memory)
        : of_(of),
          tile_(tile),
          layout_(layout_of(of.splat)),
          memory_(static_cast<std::size_t>(4 * layout_.floats), memory),
          pixels_{.begin = {tile.begin[0], tile.begin[1]},
                  .end = {tile.end[0], tile.end[1]},
                  .first = memory_.data() + layout_.first,
                  .pitch = layout_.pitch} {
        std::fill_n(memory_.data(), layout_.floats, 1.0f);
        std::fill_n(memory_.data() + layout_.floats, 3 * layout_.floats, 0.0f);
    }
    /// @return whether anything behind can be seen
    bool add(std::int64_t slice) {
        constexpr auto kBound = static_cast<float>(kTerminated);
        kernels::composite_voxels(of_, slice, pixels_, layout_.floats, kBound);
        for (std::int64_t y = 0; y < tile_.extent().y; ++y)
            for (std::int64_t x = 0; x < tile_.extent().x; ++x)
                if (pixels_.first[y * pixels_.pitch + x] > kBound) return true;
        return false;
    }
    void finish(Data& out) const {
        for (std::int64_t y = 0; y < tile_.extent().y; ++y)
            for (std::int64_t x = 0; x < tile_.extent().x; ++x) {
                const float* pixel = pixels_.first + y * pixels_.pitch + x;
                float* to = out.at<float>(tile_.begin[0] + x, tile_.begin[1] + y, 0);
                for (std::ptrdiff_t c = 0; c < 3; ++c) to[c] = pixel[(c + 1) * layout_.floats];
                to[3] = 1 - *pixel;
            }
    }

 private:
    const OrderedSplat& of_;
    Region tile_;
    SheetTile::Layout layout_;
    kernels::Block<float> memory_;
    SplatSums pixels_;
};

/// A slice after the other.
class SummedTile {
 public:
    SummedTile(const OrderedSplat& of, const Region& tile, std::pmr::memory_resource* memory)
        : of_(of), tile_(tile, layout_of(of.splat), memory) {}
    bool add(std::int64_t slice) {
        kernels::add_to_sheet(of_, slice, tile_.sheet(), tile_.plane());
        return tile_.composite();
    }
    void finish(Data& out) const { tile_.finish(out); }

 private:
    const OrderedSplat& of_;
    SheetTile tile_;
};

/// All tiles of a region, by slices from front to back.
template <class Tile>
void make(const OrderedSplat& of, bool backwards, const Region& region, Data& out,
          const Context& context) {
    const std::int64_t slices = of.rows.count(2);
    for_tiles(region, SheetTile::kWidth, SheetTile::kHeight, context, [&](const Region& part) {
        Tile tile(of, part, context.memory);
        bool seen = true;
        for (std::int64_t i = 0; i < slices && seen; ++i) {
            const std::int64_t slice = backwards ? slices - 1 - i : i;
            if (!of.rows.has(slice)) continue;
            if (context.stopped()) return;
            seen = tile.add(slice);
        }
        tile.finish(out);
    });
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const SplatView view = whole_footprints(in.what, ask.want, context.view);
    ClassifiedRows classified(in, ask.want, view.shape.along, view.slice, context);
    Footprints footprints(view.shape, context.memory);
    OrderedSplat of{view.splat, classified.rows()};
    of.splat.volume.extent = in.what.extent;
    of.splat.footprints = &footprints;
    const kernels::Rays rays = rays_of(in.what, ask.want, context.view);
    const auto backwards = [&](std::size_t level) {
        return rays.direction.base[static_cast<std::size_t>(of.rows.axes[level])] < 0;
    };
    of.rows.backwards = {backwards(0), backwards(1)};
    if (offer.with.word("order") == kBySheet)
        make<SummedTile>(of, backwards(2), region, out, context);
    else
        make<CompositedTile>(of, backwards(2), region, out, context);
}

/// A picture is one region: it is cut into tiles inside, which share the voxels and the tables.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

}  // namespace

Transition splat_ordered() {
    Transition edge;
    edge.name = "project.splat_ordered";
    edge.source = "Westover 1989; Westover 1990";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"order", one_of({kBySheet, kBySample}, {kBySheet},
                         "what is composited: sums of slices (sheet) or every sample (sample)")}};
    edge.on_demand = true;  // sheets on the screen neither blur colours nor pop
    edge.offer = offer;
    edge.work = work;
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
