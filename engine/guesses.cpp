#include "engine/guesses.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string>
#include <vector>

#include "engine/looked.hpp"
#include "graph/kinds.hpp"
#include "graph/words.hpp"
#include "transfer/air.hpp"
#include "transfer/robust_window.hpp"

namespace edgewise {
namespace {

/// Whether the views are those of a file, which may say how it lies in the body.
bool is_of_file(const Opened& opened) {
    const Input& input = opened.input;
    return !input.phantom && !input.described && !opened.as.given;
}

bool is_own_axis(const std::string& view) {
    return same_word(view, "x") || same_word(view, "y") || same_word(view, "z");
}

/// How far apart the output's samples are along each of its axes, in samples of the input along
/// that of its axes which lies nearest: a turn alone leaves them as they are.
std::array<double, 3> reductions(const Opened& opened) {
    const Request& want = opened.want;
    std::array<double, 3> most{};
    if (want.deformed()) return most;
    const int axes = want.job->of_rays() ? 2 : want.axes;
    for (int view = 0; view < want.frames; ++view) {
        const Mat4 back = want.views.at(view).matrix().inverse();
        if (!back.allFinite()) continue;
        for (int axis = 0; axis < axes; ++axis) {
            const Vec3 step = back.col(axis).head<3>().cwiseProduct(want.spacing);  // [file unit]
            int nearest = 0;
            step.cwiseAbs().maxCoeff(&nearest);
            double& one = most[static_cast<std::size_t>(axis)];
            one = std::max(one, step.norm() / want.spacing[nearest]);
        }
    }
    return most;
}

/// The middle of the output and its corners, a little within.
std::vector<Vec3> ends_of(const Extent& out, int axes) {
    std::vector<Vec3> ends;
    for (int corner = 0; corner < (axes == 2 ? 4 : 8); ++corner) {
        Vec3 at = Vec3::Zero();
        for (int axis = 0; axis < axes; ++axis)
            if (corner >> axis & 1) at[axis] = static_cast<double>(out[axis] - 1);
        ends.push_back(at);
    }
    return ends;
}

/// Whether some output sample lies beyond the input. Its samples lie in a box, which the map makes
/// a body with straight edges: all of it is inside where its corners are.
bool reaches_beyond(const Opened& opened) {
    const Request& want = opened.want;
    if (!want.job->of_points() || want.deformed()) return false;
    constexpr double kRounding = 1e-6;  // sample
    for (int view = 0; view < want.frames; ++view) {
        const Mat4 back = want.views.at(view).matrix().inverse();
        for (const Vec3& end : ends_of(want.output(), want.axes)) {
            const std::optional<Vec3> from = sent(back, end);
            if (!from) return true;
            for (int axis = 0; axis < want.axes; ++axis)
                if ((*from)[axis] < -0.5 - kRounding ||
                    (*from)[axis] > static_cast<double>(want.input[axis]) - 0.5 + kRounding)
                    return true;
        }
    }
    return false;
}

/// Whether the samples are Hounsfield units: a CT's, or values that have air and water where these
/// have them.
bool is_ct_in_units(const Looked& opened) {
    const Input& input = opened.input;
    const std::string& modality = input.header.modality;
    if (modality == "CT") return true;
    if (!modality.empty() || input.channels() > 1 || input.table) return false;
    constexpr std::int64_t kRuns = 1 << 11, kLength = 16;
    const Drawn drawn(*input.data, Region::all(input.data->what.extent), kRuns, kLength);
    return hounsfield_shift(drawn, opened.statistics) == 0;
}

}  // namespace

void say_where_front_is(const Opened& opened, Listener& messages) {
    const std::optional<std::string>& view = opened.query.geometry.view;
    const Input& input = opened.input;
    if (!view || is_own_axis(*view) || input.header.anatomical || !is_of_file(opened) ||
        !has_screen(opened.want.job))
        return;
    messages.warning(
        message("@view({}): {} does not say how it lies in the body; x is taken to point to the "
                "left, y to the back, z up; where that is wrong say @orient(LPS), RAS ...",
                *view, input.name));
}

bool looks_along_z(const Opened& opened) {
    return opened.want.job->of_rays() && !opened.query.geometry.view &&
           !opened.query.geometry.look_at && !opened.input.header.anatomical;
}

void say_what_is_reduced(const Opened& opened, Listener& messages) {
    const Request& want = opened.want;
    if (!has_screen(want.job) || !is_of_file(opened)) return;
    constexpr double kSeen = 1.5;
    const std::array<double, 3> apart = reductions(opened);
    const double most = *std::max_element(apart.begin(), apart.end());
    if (!(most > kSeen * (1 + 1e-9))) return;
    const std::string where = fmt::format("{} of the output lie {:.3g} samples of the input apart",
                                          want.job->of_rays() ? "rays" : "samples", most);
    if (want.field == Field::nearest) {
        messages.warning(where + ": labels that lie between them are left out");
        return;
    }
    // Of a Gauss filter that wide little is left of what the output's samples cannot show.
    messages.warning(
        message("{}, and values are taken there alone: finer detail is left out, or makes "
                "patterns; `@command(filter) {} @out(smooth{}) @op(convolve) "
                "@kernel(gauss:{:.2g})` first makes a mean",
                where, opened.input.name, want.axes == 2 ? ".tif" : ".nrrd", most / 2));
}

void take_outside(Looked& opened) {
    const Input& input = opened.input;
    if (opened.query.outside || opened.want.field == Field::nearest || opened.as.given ||
        !input.data->samples.data() || !reaches_beyond(opened) || !is_ct_in_units(opened))
        return;
    const store::PaddingRuns padding = store::padding_runs(input.header, input.selection);
    if (const std::optional<double> air = air_of(*input.data, padding.runs))
        opened.want.outside = *air;
}

std::optional<double> filled_with(const Opened& opened) {
    if (!reaches_beyond(opened)) return std::nullopt;
    return opened.input.table ? opened.input.outside : opened.want.outside;
}

void say_what_fills(const Opened& opened, Listener& messages) {
    const std::optional<double> filled = filled_with(opened);
    const Tail& tail = opened.written.tail;
    if (!filled || !opened.outputs || opened.outputs->none() || tail.view || tail.table ||
        !is_integer(tail.type))
        return;
    const auto [low, high] = limits_of(tail.type);
    const double number = std::nearbyint((*filled - tail.values.offset) / tail.values.slope);
    if (number >= low && number <= high) return;
    messages.warning(
        message("@outside({:g}): {} holds none, so {:g} is written beyond the input; @bits(32) and "
                "a format that holds f32 (.nrrd, .nii.gz, .tif) keep it",
                *filled, name_of(tail.type), tail.values(std::clamp(number, low, high))));
}

}  // namespace edgewise
