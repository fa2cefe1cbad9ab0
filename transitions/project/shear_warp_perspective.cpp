#include "transitions/project/shear_warp_perspective.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <optional>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/shear_perspective.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

using kernels::PerspectiveSlices;
using kernels::SliceRay;

kernels::Hold slice_hold(const Parameters& with) {
    return kernels::hold_of(filter_named(with.word("filter")));
}

/// An interval of places or slopes; empty: low > high.
struct Between {
    double low = 1, high = 0;

    bool empty() const { return !(low <= high); }
    Between within(const Between& other) const {
        return {std::max(low, other.low), std::min(high, other.high)};
    }
    template <std::size_t n>
    static Between of(const std::array<double, n>& values) {
        const auto [least, most] = std::minmax_element(values.begin(), values.end());
        return {*least, *most};
    }
};

/// Two axes in the order in which rows and columns of a slice of the third lie.
constexpr std::array<int, 2> axes_across(int axis) {
    if (axis == 0) return {1, 2};
    return {0, axis == 1 ? 2 : 1};
}

/// The way along an axis in which a ray advances fastest.
struct Way {
    int axis = 2;
    bool backwards = false;

    std::size_t index() const { return static_cast<std::size_t>(2 * axis + (backwards ? 1 : 0)); }
};
constexpr std::array<Way, 6> kWays = {
    {{0, false}, {0, true}, {1, false}, {1, true}, {2, false}, {2, true}}};

/// The slices along one way, from the first that its rays may meet, and their image.
struct SlicedView {
    PerspectiveSlices slices;  // without samples
    Extent image;
    std::int64_t first = 0;  // slice of the lowest index
};

struct PerspectiveView {
    kernels::Rays rays;
    std::array<std::optional<SlicedView>, kWays.size()> along;  // none: no ray needs it
    std::string refused;

    const std::array<double, 3>& eye() const { return rays.origin.base; }
};

double high_face_of(const Extent& n, int axis) { return static_cast<double>(n[axis]) - 0.5; }

/// Directions of rays at the corners of a box of the picture.
std::array<std::array<double, 3>, 4> corner_rays(const kernels::Rays& rays, const Region& picture) {
    std::array<std::array<double, 3>, 4> all;
    for (std::size_t corner = 0; corner < 4; ++corner)
        all[corner] = rays.direction.at(
            static_cast<double>(corner & 1 ? picture.end[0] - 1 : picture.begin[0]),
            static_cast<double>(corner & 2 ? picture.end[1] - 1 : picture.begin[1]));
    return all;
}

/// What rays of a box of the picture go across for a voxel along an axis. They are a convex cone,
/// of which the corners tell all where they all go the same way. Nothing: they do not.
std::optional<Between> slopes_of(const kernels::Rays& rays, const Region& picture, const Way& way,
                                 int across) {
    std::array<double, 4> slopes;
    const auto corners = corner_rays(rays, picture);
    for (std::size_t corner = 0; corner < 4; ++corner) {
        const auto& d = corners[corner];
        const double along = d[static_cast<std::size_t>(way.axis)];
        if (!((way.backwards ? -along : along) > 0)) return {};
        slopes[corner] = d[static_cast<std::size_t>(across)] / std::abs(along);
    }
    const Between all = Between::of(slopes);
    if (!std::isfinite(all.low) || !std::isfinite(all.high)) return {};
    return all;
}

/// Where the volume begins and ends along a way, from the eye on; beside the eye it begins at 0.
Between ahead_of(const PerspectiveView& of, const Extent& n, const Way& way) {
    const double eye = of.eye()[static_cast<std::size_t>(way.axis)];
    const double low = -0.5 - eye, high = high_face_of(n, way.axis) - eye;
    return {std::max(0.0, way.backwards ? -high : low), way.backwards ? -low : high};
}
/// How far the volume is from the eye along an axis.
double away_from(const PerspectiveView& of, const Extent& n, int axis) {
    return std::max(ahead_of(of, n, {axis, false}).low, ahead_of(of, n, {axis, true}).low);
}
/// Rays of a way go no faster across it, so they meet nothing that is nearer than this.
double first_met(const PerspectiveView& of, const Extent& n, const Way& way) {
    double met = ahead_of(of, n, way).low;
    for (const int other : axes_across(way.axis)) met = std::max(met, away_from(of, n, other));
    return met;
}

/// What rounding decides between axes that are equally fast.
constexpr double kEqual = 1e-6;

/// Whether rays of the picture may advance fastest along a way where they meet the volume; where
/// that is not easily told, they may.
bool is_needed(const PerspectiveView& of, const Extent& n, const Region& picture, const Way& way) {
    if (ahead_of(of, n, way).high < (1 - kEqual) * first_met(of, n, way)) return false;
    const auto corners = corner_rays(of.rays, picture);
    const auto parts = [&](int axis) {
        std::array<double, 4> values;
        for (std::size_t corner = 0; corner < 4; ++corner)
            values[corner] = corners[corner][static_cast<std::size_t>(axis)];
        return Between::of(values);
    };
    const Between along = parts(way.axis);
    const double fastest = way.backwards ? -along.low : along.high;
    if (!(fastest > 0)) return false;
    for (const int other : axes_across(way.axis)) {
        const Between across = parts(other);
        const double least = std::max({across.low, -across.high, 0.0});
        if (fastest < (1 - kEqual) * least) return false;
    }
    return true;
}

/// The image on which the slices along a way are combined; nothing where no ray reaches them.
/// @param density  pixels on a voxel of the first slice that rays may meet
std::optional<SlicedView> sliced_view(const PerspectiveView& of, const Extent& n, const Mat4& map,
                                      const Vec3& steps, const Region& picture, const Way& way,
                                      double density) {
    const double eye = of.eye()[static_cast<std::size_t>(way.axis)];
    const double met = first_met(of, n, way), end = ahead_of(of, n, way).high;
    const auto last = static_cast<double>(n[way.axis] - 1);
    // Pixels beside those at 45 degrees see rays that are steeper by one.
    const double near = std::max(met - 1 / density, met / 2);
    const double slice = way.backwards ? std::clamp(std::floor(eye - near), 0.0, last)
                                       : std::clamp(std::ceil(eye + near), 0.0, last);
    SlicedView made;
    PerspectiveSlices& slices = made.slices;
    slices.backwards = way.backwards;
    slices.distance = std::abs(slice - eye);
    // Rays that enter before it do so by a side of the volume.
    const bool cut = slice != (way.backwards ? last : 0.0);
    slices.front = cut ? -1 : -0.5;
    made.first = way.backwards ? 0 : static_cast<std::int64_t>(slice);
    const auto count = static_cast<std::int64_t>(way.backwards ? slice : last - slice) + 1;
    const std::array<int, 2> across = axes_across(way.axis);
    slices.volume.extent = {n[across[0]], n[across[1]], count};
    std::array<std::int64_t, 2> size{};
    for (std::size_t a = 0; a < 2; ++a) {
        const double foot = of.eye()[static_cast<std::size_t>(across[a])];
        const double low = -0.5 - foot, high = high_face_of(n, across[a]) - foot;
        Between slopes =
            Between::of(std::array<double, 4>{low / met, low / end, high / met, high / end});
        slopes = slopes.within({-1 - kEqual, 1 + kEqual});
        if (const auto seen = slopes_of(of.rays, picture, way, across[a]))
            slopes = slopes.within(*seen);
        if (slopes.empty()) return {};
        // Whole pixels from sample 0 on, and one more on either side.
        const auto pixel = [&](double slope) { return (foot + slices.distance * slope) * density; };
        const double first = std::floor(pixel(slopes.low) - kEqual) - 1;
        const double behind = std::ceil(pixel(slopes.high) + kEqual) + 2;
        slices.across[a] = {first / density, 1 / density, foot};
        size[a] = static_cast<std::int64_t>(behind - first);
    }
    made.image = {size[0], size[1], 1};
    // From slice to slice in t; see rays_of().
    const Eigen::Matrix3d length = steps.asDiagonal() * map.topLeftCorner<3, 3>();
    const Vec3 u = length.col(across[0]), v = length.col(across[1]);
    const Vec3 w = (way.backwards ? -1.0 : 1.0) * length.col(way.axis);
    slices.metric = {u.dot(u), v.dot(v), w.dot(w), u.dot(v), u.dot(w), v.dot(w)};
    return made;
}

PerspectiveView perspective_view(const Representation& from, const Request& want, int view,
                                 double density) {
    PerspectiveView of{.rays = rays_of(from, want, view), .along = {}, .refused = {}};
    const Extent& n = from.extent;
    double away = 0;
    for (int axis = 0; axis < 3; ++axis) away = std::max(away, away_from(of, n, axis));
    // Nearer rays would be too far apart in slices that are not as near.
    constexpr double kNearest = 1;
    if (!(away >= kNearest)) {
        of.refused =
            away > 0
                ? fmt::format("view {}: the eye is {:.3g} voxels away from the volume; at least {}",
                              view, away, kNearest)
                : fmt::format(
                      "view {}: the eye is inside the volume, slices lie before and behind "
                      "it",
                      view);
        return of;
    }
    const Mat4 map = residual(from, want, view);
    const Vec3 steps(want.eye->width, want.eye->height, 1);
    const Region picture = Region::all(want.output());
    for (const Way& way : kWays)
        if (is_needed(of, n, picture, way))
            of.along[way.index()] = sliced_view(of, n, map, steps, picture, way, density);
    return of;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (!want.eye) return Offer::no("rays are parallel: no slice shrinks");
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_slices(want); !reason.empty()) return Offer::no(std::move(reason));
    if (!is_whole(from)) return Offer::no("slices are combined in the memory of one rank");
    if (want.mode->sampled_every > 0)
        return Offer::no("samples lie a slice apart along a ray, not one a unit");
    const bool nearest = slice_hold(with) == kernels::Hold::zoh;
    if (want.field == Field::nearest && !nearest)
        return Offer::no("labels: only filter=zoh makes no new value");
    if (ask.scene.non_finite > 0 && !nearest)
        return Offer::no(fmt::format(
            "{} samples are not finite: rays would miss all that was interpolated from them; only "
            "filter=zoh keeps them to themselves",
            ask.scene.non_finite));
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const int view = want.views.first_view(variant);
        PerspectiveView of = perspective_view(from, want, view, with.number("density"));
        if (!of.refused.empty()) return Offer::no(std::move(of.refused));
    }
    return {.from = from, .to = screen_picture(from, want), .with = with};
}

double bytes_of_image(const SlicedView& of, Mode mode) {
    return 4.0 * static_cast<double>(of.image.samples()) * (mode->channels + 1);
}

kernels::Combining rule_of(const Request& want, const ValueMap& values,
                           const kernels::Optics& optics) {
    kernels::Combining with = combining_of(want, values, optics);
    with.step = 1;
    return with;
}

/// Operations of a sample: its place and share, and what the rule does with it.
double sample_operations(const Request& want, const ValueMap& values) {
    constexpr double kShare = 8;
    if (!want.mode->takes_transfer) return kShare + 4 + want.mode->operations;
    const kernels::Optics optics = optics_of(want, values);
    return kShare + 14 + static_cast<double>(optics.ramps.size()) * (optics.grey ? 8 : 12) +
           kCorrectionOperations;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const Request& want = ask.want;
    const double density = offer.with.number("density");
    const PerspectiveView of = perspective_view(offer.from, want, view, density);
    const bool nearest = slice_hold(offer.with) == kernels::Hold::zoh;
    const int channels = want.mode->channels;
    const kernels::Optics optics = optics_of(want, offer.from.values);
    Work work;
    bool turned = false;
    for (const Way& way : kWays) {
        if (!of.along[way.index()]) continue;
        const SlicedView& view_of_way = *of.along[way.index()];
        PerspectiveSlices slices = view_of_way.slices;
        slices.with = rule_of(want, offer.from.values, optics);
        const Extent& n = slices.volume.extent;
        const auto columns = static_cast<double>(view_of_way.image.x),
                   rows = static_cast<double>(view_of_way.image.y);
        for (std::int64_t k = 0; k < n.z; ++k) {
            // So many times it shrinks.
            const double farther = 1 + static_cast<double>(k) / slices.distance;
            const double seen = std::min(columns, density * static_cast<double>(n.x) / farther);
            const double lines = std::min(rows, density * static_cast<double>(n.y) / farther);
            const double pixels = seen * lines;
            work.operations +=
                3 * lines * std::min(static_cast<double>(n.x), seen * farther / density) +
                pixels * sample_operations(want, offer.from.values);
            work.gathers += (nearest ? 0.5 : 1) * pixels;  // two from a row that is near
        }
        const double bytes = bytes_of_image(view_of_way, want.mode);
        work.operations += 40 * columns * rows;
        work.streamed += offer.from.bytes() + 2 * bytes;
        work.workspace += bytes;
        work.scratch = std::max(work.scratch, 8.0 * static_cast<double>(perspective_room(slices)));
        turned = turned || way.axis == 0;
    }
    if (turned) {  // rows become columns first
        work.streamed += 2 * offer.from.bytes();
        work.workspace += offer.from.bytes();
    }
    const auto pixels = static_cast<double>(offer.to.samples());
    work.operations += pixels * (60 + (nearest ? 0 : 9 * channels));
    work.streamed += offer.to.bytes();
    work.gathers += pixels * (nearest ? 1 : 4) * channels;
    work.lines = {offer.from.bytes() / kLineBytes, offer.from.bytes()};
    return work;
}

/// Samples with the slices of an axis behind one another, rows as they lie or turned into columns.
class SlicedSamples {
 public:
    SlicedSamples(const Data& in, const Request& want, int axis, Context& context)
        : grid_(rule_grid(in, want)) {
        if (axis == 2) return;
        const Extent n = grid_.extent;
        if (axis == 1) {
            const std::int64_t row = grid_.slice_step(), slice = grid_.row_step();
            grid_.extent = {n.x, n.z, n.y};
            grid_.row = row;
            grid_.slice = slice;
            return;
        }
        turn(context);
    }
    /// Those of some slices.
    kernels::Grid from(std::int64_t first, std::int64_t count) const {
        kernels::Grid part = grid_;
        part.row = grid_.row_step();
        part.slice = grid_.slice_step();
        part.extent.z = count;
        part.samples = grid_.as<std::byte>() +
                       first * part.slice * static_cast<std::int64_t>(bytes_of(grid_.type));
        return part;
    }

 private:
    void turn(Context& context) {
        const kernels::AxisPermutation turned =
            kernels::into_place({.from = {1, 2, 0}, .sign = {1, 1, 1}}, grid_.extent);
        const Extent n = kernels::permuted_extent(turned, grid_.extent);
        const std::size_t bytes = bytes_of(grid_.type);
        copy_.emplace(bytes * static_cast<std::size_t>(n.samples()), context.memory);
        const std::array<std::byte, 16> beyond{};
        // Blocks of the output's last axis, which rows of the input become.
        constexpr std::int64_t kRows = 64;
        const std::int64_t blocks = (n.z + kRows - 1) / kRows;
        tbb::parallel_for(std::int64_t{0}, blocks * n.y, [&](std::int64_t i) {
            if (context.stopped()) return;
            Region part = Region::all(n);
            part.begin[2] = i % blocks * kRows;
            part.end[2] = std::min(part.begin[2] + kRows, n.z);
            part.begin[1] = i / blocks;
            part.end[1] = part.begin[1] + 1;
            kernels::copy_permuted(grid_, bytes, turned, beyond.data(), copy_->data(),
                                   Region::all(n), part);
        });
        context.poll();
        grid_.samples = copy_->data();
        grid_.extent = n;
        grid_.row = grid_.slice = 0;
    }

    kernels::Grid grid_;
    std::optional<Array> copy_;
};

/// The intermediate image of one axis, as much of it as a part of the picture reads.
class SlicedImage {
 public:
    SlicedImage(const SlicedView& view, const SlicedSamples& samples, kernels::Hold hold,
                const kernels::Combining& with, const Region& box, int channels, Context& context)
        : slices_(view.slices), box_(box), channels_(channels) {
        slices_.volume = samples.from(view.first, view.slices.volume.extent.z);
        slices_.hold = hold;
        slices_.with = with;
        if (box.empty()) return;
        const auto pixels = static_cast<std::size_t>(box.extent().samples());
        const auto floats = sizeof(float) * pixels;
        values_.emplace(floats * static_cast<std::size_t>(channels), context.memory);
        lengths_.emplace(floats, context.memory);
        for_tiles(box, kernels::kPerspectiveWidth, kernels::kPerspectiveHeight, context,
                  [&](const Region& tile) { add(tile, context); });
    }

    /// The ray of a place in the nearest slice, as a pixel of its own.
    void follow(const SliceRay& ray, Context& context, std::optional<Array>& room,
                float* out) const {
        PerspectiveSlices own = slices_;
        for (std::size_t a = 0; a < 2; ++a) own.across[a].first = ray.at[a];
        const std::size_t bytes = sizeof(float) * perspective_room(own);
        if (!room || room->bytes() < bytes) room.emplace(bytes, context.memory);
        const kernels::PerspectiveTile tile =
            perspective_slices(own, 0, 0, 1, 1, static_cast<float*>(room->data()));
        finish_states(own.with, tile.states, 1, 1, out, channels_);
    }

    /// The same from the nearest pixel; false: that has no value.
    bool nearest(const SliceRay& ray, float* out) const {
        const std::int64_t i = floor_of(pixel(ray, 0) + 0.5), j = floor_of(pixel(ray, 1) + 0.5);
        if (!(length(i, j) > 0)) return false;
        std::copy_n(value(i, j), channels_, out);
        return true;
    }

    /// The same from the four pixels around it, each of which is made as long as the ray; false:
    /// not all of them have a value, or they are much longer or shorter.
    bool between(const SliceRay& ray, Mode mode, float* out) const {
        constexpr double kLonger = 1.25;
        const double u = pixel(ray, 0), v = pixel(ray, 1), own = ray.length();
        const std::int64_t i = floor_of(u), j = floor_of(v);
        const double right = u - static_cast<double>(i), down = v - static_cast<double>(j);
        std::array<double, 4> sum{};
        for (int corner = 0; corner < 4; ++corner) {
            const double weight = (corner & 1 ? right : 1 - right) * (corner & 2 ? down : 1 - down);
            if (weight == 0) continue;
            const std::int64_t x = i + (corner & 1), y = j + (corner >> 1);
            const double inside = length(x, y);
            if (!(inside > 0)) return false;
            std::array<double, 4> values{};
            std::copy_n(value(x, y), channels_, values.begin());
            if (mode->lengthen) {
                if (own > kLonger * inside || inside > kLonger * own) return false;
                mode->lengthen(own / inside, values);
            }
            for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += weight * values[c];
        }
        for (int c = 0; c < channels_; ++c)
            out[c] = static_cast<float>(sum[static_cast<std::size_t>(c)]);
        return true;
    }

    const PerspectiveSlices& slices() const { return slices_; }

 private:
    static std::int64_t floor_of(double at) { return static_cast<std::int64_t>(std::floor(at)); }
    double pixel(const SliceRay& ray, std::size_t axis) const {
        return (ray.at[axis] - slices_.across[axis].first) / slices_.across[axis].pitch;
    }
    std::int64_t offset(std::int64_t i, std::int64_t j) const {
        return (j - box_.begin[1]) * box_.extent().x + i - box_.begin[0];
    }
    const float* value(std::int64_t i, std::int64_t j) const {
        return static_cast<const float*>(values_->data()) + offset(i, j) * channels_;
    }
    /// 0: not known here.
    float length(std::int64_t i, std::int64_t j) const {
        if (i < box_.begin[0] || i >= box_.end[0] || j < box_.begin[1] || j >= box_.end[1])
            return 0;
        return static_cast<const float*>(lengths_->data())[offset(i, j)];
    }

    void add(const Region& tile, Context& context) {
        Array room(sizeof(float) * perspective_room(slices_), context.memory);
        const Extent size = tile.extent();
        const kernels::PerspectiveTile made =
            perspective_slices(slices_, tile.begin[0], tile.begin[1], size.x, size.y,
                               static_cast<float*>(room.data()));
        const std::int64_t first = offset(tile.begin[0], tile.begin[1]), row = box_.extent().x;
        finish_states(slices_.with, made.states, size.x, size.y,
                      static_cast<float*>(values_->data()) + first * channels_, row * channels_);
        for (std::int64_t y = 0; y < size.y; ++y)
            std::copy_n(made.lengths + y * made.states.pitch, size.x,
                        static_cast<float*>(lengths_->data()) + first + y * row);
    }

    PerspectiveSlices slices_;
    Region box_;
    int channels_;
    std::optional<Array> values_, lengths_;
};

/// The box of an image that a box of the picture is read from.
Region box_of_slices(const SlicedView& of, const kernels::Rays& rays, const Region& picture,
                     const Way& way) {
    Region box = Region::all(of.image);
    const std::array<int, 2> across = axes_across(way.axis);
    for (std::size_t a = 0; a < 2; ++a) {
        const auto slopes = slopes_of(rays, picture, way, across[a]);
        if (!slopes) continue;
        const auto& [first, pitch, foot] = of.slices.across[a];
        const auto end = static_cast<double>(box.end[a]);
        const double low = (foot + of.slices.distance * slopes->low - first) / pitch;
        const double high = (foot + of.slices.distance * slopes->high - first) / pitch;
        box.begin[a] = static_cast<std::int64_t>(std::clamp(std::floor(low) - 1, 0.0, end));
        box.end[a] = static_cast<std::int64_t>(std::clamp(std::ceil(high) + 2, 0.0, end));
    }
    return box.begin[0] < box.end[0] && box.begin[1] < box.end[1] ? box : Region{};
}

/// A picture is one region: it is cut into tiles inside, which share the intermediate images.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const Mode mode = want.mode;
    const PerspectiveView of =
        perspective_view(in.what, want, context.view, offer.with.number("density"));
    const kernels::Optics optics = optics_of(want, in.what.values);
    const kernels::Combining with = rule_of(want, in.what.values, optics);
    const kernels::Hold hold = slice_hold(offer.with);
    std::array<std::optional<SlicedSamples>, 3> samples;
    std::array<std::optional<SlicedImage>, kWays.size()> images;
    for (const Way& way : kWays) {
        const std::optional<SlicedView>& along = of.along[way.index()];
        if (!along) continue;
        auto& turned = samples[static_cast<std::size_t>(way.axis)];
        if (!turned) turned.emplace(in, want, way.axis, context);
        images[way.index()].emplace(*along, *turned, hold, with,
                                    box_of_slices(*along, of.rays, region, way), mode->channels,
                                    context);
    }
    const auto outside = static_cast<float>(rule_miss(want));
    const auto make = [&](std::int64_t x, std::int64_t y, std::optional<Array>& room, float* to) {
        const auto d = of.rays.direction.at(static_cast<double>(x), static_cast<double>(y));
        const int axis = kernels::fastest_axis(d);
        const double along = d[static_cast<std::size_t>(axis)];
        const std::optional<SlicedImage>& image = images[Way{axis, along < 0}.index()];
        std::fill_n(to, mode->channels, outside);
        if (!image) return;
        const PerspectiveSlices& slices = image->slices();
        const auto place = [&](std::size_t i) {
            const auto across = static_cast<std::size_t>(axes_across(axis)[i]);
            return slices.across[i].eye + slices.distance * (d[across] / std::abs(along));
        };
        const SliceRay ray = slice_ray(slices, place(0), place(1));
        if (!ray.hits()) return;
        const bool read =
            hold == kernels::Hold::zoh ? image->nearest(ray, to) : image->between(ray, mode, to);
        if (!read) image->follow(ray, context, room, to);
    };
    for_tiles(region, 128, 16, context, [&](const Region& tile) {
        std::optional<Array> room;
        for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y)
            for (std::int64_t x = tile.begin[0]; x < tile.end[0]; ++x)
                make(x, y, room, out.at<float>(x, y, 0));
        give_sign(want, out.at<float>(tile.begin[0], tile.begin[1], 0), tile.extent().x,
                  tile.extent().y, out.row());
    });
}

}  // namespace

Transition shear_warp_perspective() {
    Transition edge;
    edge.name = "project.shear_warp_perspective";
    edge.source = "Lacroute and Levoy 1994; Schulze, Niemeier and Lang 2001";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = {
        {"filter", one_of({"zoh", "foh"}, "reconstruction: zoh nearest, foh linear")},
        {"density",
         number(0.5, 8, {1},
                "pixels of the intermediate image on a voxel where rays first meet slices")}};
    edge.on_demand = true;  // its error is measured by runs
    edge.offer = offer;
    edge.work = work;
    edge.parts = parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
