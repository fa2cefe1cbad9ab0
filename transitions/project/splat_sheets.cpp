#include "transitions/project/splat_sheets.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/splat_sheets.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/combine_model.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/project/splat_view.hpp"

namespace edgewise {
namespace {

using kernels::Footprints;
using kernels::SheetVoxel;
using kernels::SplatSums;

constexpr std::int64_t kWidth = 64, kHeight = 32;  // of a tile: its sheets stay in the caches
constexpr std::ptrdiff_t kPlane = kWidth * kHeight + 16;

/// One view of slabs. Slab k reaches from k to k + 1 thicknesses behind the front of the screen's
/// first layer.
struct SheetView {
    kernels::SheetSplat sheets;
    Footprints::Shape shape;
    double thickness = 1;  // along the axis that rays are steepest to [voxel]
    double pixels = 0;     // that are written for one voxel and slab
};

SheetView view_of(const Representation& from, const Request& want, int view, double slab) {
    const SplatView of =
        splat_view_of(from, want, view, kernels::kSheetCells, Footprints::Depth::sections);
    const kernels::Rays rays = rays_of(from, want, view, -0.5);
    const auto along = static_cast<std::size_t>(of.shape.along);
    const double step = slab * rays.direction.base[along];
    SheetView made;
    made.shape = of.shape;
    made.thickness = std::abs(step);
    made.pixels = of.pixels_written();
    kernels::SheetSplat& sheets = made.sheets;
    sheets.splat = of.splat;
    // Half a section more: the nearest one is taken.
    sheets.along.base = fixed_place(rays.origin.base[along] + 0.5 / kernels::kSections);
    sheets.along.px = fixed_place(rays.origin.x[along]);
    sheets.along.py = fixed_place(rays.origin.y[along]);
    sheets.along.voxel[along] = fixed_place(-1);
    sheets.sheet = fixed_place(step);
    const Mat4 map = residual(from, want, view);
    sheets.depth.base = (map(2, 3) + 0.5) / slab;
    double reach = 0;
    for (int axis = 0; axis < 3; ++axis) {
        sheets.depth.voxel[static_cast<std::size_t>(axis)] = map(2, axis) / slab;
        reach += std::abs(map(2, axis));
    }
    // A section, and half a cell along two axes.
    constexpr double kMoved = 1 + 1.0 / kernels::kSections;
    sheets.reach = kMoved * reach / slab;
    return made;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (std::string reason = no_splatting(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    const Combine combine = want.mode->combine;
    if (combine != Combine::over && combine != Combine::max)
        return Offer::no("sheets are for what hides, and for the largest and least samples");
    const double slab = with.number("slab");
    for (int variant = 0; variant < want.views.different(); ++variant) {
        constexpr double kThinnest = 0.25;
        const int view = want.views.first_view(variant);
        const SheetView of = view_of(from, want, view, slab);
        constexpr std::int64_t kLongest = 2000;  // places wrap around at 2048
        if (const std::int64_t n = from.extent[of.shape.along]; n > kLongest)
            return Offer::no(
                fmt::format("view {}: rays go along {} voxels; at most {}", view, n, kLongest));
        if (of.thickness < kThinnest)
            return Offer::no(fmt::format("view {}: a slab is {:.3g} voxels thick; at least {}",
                                         view, of.thickness, kThinnest));
    }
    return {.from = from, .to = screen_picture(from, want), .with = with};
}

/// Whether sheets on which there is nothing may be left out.
bool leaves_out_empty(const Request& want, const EmptySample& empty, const Scene& scene) {
    return want.mode->needs && want.mode->needs(want, empty.value, scene.low, scene.high).empty();
}

std::int64_t sheet_floats(const kernels::Splat& splat) {
    return (SplatSums::floats_of(splat, kWidth, kHeight) + 15) / 16 * 16;
}

/// Sheets that are kept at a time: those of one voxel, and a plane of samples.
double tile_bytes(const SheetView& of, Mode mode) {
    const int planes = kernels::PixelStates::planes(mode->combine, mode->rule) + 5;
    return 4.0 * static_cast<double>(of.sheets.sheets() * sheet_floats(of.sheets.splat) +
                                     planes * kPlane) +
           4 * kArraySlack;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const Request& want = ask.want;
    const double slab = offer.with.number("slab");
    const SheetView of = view_of(offer.from, want, view, slab);
    const double voxels = samples_splatted(offer.from, ask);
    const double writes = voxels * of.pixels * of.sheets.sheets();
    const auto samples = static_cast<double>(offer.from.samples());
    const auto pixels = static_cast<double>(offer.to.samples());
    const Extent& n = offer.to.extent;
    // Tiles share the voxels at their edges, and look at all of the rows that may meet them.
    const auto& patch = of.sheets.splat.patch;
    const double twice = (1 + double(patch[0]) / double(std::min(kWidth, n.x))) *
                         (1 + double(patch[1]) / double(std::min(kHeight, n.y)));
    const double slabs = pixels * mean_length(offer.from, want, view) / slab;
    const EmptySample empty = empty_sample(offer.from.values, ask.scene);
    // Where anything lies on the sheet of a tile, all of it is combined.
    constexpr double kAround = 4;
    const double combined = leaves_out_empty(want, empty, ask.scene)
                                ? slabs * std::min(1.0, kAround * voxels / std::max(1.0, samples))
                                : slabs;
    const double table = of.shape.bytes();
    constexpr int kFaces = 27;  // tables: of voxels inside and at the volume's faces
    return {
        .operations = samples + 2 * twice * 30 * voxels + twice * 9 * writes +
                      combined * (12 + combining_operations(want, offer.from.values)) +
                      2 * kSpanOperations * pixels + 4 * table / sizeof(float),
        .streamed = offer.from.bytes() + offer.to.bytes() + 3 * twice * voxels * sizeof(SheetVoxel),
        // From the table, and the sums themselves.
        .gathers = 2 * twice * writes,
        .scratch = tile_bytes(of, want.mode) + static_cast<double>(sizeof(kernels::Splatted)) *
                                                   static_cast<double>(offer.from.extent.x),
        .workspace = kFaces * table + SplatSpans::bytes(offer.from.extent) +
                     2 * twice * voxels * sizeof(SheetVoxel)};
}

/// Voxels from front to back; where they begin on the same sheet, in the order of memory.
void sort(const SheetVoxel* from, SheetVoxel* to, std::int64_t count, int first, int sheets,
          std::pmr::memory_resource* memory) {
    kernels::Block<std::int64_t> begins(static_cast<std::size_t>(sheets) + 1, memory);
    std::fill_n(begins.data(), sheets + 1, 0);
    for (std::int64_t i = 0; i < count; ++i)
        ++begins[static_cast<std::size_t>(from[i].sheet - first) + 1];
    std::partial_sum(begins.data(), begins.data() + sheets + 1, begins.data());
    for (std::int64_t i = 0; i < count; ++i)
        to[begins[static_cast<std::size_t>(from[i].sheet - first)]++] = from[i];
}

/// One tile of a picture.
class Tile {
 public:
    Tile(const SheetView& of, const kernels::RayCast& rays, const kernels::Combining& with,
         const Region& tile, Mode mode, Context& context)
        : of_(of),
          rays_(rays),
          with_(with),
          tile_(tile),
          size_(tile.extent()),
          context_(context),
          memory_(static_cast<std::size_t>(tile_bytes(of, mode)), context.memory),
          planes_(of.sheets.sheets()),
          plane_(sheet_floats(of.sheets.splat)) {
        first_ = static_cast<float*>(memory_.data());
        std::fill_n(first_, planes_ * plane_, 0.0f);
        low_ = first_ + planes_ * plane_;
        high_ = low_ + kPlane;
        in_ = high_ + kPlane;
        out_ = in_ + kPlane;
        samples_ = out_ + kPlane;
        states_ = {samples_ + kPlane, kWidth, kPlane};
        const kernels::Splat& splat = of.sheets.splat;
        sums_ = {.begin = {tile.begin[0], tile.begin[1]},
                 .end = {tile.end[0], tile.end[1]},
                 .first = first_ + SplatSums::first_of(splat, kWidth),
                 .pitch = SplatSums::pitch_of(splat, kWidth)};
        find_spans();
        kernels::clear_states(with_, states_, size_.x, size_.y);
    }

    /// @param leaves_out  sheets without a voxel
    void combine(bool leaves_out) {
        const kernels::Splat& splat = of_.sheets.splat;
        kernels::Block<kernels::Splatted> row(static_cast<std::size_t>(splat.volume.extent.x),
                                              context_.memory);
        const std::int64_t count = kernels::sheet_voxels(of_.sheets, sums_, row.data(), nullptr);
        const auto room = static_cast<std::size_t>(std::max<std::int64_t>(1, count));
        kernels::Block<SheetVoxel> found(room, context_.memory), sorted(room, context_.memory);
        kernels::sheet_voxels(of_.sheets, sums_, row.data(), found.data());
        int begin = first_sheet_, end = last_sheet_ + 1;  // of rays; then of voxels
        for (std::int64_t i = 0; i < count; ++i) {
            begin = std::min(begin, int{found[static_cast<std::size_t>(i)].sheet});
            end = std::max(end, int{found[static_cast<std::size_t>(i)].sheet} + planes_);
        }
        sort(found.data(), sorted.data(), count, begin, end - begin, context_.memory);
        std::int64_t next = 0;
        int written = begin;  // voxels lie on sheets before
        for (int sheet = begin; sheet < end; ++sheet) {
            std::int64_t last = next;
            while (last < count && sorted[static_cast<std::size_t>(last)].sheet == sheet) ++last;
            kernels::splat_sheets(of_.sheets, sorted.data() + next, last - next, sums_, planes_,
                                  plane_);
            if (last > next) written = sheet + planes_;
            next = last;
            if (context_.stopped()) return;
            float* sums = sums_.first + plane_of(sheet);
            if (sheet < written || !leaves_out) add(sheet, sums);
            if (sheet < written) std::fill_n(first_ + plane_of(sheet), plane_, 0.0f);
        }
    }

    void finish(float* out, std::ptrdiff_t row) const {
        kernels::finish_states(with_, states_, size_.x, size_.y, out, row);
    }

 private:
    /// Where a sheet's plane begins. Voxels need no more planes at a time than one of them has.
    std::ptrdiff_t plane_of(int sheet) const {
        return (sheet % planes_ + planes_) % planes_ * plane_;
    }

    /// Where rays are inside [slab], and where that is of samples at the middle of slabs.
    void find_spans() {
        double first = 1e9, last = -1e9;
        for (std::int64_t y = 0; y < size_.y; ++y)
            for (std::int64_t x = 0; x < size_.x; ++x) {
                const kernels::RayPath path =
                    ray_path(rays_, static_cast<double>(tile_.begin[0] + x),
                             static_cast<double>(tile_.begin[1] + y));
                const std::ptrdiff_t i = y * kWidth + x;
                low_[i] = 1, high_[i] = 0, in_[i] = 1, out_[i] = 0;
                if (!path.hit()) continue;
                const double begin = static_cast<double>(path.first) + 0.5 + path.first_offset -
                                     0.5 * path.first_weight;
                const CombinedSpan span = combined_span(begin - 0.5, begin + path.length - 0.5);
                low_[i] = span.low, high_[i] = span.high;
                in_[i] = static_cast<float>(begin);
                out_[i] = static_cast<float>(begin + path.length);
                first = std::min(first, begin);
                last = std::max(last, begin + path.length);
            }
        if (first > last) return;
        first_sheet_ = static_cast<int>(std::floor(first));
        last_sheet_ = static_cast<int>(std::floor(last));
    }

    /// Sums over the length of a slab that is inside are samples. Tables know the faces that rays
    /// are steepest to by whole sections, and so does that length.
    void add(int sheet, const float* sums) {
        const kernels::FixedPlace& along = of_.sheets.along;
        const int axis = of_.shape.along;
        const std::int64_t n = rays_.volume.extent[axis];
        constexpr int kHalf = kernels::kSections / 2;
        const int near = -kHalf, far = static_cast<int>(n) * kernels::kSections - kHalf;
        const double step = rays_.step * rays_.rays.direction.base[static_cast<std::size_t>(axis)];
        for (std::int64_t y = 0; y < size_.y; ++y) {
            const float* sum = sums + y * sums_.pitch;
            for (std::int64_t x = 0; x < size_.x; ++x) {
                const std::int64_t px = tile_.begin[0] + x, py = tile_.begin[1] + y;
                const std::ptrdiff_t i = y * kWidth + x;
                const double inside =
                    std::min<double>(out_[i], sheet + 1) - std::max<double>(in_[i], sheet);
                samples_[i] = of_.sheets.splat.empty;
                if (!(inside > 0)) continue;
                const std::uint32_t place = along.base + along.right(px) + along.down(py) +
                                            static_cast<std::uint32_t>(sheet) * of_.sheets.sheet;
                const int one = kernels::section_of(place);
                const int other = kernels::section_of(place + of_.sheets.sheet);
                const int sections =
                    std::min(std::max(one, other), far) - std::max(std::min(one, other), near);
                if (sections <= 0) continue;
                const double begin =
                    rays_.rays.origin.at(double(px), double(py))[static_cast<std::size_t>(axis)] +
                    sheet * step;
                const double between = std::min(std::max(begin, begin + step), double(n) - 0.5) -
                                       std::max(std::min(begin, begin + step), -0.5);
                // The other faces. At the ends of a ray, samples of less than half of a slab are
                // none.
                const double kept = std::clamp(inside * of_.thickness / between, 0.5, 1.0);
                samples_[i] += sum[x] * static_cast<float>(kernels::kSections / (sections * kept));
            }
        }
        kernels::Grid plane;
        plane.extent = {kWidth, kHeight, 1};
        plane.row = kWidth;
        plane.slice = kPlane;
        // Through an integer: the first plane lies outside of what was allocated.
        plane.samples = reinterpret_cast<const void*>(  // NOLINT: see above
            reinterpret_cast<std::uintptr_t>(samples_) -
            static_cast<std::uintptr_t>(sheet * kPlane * std::ptrdiff_t{sizeof(float)}));
        kernels::combine(with_, plane, 0, 0, size_.x, size_.y, sheet, sheet + 1,
                         {low_, high_, kWidth}, states_);
    }

    const SheetView& of_;
    const kernels::RayCast& rays_;
    const kernels::Combining& with_;
    Region tile_;
    Extent size_;
    Context& context_;
    Array memory_;
    int planes_;
    std::ptrdiff_t plane_;
    float *first_, *low_, *high_, *in_, *out_, *samples_;
    kernels::PixelStates states_;
    SplatSums sums_;
    int first_sheet_ = 0, last_sheet_ = -1;
};

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const double slab = offer.with.number("slab");
    const EmptySample empty = empty_sample(in.what.values, ask.scene);
    SheetView of = view_of(in.what, want, context.view, slab);
    Footprints footprints(of.shape, context.memory);
    of.sheets.splat.volume = kernels::grid_of(in);
    of.sheets.splat.empty = empty.stored;
    of.sheets.splat.footprints = &footprints;
    SplatSpans spans(of.sheets.splat, context);
    of.sheets.splat.spans = spans.data();
    kernels::RayCast rays;
    rays.volume.extent = in.what.extent;
    rays.rays = rays_of(in.what, want, context.view, -0.5);
    rays.step = slab;
    const kernels::Optics optics = optics_of(want, in.what.values);
    kernels::Combining with = combining_of(want, in.what.values, optics);
    with.step = slab;
    const bool leaves_out = leaves_out_empty(want, empty, ask.scene);
    for_tiles(region, kWidth, kHeight, context, [&](const Region& part) {
        Tile tile(of, rays, with, part, want.mode, context);
        tile.combine(leaves_out);
        float* first = out.at<float>(part.begin[0], part.begin[1], 0);
        tile.finish(first, out.row());
        give_sign(want, first, part.extent().x, part.extent().y, out.row());
    });
}

/// A picture is one region: it is cut into tiles inside, which share the tables.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

}  // namespace

Transition splat_sheets() {
    Transition edge;
    edge.name = "project.splat_sheets";
    edge.source = "Mueller and Crawfis 1998; Westover 1990";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"slab", number(0.25, 4, {1}, "thickness of a sheet, in the smallest spacing")}};
    edge.on_demand = true;  // its error is measured by runs
    edge.offer = offer;
    edge.work = work;
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
