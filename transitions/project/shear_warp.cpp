#include "transitions/project/shear_warp.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/shear_warp.hpp"
#include "transitions/kernels/spline_prefilter.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/shear_border.hpp"
#include "transitions/project/shear_view.hpp"
#include "transitions/project/shear_warp_model.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kWidth = 128, kHeight = 16;  // of a tile: states and rows stay in the caches
/// Floats of one plane of states. A vector that begins in the last row may end behind it, where no
/// pixel of the next plane stands: it would mix with a transparency that nobody wrote.
constexpr std::ptrdiff_t kPlane = kWidth * kHeight + 16;

const Filter& filter_of(const Parameters& with) { return filter_named(with.word("filter")); }

/// No new value appears.
bool takes_nearest(const Parameters& with) { return filter_of(with).taps == 1; }

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.eye) return Offer::no("the eye is at a finite distance: shears differ by slice");
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_slices(ask.want); !reason.empty())
        return Offer::no(std::move(reason));
    if (!is_whole(from)) return Offer::no("slices are sheared in the memory of one rank");
    if (ask.want.field == Field::nearest && !takes_nearest(with))
        return Offer::no("labels: only filter=zoh makes no new value");
    if (ask.scene.non_finite > 0 && !takes_nearest(with))
        return Offer::no(fmt::format(
            "{} samples are not finite: rays would miss all that was interpolated from them; only "
            "filter=zoh keeps them to themselves",
            ask.scene.non_finite));
    constexpr double kSteepest = 1 + 1e-9;
    for (int variant = 0; variant < ask.want.views.different(); ++variant) {
        const int view = ask.want.views.first_view(variant);
        const auto d = rays_of(from, ask.want, view).direction.base;
        const double across = std::max(std::abs(d[0]), std::abs(d[1]));
        if (!(across <= kSteepest * std::abs(d[2])))
            return Offer::no(fmt::format(
                "view {}: rays cross {:.3g} voxels of a slice from one to the next; at most 1",
                view, across / std::abs(d[2])));
    }
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

double image_bytes(const ShearView& f, Mode mode) {
    return 4.0 * static_cast<double>(f.image.samples()) * mode->channels;
}

double tile_bytes(Mode mode) {
    const int planes = kernels::PixelStates::planes(mode->combine, mode->rule) + 2;
    return static_cast<double>(planes * kPlane) * 4.0 + 2 * kArraySlack;
}

/// Whether the picture is read from a spline through the intermediate image: that of first-order
/// hold would be a second blur, which costs a MIP a sixth of its accuracy. Other pictures may not
/// go below zero, and samples that are not finite would spread over the whole of them.
bool smooth(const Parameters& with, Mode mode) {
    return !takes_nearest(with) && mode->extreme != 0;
}

/// Operations a voxel: three interpolations of two operations, then the rule with its states. The
/// largest integers stay in registers, bytes in lanes of 16 bits (kernels::shear_warp_max).
double voxel_operations(const Offer& offer, const Ask& ask, bool nearest, double step) {
    const double hold = nearest ? 0 : 6;
    if (ask.want.mode->takes_transfer) {
        const kernels::Optics optics = optics_of(ask.want, offer.from.values);
        return hold + 14 + static_cast<double>(optics.ramps.size()) * (optics.grey ? 8 : 12) +
               (step == optics.unit
                    ? 0
                    : ask.scene.fact(kCastCorrected).value_or(1) * kCorrectionOperations);
    }
    if (ask.want.mode->combine != Combine::max) return hold + 4 + ask.want.mode->operations;
    switch (offer.from.type) {
        case Type::u8:
        case Type::i8:
            return (hold + 1) / 4;
        case Type::u16:
        case Type::i16:
            return (hold + 1) / 2;
        default:
            return hold + 3;
    }
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const ShearView f = shear_view_of(offer.from, ask.want, view);
    const bool nearest = takes_nearest(offer.with);
    const bool spline = smooth(offer.with, ask.want.mode);
    // Slices wait for their rows, a tile's few lines of each, and for the states between: measured
    // with 48^3 to 192^3, that is 2.5 times what is counted, where the picture's taps, which lie
    // side by side, take half of as many gathers.
    constexpr double kWaiting = 2.5, kBeside = 0.5;
    const double voxels =
        static_cast<double>(offer.from.samples()) * (ask.want.mode->takes_transfer ? 1 : kWaiting);
    // Pixels of the image that a slice does not reach are passed over, by vectors or by tiles: 0.06
    // to 0.1 ns each, twice that in composites (48 to 192 voxels a row, 30 degrees). Weights differ
    // by mode because each mode has its own rate. A MIP counts the fewest operations for a voxel,
    // so its rate is the highest. With the weight of an X-ray its passed pixels would be priced
    // three times too high.
    const double passing = ask.want.mode->takes_transfer            ? 8
                           : ask.want.mode->combine == Combine::max ? 1
                                                                    : 4;
    const double passed =
        static_cast<double>(f.image.samples() * offer.from.extent.z - offer.from.samples());
    const double pixels = static_cast<double>(offer.to.samples());
    const int channels = ask.want.mode->channels;
    // FIGURE 27 for the picture: place 14, bilinear 9; of a spline weights and 16 taps, and the
    // recursions of its prefilter.
    const double hold = spline ? 54 : nearest ? 0 : 9 * channels;
    const double finish = spline ? 60 : 40;
    const double rows = spline ? 4 : nearest ? 1 : 2, taps = rows * rows;
    return {.operations = voxels * voxel_operations(offer, ask, nearest, f.step) +
                          passing * passed + finish * static_cast<double>(f.image.samples()) +
                          pixels * (14 + hold),
            .streamed = offer.from.bytes() + 2 * image_bytes(f, ask.want.mode) + offer.to.bytes(),
            .gathers = pixels * taps * channels * (spline ? kBeside : 1),
            // A tile's rows of a slice are too short for a processor to foresee the next ones; the
            // intermediate image is near.
            .lines = {offer.from.bytes() / kLineBytes, offer.from.bytes()},
            .scratch = tile_bytes(ask.want.mode),
            .workspace = image_bytes(f, ask.want.mode)};
}

Error error(const Offer& offer, const Ask& ask) {
    double step = 0;
    const int views = std::min(ask.want.views.different(), 8);
    for (int variant = 0; variant < views; ++variant)
        step = std::max(
            step, shear_view_of(offer.from, ask.want, ask.want.views.first_view(variant)).step);
    return sheared_error(filter_of(offer.with), step, ask);
}

/// Makes a box of the image; `image` holds it.
void project(const kernels::ShearWarp& warp, const Region& box, Mode mode, float* image,
             Context& context) {
    const int channels = mode->channels;
    const std::int64_t row = box.extent().x * channels;
    for_tiles(from_multiple(box, kWidth), kWidth, kHeight, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        const std::int64_t i = tile.begin[0], j = tile.begin[1];
        const std::int64_t skip = std::max<std::int64_t>(box.begin[0] - i, 0);
        const std::int64_t width = size.x - skip;
        Array scratch(static_cast<std::size_t>(tile_bytes(mode)), context.memory);
        float* low = static_cast<float*>(scratch.data());
        float* high = low + kPlane;
        const kernels::PixelStates states{high + kPlane, kWidth, kPlane};
        const kernels::PixelStates part{states.first + skip, kWidth, kPlane};
        kernels::shear_spans(warp, i + skip, j, width, size.y, low + skip, high + skip, kWidth);
        kernels::clear_states(warp.with, part, width, size.y);
        kernels::shear_warp(warp, i, j, size.x, size.y, {low, high, kWidth}, states, skip);
        kernels::finish_states(
            warp.with, part, width, size.y,
            image + (j - box.begin[1]) * row + (i + skip - box.begin[0]) * channels, row);
    });
}

struct Interval {
    float low, high;
};

Interval range_of(const float* values, std::int64_t count) {
    constexpr int kChains = 16;  // of comparisons that do not wait for each other
    std::array<float, kChains> low, high;
    low.fill(values[0]), high.fill(values[0]);
    for (std::int64_t i = 0; i + kChains <= count; i += kChains)
        for (int c = 0; c < kChains; ++c) {
            low[c] = std::min(low[c], values[i + c]);
            high[c] = std::max(high[c], values[i + c]);
        }
    for (std::int64_t i = count - count % kChains; i < count; ++i) {
        low[0] = std::min(low[0], values[i]);
        high[0] = std::max(high[0], values[i]);
    }
    return {*std::min_element(low.begin(), low.end()), *std::max_element(high.begin(), high.end())};
}

/// Beside an edge a spline overshoots: no ray has met such a value.
void clamp(const kernels::WarpOutput& picture, const Region& part, const Interval& range) {
    const Extent held = picture.held.extent(), size = part.extent();
    for (std::int64_t row = 0; row < size.y; ++row) {
        float* first = picture.samples +
                       ((part.begin[2] - picture.held.begin[2]) * held.y + part.begin[1] + row -
                        picture.held.begin[1]) *
                           held.x +
                       part.begin[0] - picture.held.begin[0];
        for (std::int64_t i = 0; i < size.x; ++i)
            first[i] = std::clamp(first[i], range.low, range.high);
    }
}

/// The box of the volume that the rays of a box of the image cross.
Region box_of_volume(const ShearView& f, const Region& image, const Extent& n) {
    struct Rays {
        double first, last, slope;  // place in slice 0 of the outermost ones; voxels a slice
    };
    const auto rays = [&](int axis, double at, double slope) {
        return Rays{static_cast<double>(image.begin[axis]) + at,
                    static_cast<double>(image.end[axis] - 1) + at, slope};
    };
    const std::array<Rays, 2> across{rays(0, f.x, f.dx), rays(1, f.y, f.dy)};
    // Slices that some of them may cross; beside a face, rays see the slice next to their end.
    double low = 0, high = static_cast<double>(n.z - 1);
    for (int axis = 0; axis < 2; ++axis) {
        const Rays& r = across[static_cast<std::size_t>(axis)];
        const double before = -0.5 - r.last, behind = static_cast<double>(n[axis]) - 0.5 - r.first;
        constexpr double kRounding = 1e-6;
        if (std::abs(r.slope) < 1e-12) {
            if (before > kRounding || behind < -kRounding) return {};
            continue;
        }
        const double one = before / r.slope, other = behind / r.slope;
        low = std::max(low, std::min(one, other) - 1);
        high = std::min(high, std::max(one, other) + 1);
    }
    if (low > high) return {};
    Region box;
    box.begin[2] = static_cast<std::int64_t>(std::floor(low));
    box.end[2] = static_cast<std::int64_t>(std::ceil(high)) + 1;
    for (int axis = 0; axis < 2; ++axis) {
        const Rays& r = across[static_cast<std::size_t>(axis)];
        const double near = r.slope * static_cast<double>(box.begin[2]);
        const double far = r.slope * static_cast<double>(box.end[2] - 1);
        const double first = r.first + std::min(near, far), last = r.last + std::max(near, far);
        const auto top = static_cast<double>(n[axis] - 1);
        box.begin[axis] = static_cast<std::int64_t>(std::clamp(std::floor(first - 1), 0.0, top));
        box.end[axis] = static_cast<std::int64_t>(std::clamp(std::ceil(last + 1), 0.0, top)) + 1;
    }
    return box;
}

/// A picture is one region: it is cut into tiles inside, which share the intermediate image.
Partition parts(const Offer& offer, const Ask& ask) {
    const Representation& from = offer.from;
    // A spline's prefilter goes over the whole image, and so does the range of its values.
    if (smooth(offer.with, ask.want.mode)) return {};
    // Slices across the rays may differ in extent from view to view.
    if (from.space == "aligned" && from.placed.different() > 1) return {};
    return {.kind = Partition::output,
            .leaf = {offer.to.extent.x, offer.to.extent.y, 1},
            .reads = [from, want = ask.want](const Region& out, int view) {
                const ShearView f = shear_view_of(from, want, view);
                return box_of_volume(f, box_of_image(f, out), from.extent);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const ShearView f = shear_view_of(in.what, want, context.view);
    const kernels::Optics optics = optics_of(want, in.what.values);
    const kernels::Hold hold = kernels::hold_of(filter_of(offer.with));
    const kernels::ShearWarp warp = shear_warp_of(f, in, want, optics, hold);
    const int channels = want.mode->channels;
    const bool spline = smooth(offer.with, want.mode);
    Representation what;
    what.extent = f.image;
    what.type = Type::f32;
    what.channels = channels;
    Data image =
        Data::make(what, spline ? Region::all(f.image) : box_of_image(f, region), context.memory);
    auto* values = image.as<float>();
    project(warp, image.box, want.mode, values, context);

    const auto outside = static_cast<float>(rule_miss(want));
    const ShearedImage sheared{.mode = want.mode,
                               .warp = warp,
                               .values = values,
                               .extent = f.image,
                               .held = image.box,
                               .channels = channels,
                               .to_image = f.to_image,
                               .outside = outside};
    Interval range{};
    if (spline) {
        continue_image(sheared, context.memory);
        range = range_of(values, f.image.samples());
        kernels::spline_prefilter(values, f.image, channels);
    }

    const kernels::BackwardWarp picture(kernels::grid_of(image), f.to_image,
                                        spline ? kernels::Hold::bspline3 : hold, outside);
    const kernels::WarpOutput output{out.as<float>(), out.held()};
    const Read read = spline                       ? Read::continued
                      : hold == kernels::Hold::foh ? Read::bilinear
                                                   : Read::nearest;
    const Extent& to = out.what.extent;
    const Extent size = kernels::preferred_tile(to);
    for_tiles(from_multiple(region, size.x), size.x, size.y, context, [&](const Region& tile) {
        Region part = tile, whole = tile;
        part.begin[0] = std::max(tile.begin[0], region.begin[0]);
        whole.end[0] = std::min(tile.begin[0] + size.x, to.x);
        picture(output, part);
        if (spline) clamp(output, part, range);
        mend_border(sheared, read, output, part, whole);
        give_sign(want, out.at<float>(part.begin[0], part.begin[1], 0), part.extent().x,
                  part.extent().y, out.row());
    });
}

}  // namespace

Transition shear_warp() {
    Transition edge;
    edge.name = "project.shear_warp";
    edge.source = "Lacroute and Levoy 1994; Wittenbrink 1993, FIGURE 27";
    edge.joins = {{"aligned/scalar", "screen/picture"}, {"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"filter", one_of({"zoh", "foh"}, "reconstruction: zoh nearest, foh linear")}};
    edge.laws = {Law::constant};
    edge.offer = offer;
    edge.work = work;
    edge.shared_counts = {measure_casting};
    edge.error = error;
    edge.model = shear_warp_model;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] { return picture_trials(); };
    edge.factors = {{"", 0.56}, {"/filter=zoh", 0.5}};
    return edge;
}

}  // namespace edgewise
