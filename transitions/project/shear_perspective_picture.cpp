#include "transitions/project/shear_perspective_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <optional>

#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/kernels/shear_perspective.hpp"
#include "transitions/kernels/shear_perspective_runs.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/shear_perspective_view.hpp"
#include "transitions/project/sliced_samples.hpp"
#include "transitions/shade/runs.hpp"

namespace edgewise {
namespace {

using kernels::PerspectiveSlices;
using kernels::SliceRay;

kernels::Hold slice_hold(const Parameters& with) {
    return kernels::hold_of(filter_named(with.word("filter")));
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

/// A pixel's ray, and the way of the image that it belongs to.
struct SeenRay {
    std::size_t way = 0;
    SliceRay ray;
};

/// Of the pixel in column x and row y of the picture; nothing where no slice is met.
std::optional<SeenRay> ray_of_pixel(const PerspectiveView& of, double x, double y) {
    const auto d = of.rays.direction.at(x, y);
    const int axis = kernels::fastest_axis(d);
    const double along = d[static_cast<std::size_t>(axis)];
    const std::size_t way = Way{axis, along < 0}.index();
    if (!of.along[way]) return {};
    const PerspectiveSlices& slices = of.along[way]->slices;
    const auto place = [&](std::size_t i) {
        const auto across = static_cast<std::size_t>(axes_across(axis)[i]);
        return slices.across[i].eye + slices.distance * (d[across] / std::abs(along));
    };
    const SliceRay ray = slice_ray(slices, place(0), place(1));
    return ray.hits() ? std::optional(SeenRay{way, ray}) : std::nullopt;
}

/// Where a ray lies on the image.
double pixel_of(const PerspectiveSlices& slices, const SliceRay& ray, std::size_t axis) {
    return (ray.at[axis] - slices.across[axis].first) / slices.across[axis].pitch;
}

/// Whether a pixel of the image, with a ray of such a length (0: none), is like a ray near it.
bool is_like(double length, const SliceRay& ray, Mode mode) {
    constexpr double kLonger = 1.25;
    if (!(length > 0)) return false;
    const double own = ray.length();
    return !mode->lengthen || (own <= kLonger * length && length <= kLonger * own);
}

// What pixels of the picture take, one by one and in f64, as it was timed: a ray; what is read of
// four neighbours, and made as long; a ray that is followed, a slice of it, and the runs there.
constexpr double kRayOperations = 300, kReadOperations = 40, kLengthenOperations = 250;
constexpr double kFollowOperations = 300, kSliceOperations = 100, kRowOperations = 15;

/// Pixels of a picture whose rays are followed through the slices, and the slices that they meet.
struct Followed {
    double pixels = 0, slices = 0;
};

/// From a lattice of them.
Followed followed_of(const PerspectiveView& of, const Extent& screen, Mode mode, bool nearest) {
    constexpr std::int64_t kSide = 12;
    Followed all;
    const auto follows = [&](const SeenRay& seen) {
        const PerspectiveSlices& slices = of.along[seen.way]->slices;
        const double u = pixel_of(slices, seen.ray, 0), v = pixel_of(slices, seen.ray, 1);
        const auto length = [&](double i, double j) {
            return slice_ray(slices, slices.across[0].at(i), slices.across[1].at(j)).length();
        };
        if (nearest) return !(length(std::floor(u + 0.5), std::floor(v + 0.5)) > 0);
        for (int corner = 0; corner < 4; ++corner)
            if (!is_like(length(std::floor(u) + (corner & 1), std::floor(v) + (corner >> 1)),
                         seen.ray, mode))
                return true;
        return false;
    };
    for (std::int64_t j = 0; j < kSide; ++j)
        for (std::int64_t i = 0; i < kSide; ++i) {
            const auto x = (2 * i + 1) * screen.x / (2 * kSide);
            const auto y = (2 * j + 1) * screen.y / (2 * kSide);
            const auto seen = ray_of_pixel(of, static_cast<double>(x), static_cast<double>(y));
            if (!seen || !follows(*seen)) continue;
            all.pixels += 1;
            all.slices += seen->ray.high - seen->ray.low;
        }
    const double share = static_cast<double>(screen.x * screen.y) / (kSide * kSide);
    return {share * all.pixels, share * all.slices};
}

/// The intermediate image of one axis, as much of it as a part of the picture reads.
class SlicedImage {
 public:
    /// @param runs  of all slices of the samples; null: all samples are added
    SlicedImage(const SlicedView& view, const SlicedSamples& samples,
                const kernels::VisibleRuns* runs, kernels::Hold hold,
                const kernels::Combining& with, const Region& box, int channels, Context& context)
        : slices_(view.slices), runs_(runs), first_(view.first), box_(box), channels_(channels) {
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
            tile_of(own, {{}, {1, 1, 1}}, static_cast<float*>(room->data()));
        finish_states(own.with, tile.states, 1, 1, out, channels_);
    }

    /// The same from the nearest pixel; false: that has no value.
    bool nearest(const SliceRay& ray, float* out) const {
        const std::int64_t i = floor_of(pixel_of(slices_, ray, 0) + 0.5),
                           j = floor_of(pixel_of(slices_, ray, 1) + 0.5);
        if (!(length(i, j) > 0)) return false;
        std::copy_n(value(i, j), channels_, out);
        return true;
    }

    /// The same from the four pixels around it, each of which is made as long as the ray; false:
    /// not all of them have a value, or they are much longer or shorter.
    bool between(const SliceRay& ray, Mode mode, float* out) const {
        const double u = pixel_of(slices_, ray, 0), v = pixel_of(slices_, ray, 1);
        const std::int64_t i = floor_of(u), j = floor_of(v);
        const double right = u - static_cast<double>(i), down = v - static_cast<double>(j);
        std::array<double, 4> sum{};
        for (int corner = 0; corner < 4; ++corner) {
            const double weight = (corner & 1 ? right : 1 - right) * (corner & 2 ? down : 1 - down);
            if (weight == 0) continue;
            const std::int64_t x = i + (corner & 1), y = j + (corner >> 1);
            const double inside = length(x, y);
            if (!is_like(inside, ray, mode)) return false;
            std::array<double, 4> values{};
            std::copy_n(value(x, y), channels_, values.begin());
            if (mode->lengthen) mode->lengthen(ray.length() / inside, values);
            for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += weight * values[c];
        }
        for (int c = 0; c < channels_; ++c)
            out[c] = static_cast<float>(sum[static_cast<std::size_t>(c)]);
        return true;
    }

 private:
    static std::int64_t floor_of(double at) { return static_cast<std::int64_t>(std::floor(at)); }
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

    kernels::PerspectiveTile tile_of(const PerspectiveSlices& of, const Region& tile,
                                     float* room) const {
        const Extent size = tile.extent();
        if (runs_)
            return perspective_runs(of, *runs_, first_, tile.begin[0], tile.begin[1], size.x,
                                    size.y, room);
        return perspective_slices(of, tile.begin[0], tile.begin[1], size.x, size.y, room);
    }
    void add(const Region& tile, Context& context) {
        Array room(sizeof(float) * perspective_room(slices_), context.memory);
        const Extent size = tile.extent();
        const kernels::PerspectiveTile made =
            tile_of(slices_, tile, static_cast<float*>(room.data()));
        const std::int64_t first = offset(tile.begin[0], tile.begin[1]), row = box_.extent().x;
        finish_states(slices_.with, made.states, size.x, size.y,
                      static_cast<float*>(values_->data()) + first * channels_, row * channels_);
        for (std::int64_t y = 0; y < size.y; ++y)
            std::copy_n(made.lengths + y * made.states.pitch, size.x,
                        static_cast<float*>(lengths_->data()) + first + y * row);
    }

    PerspectiveSlices slices_;
    const kernels::VisibleRuns* runs_;
    std::int64_t first_;  // of the slices
    Region box_;
    int channels_;
    std::optional<Array> values_, lengths_;
};

}  // namespace

std::map<std::string, Domain> perspective_parameters() {
    return {{"filter", one_of({"zoh", "foh"}, "reconstruction: zoh nearest, foh linear")},
            {"density",
             number(0.5, 8, {1},
                    "pixels of the intermediate image on a voxel where rays first meet slices")}};
}

Offer perspective_offer(const Representation& from, const Ask& ask, const Parameters& with) {
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

Work perspective_work(const Offer& offer, const Ask& ask, int view,
                      const std::optional<double>& added) {
    const Request& want = ask.want;
    const double density = offer.with.number("density");
    const PerspectiveView of = perspective_view(offer.from, want, view, density);
    const bool nearest = slice_hold(offer.with) == kernels::Hold::zoh;
    const int channels = want.mode->channels;
    const kernels::Optics optics = optics_of(want, offer.from.values);
    const double share = added.value_or(1), bytes_read = share * offer.from.bytes();
    const double runs_of_row = added ? ask.scene.fact(kRunsRow).value_or(1) : 0;
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
                share * (3 * lines * std::min(static_cast<double>(n.x), seen * farther / density) +
                         pixels * sample_operations(want, offer.from.values));
            work.gathers += share * (nearest ? 0.5 : 1) * pixels;  // two from a row that is near
            if (!added) continue;
            // A tile's row asks each slice for its runs.
            constexpr auto kWidth = static_cast<double>(kernels::kPerspectiveWidth);
            work.operations += lines * (40 * std::ceil(columns / kWidth) + 60 * runs_of_row);
        }
        const double bytes = bytes_of_image(view_of_way, want.mode);
        work.operations += 40 * columns * rows;
        work.streamed += bytes_read + 2 * bytes;
        work.workspace += bytes;
        work.scratch = std::max(work.scratch, 8.0 * static_cast<double>(perspective_room(slices)));
        turned = turned || way.axis == 0;
    }
    if (turned && !added) {  // rows become columns first; runs were made of such
        work.streamed += 2 * offer.from.bytes();
        work.workspace += offer.from.bytes();
    }
    const auto pixels = static_cast<double>(offer.to.samples());
    const Followed followed = followed_of(of, want.screen, want.mode, nearest);
    if (!nearest)
        work.operations += pixels * (kReadOperations + 9 * channels +
                                     (want.mode->lengthen ? kLengthenOperations : 0));
    work.operations += pixels * kRayOperations + followed.pixels * kFollowOperations +
                       followed.slices * (kSliceOperations * share + (added ? kRowOperations : 0));
    work.streamed += offer.to.bytes();
    work.gathers += pixels * (nearest ? 1 : 4) * channels;
    work.lines = {bytes_read / kLineBytes, bytes_read};
    return work;
}

/// A picture is one region: it is cut into tiles inside, which share the intermediate images.
Partition perspective_parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

void perspective_picture(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                         const Region& region, Context& context, const RunsOfAxes* runs) {
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
        const auto axis = static_cast<std::size_t>(way.axis);
        const SlicedRuns* seen = runs ? (*runs)[axis].get() : nullptr;
        std::optional<SlicedSamples>& sliced = samples[axis];
        if (!sliced && seen) sliced.emplace(in, want, way.axis, seen->turned);
        if (!sliced) sliced.emplace(in, want, way.axis, context);
        images[way.index()].emplace(*along, *sliced, seen ? &seen->runs : nullptr, hold, with,
                                    box_of_slices(*along, of.rays, region, way), mode->channels,
                                    context);
    }
    const auto outside = static_cast<float>(rule_miss(want));
    const auto make = [&](std::int64_t x, std::int64_t y, std::optional<Array>& room, float* to) {
        std::fill_n(to, mode->channels, outside);
        const auto seen = ray_of_pixel(of, static_cast<double>(x), static_cast<double>(y));
        if (!seen) return;
        const SlicedImage& image = *images[seen->way];
        const bool read = hold == kernels::Hold::zoh ? image.nearest(seen->ray, to)
                                                     : image.between(seen->ray, mode, to);
        if (!read) image.follow(seen->ray, context, room, to);
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

}  // namespace edgewise
