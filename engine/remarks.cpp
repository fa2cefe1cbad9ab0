#include "engine/remarks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string>

#include "engine/guesses.hpp"
#include "graph/kinds.hpp"
#include "io/surface_file.hpp"
#include "request/resolution.hpp"

namespace edgewise {
namespace {

/// Whether the input lies on one side of a plane that rays of a view do not pass: that of the eye,
/// or one through it and a side of the picture.
bool is_out_of_view(const Request& want, int view) {
    const Eye& eye = want.eye.value();
    const Mat4 map = want.views.at(view).matrix();
    const double away = eye.plane - eye.at.z();
    std::array<int, 5> beyond{};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1) ? static_cast<double>(want.input[axis]) - 0.5 : -0.5;
        p = map.topLeftCorner<3, 3>() * p + map.topRightCorner<3, 1>() - eye.at;
        beyond[4] += p.z() <= 0;
        for (int side = 0; side < 2; ++side) {
            const auto k = static_cast<std::size_t>(2 * side);
            const double low = -0.5 - eye.at[side];
            const double high = static_cast<double>(want.screen[side]) - 0.5 - eye.at[side];
            beyond[k] += p[side] * away < low * p.z();
            beyond[k + 1] += p[side] * away > high * p.z();
        }
    }
    return std::find(beyond.begin(), beyond.end(), 8) != beyond.end();
}

/// Depth is what a viewer does not show to be missing.
void say_what_is_cut_off(const Opened& opened, Listener& messages) {
    const Geometry& geometry = opened.geometry;
    constexpr double kSeen = 0.5;  // sample
    if (!opened.want.job->of_points() || geometry.cut <= kSeen) return;
    messages.warning(
        message("depth: the moved volume is {:.4g} samples deep, the output {}, so up to {:.4g} at "
                "an end are cut off; @size(fit) keeps all",
                geometry.depth, geometry.grid.extent.z, geometry.cut));
}

/// Pictures have no spacing that a viewer would heed.
void say_what_is_squeezed(const Opened& opened, Listener& messages) {
    const Vec3& spacing = opened.geometry.grid.spacing;
    constexpr double kSeen = 1e-3;  // a pixel in a thousand
    if (!opened.want.job->of_points() || opened.want.axes != 3 || !opened.outputs ||
        opened.outputs->none() || opened.outputs->format().volumes ||
        std::abs(spacing.x() / spacing.y() - 1) <= kSeen)
        return;
    messages.warning(message(
        "the picture's pixels are {:.4g} x {:.4g} {}, and most viewers show them square; "
        "@spacing({:.4g}) makes them so",
        spacing.x(), spacing.y(), opened.input.header.unit, std::min(spacing.x(), spacing.y())));
}

/// An eye that somebody put may look elsewhere, and a picture of nothing does not say why.
void say_what_is_not_seen(const Opened& opened, Listener& messages) {
    const Request& want = opened.want;
    if (!opened.geometry.eye_placed) return;
    for (int view = 0; view < want.frames; ++view)
        if (!is_out_of_view(want, view)) return;
    messages.warning(message(
        "@eye: nothing of the volume is in the picture; @look_at({:g},{:g},{:g}) is its middle",
        (double(want.input.x) - 1) / 2, (double(want.input.y) - 1) / 2,
        (double(want.input.z) - 1) / 2));
}

/// A coarser resolution of the file may hold all that the result can show.
void say_what_is_finer(const Opened& opened, Listener& messages) {
    const store::Header& header = opened.input.header;
    const Job job = opened.want.job;
    if (header.levels.size() < 2 || !has_screen(job)) return;
    const Extent& here = header.extent;
    const int coarsest = level_as_fine(header, opened.geometry.grid, job);
    if (coarsest == header.level) return;
    const double share =
        static_cast<double>(header.levels[static_cast<std::size_t>(coarsest)].samples()) /
        static_cast<double>(here.samples());
    messages.notice(message(
        "{}: @level({}) is as fine as the result's samples, and reads {:.3g} % of what is read now",
        opened.input.name, coarsest, 100 * share));
}

/// Rays of a picture that is smaller than the volume pass between samples: the brightest may be
/// met by none.
bool say_what_is_missed(const Opened& opened, Listener& messages) {
    const Request& want = opened.want;
    const bool keeps_one = want.mode->extreme != 0 || want.mode->sampled_every > 0;
    if (!want.job->of_rays() || !keeps_one) return false;
    // A sample that is interpolated linearly reaches one sample each way: closer rays meet all.
    constexpr double kSeen = 2 - 1e-6;  // [sample]
    double apart = 0;
    for (int view = 0; view < want.frames; ++view) {
        const Mat4 back = want.views.at(view).matrix().inverse();
        for (int axis = 0; axis < 2; ++axis)
            apart = std::max(apart, back.col(axis).head<3>().norm());
    }
    if (!(apart >= kSeen) || !std::isfinite(apart)) return false;
    const auto grown = [&](std::int64_t side) {
        return static_cast<std::int64_t>(std::ceil(static_cast<double>(side) * apart - 1e-6));
    };
    const Message size = message("@size({}x{})", grown(want.screen.x), grown(want.screen.y));
    const Vec3& spacing = opened.geometry.grid.spacing;
    const Message finer =
        opened.query.geometry.spacing
            ? message("@spacing({:.4g}) {}", spacing.head<2>().minCoeff() / apart, size)
            : size;
    messages.warning(
        message("@mode({}): rays are {:.3g} samples apart, so single {} samples between them are "
                "not in the picture; {} meets all of them",
                want.mode->name, apart, want.mode->extreme < 0 ? "dark" : "bright", finer));
    return true;
}

/// A surface that is far from the origin, in a format of 32 bits.
void say_what_is_shifted(const Opened& opened, Listener& messages) {
    const Vec3& offset = opened.geometry.offset;
    if (!makes_surface(opened.want.job) || !opened.outputs || opened.outputs->none() ||
        offset == Vec3::Zero())
        return;
    const store::SurfaceFormat* format = store::surface_format_of(opened.outputs->file(0));
    if (!format || format->name != "STL") return;
    messages.warning(fmt::format(
        "{}: the numbers of an STL are too short for a surface so far from the origin: {:.17g}, "
        "{:.17g}, {:.17g} is to be added to its places, as its header says; .ply and .obj hold "
        "the places themselves",
        opened.outputs->file(0), offset.x(), offset.y(), offset.z()));
}

}  // namespace

void say_what_is_open(const Opened& opened, Listener& messages) {
    say_what_is_cut_off(opened, messages);
    say_what_is_squeezed(opened, messages);
    say_what_is_not_seen(opened, messages);
    say_what_is_finer(opened, messages);
    if (!say_what_is_missed(opened, messages)) say_what_is_reduced(opened, messages);
    say_what_is_shifted(opened, messages);
    say_where_front_is(opened, messages);
}

}  // namespace edgewise
