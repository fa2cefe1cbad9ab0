#include "transitions/warp/backward.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/lines_touched.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/backward_model.hpp"
#include "transitions/warp/counts.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"

namespace edgewise {
namespace {

using kernels::Hold;

const Filter& filter_of(const Parameters& with) { return filter_named(with.word("filter")); }
Hold hold_of(const Parameters& with) { return kernels::hold_of(filter_of(with)); }

bool affine(const Mat4& map) { return map.row(3) == Eigen::RowVector4d(0, 0, 0, 1); }

/// Screen index -> index of `from`.
Mat4 to_input(const Representation& from, const Request& want, int view) {
    const Mat4 map = residual(from, want, view);
    Mat4 inverse = map.inverse();
    // Rounding leaves 1 - 2^-53 in the corner now and then, and would make a homography of it.
    if (affine(map)) inverse.row(3) << 0, 0, 0, 1;
    return inverse;
}

/// What only needs the request: kept apart, so that views are looked at last.
std::string refusal(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason =
            not_read_by(filter_of(with), {.coefficients = from.content == "coefficients",
                                          .labels = ask.want.field == Field::nearest,
                                          .non_finite = ask.scene.non_finite});
        !reason.empty())
        return reason;
    if (ask.want.eye) return "the eye is at a finite distance: its rays are not parallel to z";
    if (from.type == Type::c64) return "complex samples have no hold";
    if (!is_whole(from) && !is_spread(from))
        return "gathers at computed addresses need all samples in memory, row by row";
    return {};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = refusal(from, ask, with); !reason.empty())
        return Offer::no(std::move(reason));
    const int views = ask.want.views.different();
    for (int variant = 0; variant < views; ++variant) {
        const int view = ask.want.views.first_view(variant);
        const Mat4 map = residual(from, ask.want, view);
        if (!affine(map) && from.axes == 3)
            return Offer::no(fmt::format("view {}: a projective map of a volume", view));
        const double det = map.determinant();
        if (!(std::abs(det) > 1e-12) || !std::isfinite(det))
            return Offer::no(fmt::format("view {}: determinant {:.3g}, no inverse", view, det));
    }
    return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
}

/// Place of step i of `steps` that lie evenly over n columns, rows or slices.
double lattice(int i, int steps, std::int64_t n) {
    return (i + 0.5) / steps * static_cast<double>(n) - 0.5;
}

/// Share of the screen that sees the input, on a lattice of some hundred points.
double seen_share(const Mat4& map, const Offer& offer) {
    const Extent& screen = offer.to.extent;
    const Extent& input = offer.from.extent;
    constexpr int kSide = 16;
    int seen = 0;
    for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i) {
            const Eigen::Vector4d p = map * Eigen::Vector4d(lattice(i, kSide, screen.x),
                                                            lattice(j, kSide, screen.y), 0, 1);
            bool inside = p[3] > 0;
            for (int axis = 0; axis < offer.from.axes; ++axis)
                inside = inside && p[axis] / p[3] >= -0.5 &&
                         p[axis] / p[3] <= static_cast<double>(input[axis]) - 0.5;
            seen += inside;
        }
    return double(seen) / (kSide * kSide);
}

/// Share of the screen that is worked out: whole blocks of columns, where a row sees the input, on
/// some hundred rows.
double blocked_share(const Mat4& map, const Offer& offer) {
    if (!affine(map)) return seen_share(map, offer);
    const Extent& screen = offer.to.extent;
    constexpr int kRows = 200;
    // Spread evenly over rows and slices (Roberts 2018), so that no box falls between the lines of
    // a lattice.
    constexpr double kAcross = 0.7548776662466927, kDown = 0.5698402909980532;
    const double columns = static_cast<double>(screen.x);
    double blocked = 0;
    for (int row = 0; row < kRows; ++row) {
        const auto place = [&](double ratio, std::int64_t n) {
            return std::fmod(0.5 + ratio * row, 1.0) * static_cast<double>(n) - 0.5;
        };
        const Eigen::Vector4d start =
            map * Eigen::Vector4d(0, place(kAcross, screen.y),
                                  offer.to.axes == 2 ? 0 : place(kDown, screen.z), 1);
        double first = 0, last = columns - 1;
        for (int axis = 0; axis < offer.from.axes; ++axis) {
            const double low = -0.5 - start[axis], step = map(axis, 0);
            const double high = low + static_cast<double>(offer.from.extent[axis]);
            if (std::abs(step) < 1e-12) {
                if (low > 0 || high < 0) last = -1;
                continue;
            }
            first = std::max(first, std::min(low / step, high / step));
            last = std::min(last, std::max(low / step, high / step));
        }
        if (last < first) continue;
        const double begin = std::floor(first / kernels::kBackwardBlock);
        const double end = std::floor(last / kernels::kBackwardBlock) + 1;
        blocked += std::min(columns, (end - begin) * kernels::kBackwardBlock);
    }
    return blocked / (columns * kRows);
}

/// Operations of one sample, besides the coordinates that its channels share.
struct Count {
    double place, filter, points;
};

Count count_of(const Filter& filter, int axes) {
    const Hold hold = kernels::hold_of(filter);
    // FIGURE 27: a clip of two comparisons an axis, which TABLE 6 leaves out.
    const WarpCounts counts = backward_counts(hold == Hold::foh ? 1 : 0, axes);
    const double place = counts.inverse.sum() + 2 * axes;
    if (hold == Hold::weighted)
        return {place + axes * filter.operations,
                filter.operations_of(axes) - axes * filter.operations, std::pow(filter.taps, axes)};
    if (hold != Hold::bspline3) return {place, counts.filter.sum(), counts.congested};
    // Weights 16 an axis; a sum of four products (7) for each row of taps, each row of these, ...
    return axes == 2 ? Count{place + 32, 35, 16} : Count{place + 48, 147, 64};
}

/// Spread over ranks as in the thesis: every point is read from the rank that has it (TABLE 6).
Work spread_work(const Offer& offer, const Ask& ask, int view) {
    const int order = hold_of(offer.with) == Hold::foh ? 1 : 0;
    const WarpCounts counts = backward_counts(order, offer.from.axes);
    const Moves moves =
        moves_of(to_input(offer.from, ask.want, view), offer.to.extent, offer.from.extent,
                 offer.from.axes, offer.from.layout, ask.want.ranks);
    const double seen = static_cast<double>(offer.to.samples()) * moves.seen;
    const double channels = offer.from.channels, reads = seen * counts.congested * channels;
    return {.operations = seen * (counts.inverse.sum() + counts.filter.sum() * channels),
            .streamed = offer.to.bytes(),
            .traffic = {.congested = reads * moves.meet}};
}

Work work(const Offer& offer, const Ask& ask, int view) {
    if (is_spread(offer.from)) return spread_work(offer, ask, view);
    const Count count = count_of(filter_of(offer.with), offer.from.axes);
    const Mat4 map = to_input(offer.from, ask.want, view);
    const double seen = static_cast<double>(offer.to.samples()) * blocked_share(map, offer);
    const double taps = std::pow(count.points, 1.0 / offer.from.axes);
    Eigen::Matrix3d lattice = Eigen::Matrix3d::Identity();
    if (offer.from.axes == 2)
        lattice.topLeftCorner<2, 2>() = map.topLeftCorner<2, 2>();
    else
        lattice = map.topLeftCorner<3, 3>();
    const double lines =
        lines_touched(lattice, double(bytes_of(offer.from.type)) * offer.from.channels,
                      {taps, taps, offer.from.axes == 2 ? 1 : taps});
    // What is read and what is written go through the same caches.
    const double both = offer.from.bytes() + offer.to.bytes();
    // Those of large outputs are asked for before they are written, which leaves about a third of
    // the wait: a guess, from casts that ask ahead.
    const double fetched = offer.to.bytes() > kernels::kNearOutput ? 0.35 : 1;
    return {.operations = seen * (count.place + count.filter * offer.from.channels),
            .streamed = offer.to.bytes(),
            .gathers = seen * count.points * offer.from.channels,
            .lines = {seen * lines, both},
            // A line is fetched before it is written, and driven out by those that follow.
            .other_lines = {(fetched + 1) * offer.to.bytes() / kLineBytes, both},
            .variant = hold_of(offer.with) == Hold::weighted ? "weighted" : ""};
}

/// What the samples stand for is just what the hold computes.
bool is_the_field(const Filter& filter, Field field) {
    return field != Field::formula && field_filter(field).name == filter.name;
}

/// Input axes along which a view reads between samples.
int fractional_axes(const Mat4& map, int axes) {
    int count = 0;
    for (int row = 0; row < axes; ++row) {
        const auto whole = [&](int k) {
            return std::abs(map(row, k) - std::round(map(row, k))) < (k == 3 ? 1e-9 : 1e-12);
        };
        count += !(whole(0) && whole(1) && whole(2) && whole(3) && affine(map));
    }
    return count;
}

Error error(const Offer& offer, const Ask& ask) {
    const Hold hold = hold_of(offer.with);
    const Scene& scene = ask.scene;
    int fewest = offer.from.axes, most = 0;
    for (int variant = 0; variant < std::min(ask.want.views.different(), 8); ++variant) {
        const int view = ask.want.views.first_view(variant);
        const int count = fractional_axes(to_input(offer.from, ask.want, view), offer.from.axes);
        fewest = std::min(fewest, count);
        most = std::max(most, count);
    }
    // 2^-23: lanes keep so much of a fraction, and f32 rounds by half of it twice.
    const double greatest = std::max(std::abs(scene.low), std::abs(scene.high));
    // Noise of neighbouring samples is independent, so that reading between them averages it.
    Error error{.noise_gain = std::pow(filter_of(offer.with).noise_gain, fewest),
                .noise = 0x1p-23 * greatest};
    const bool fits = scene.fits_f32(offer.from.type, offer.from.values);
    error.copies = fits && (hold == Hold::zoh || (most == 0 && ask.want.views.different() <= 8));
    // What f32 holds is read and written as it is; and which label it is, rounding does not change.
    const bool labels = ask.want.job->of_points() && ask.want.field == Field::nearest;
    if (hold == Hold::zoh && fits && (labels || offer.from.values.identity())) error.noise = 0;
    if (most == 0 && ask.want.views.different() <= 8) return error;
    if (is_the_field(filter_of(offer.with), ask.want.field)) return error;
    error.bias = hold_error(offer.with.word("filter"), ask);
    return error;
}

/// The box of the input that a box of the screen is made of.
Region reads(const Mat4& map, int taps, const Extent& input, Region out) {
    Region box = Region::all(input);
    if (!affine(map) || out.empty()) return box;
    // Columns are worked out in blocks, of which some may lie beside the region.
    constexpr std::int64_t kBlock = kernels::kBackwardBlock;
    out.begin[0] = out.begin[0] / kBlock * kBlock;
    out.end[0] = (out.end[0] + kBlock - 1) / kBlock * kBlock;
    const double reach = std::max(1, taps / 2);  // taps beyond the cell, and roundings
    for (int row = 0; row < 3; ++row) {
        double low = map(row, 3), high = low;
        for (int k = 0; k < 3; ++k) {
            const double p = map(row, k) * static_cast<double>(out.begin[k]);
            const double q = map(row, k) * static_cast<double>(out.end[k] - 1);
            low += std::min(p, q);
            high += std::max(p, q);
        }
        const double n = static_cast<double>(input[row]);
        // Beyond a border the outermost samples continue.
        box.begin[row] = std::int64_t(std::clamp(std::floor(low - reach), 0.0, n - 1));
        box.end[row] = std::int64_t(std::clamp(std::ceil(high + reach), 0.0, n - 1)) + 1;
    }
    return box;
}

Partition parts(const Offer& offer, const Ask& ask) {
    const Extent tile = kernels::preferred_tile(offer.to.extent);
    Partition parts;
    parts.kind = Partition::output;
    parts.leaf = {offer.to.extent.x, offer.to.axes == 2 ? tile.y : offer.to.extent.y, tile.z};
    parts.reads = [from = offer.from, taps = filter_of(offer.with).taps, want = ask.want](
                      const Region& out, int view) {
        return reads(to_input(from, want, view), taps, from.extent, out);
    };
    return parts;
}

kernels::BackwardWarp warp_of(const Offer& offer, const Ask& ask, const Data& in, int view) {
    const Mat4 map = to_input(offer.from, ask.want, view);
    const kernels::Grid grid = kernels::grid_of(in);
    // Light and opacity end where their volume does.
    const bool is_value = offer.from.content != "colored";
    const auto outside = static_cast<float>(is_value ? outside_of(ask) : 0);
    const Filter& filter = filter_of(offer.with);
    const Hold hold = kernels::hold_of(filter);
    if (affine(map)) return {grid, kernels::affine_of(map), hold, outside, &filter};
    constexpr int kKept[3] = {0, 1, 3};  // an image has no z
    kernels::Homography plane;
    for (int row = 0; row < 3; ++row)
        for (int k = 0; k < 3; ++k) plane[3 * row + k] = map(kKept[row], kKept[k]);
    return {grid, plane, hold, outside, &filter};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const kernels::BackwardWarp warp = warp_of(offer, ask, in, context.view);
    const kernels::WarpOutput output{out.as<float>(), out.held()};
    const Extent tile = kernels::preferred_tile(out.what.extent), size = region.extent();
    const auto tiles = [](std::int64_t n, std::int64_t each) { return (n + each - 1) / each; };
    const std::int64_t across = tiles(size.x, tile.x), down = tiles(size.y, tile.y);
    const std::int64_t rows = down * tiles(size.z, tile.z);
    tbb::parallel_for(std::int64_t{0}, rows * across, [&](std::int64_t i) {
        if (context.stopped()) return;
        Region part = region;
        const std::array<std::int64_t, 3> at{i % across, i / across % down, i / across / down};
        for (int axis = 0; axis < 3; ++axis) {
            part.begin[axis] += at[axis] * tile[axis];
            part.end[axis] = std::min(part.begin[axis] + tile[axis], region.end[axis]);
        }
        warp(output, part);
    });
    context.poll();
}

}  // namespace

Transition backward_warp() {
    Transition edge;
    edge.name = "warp.backward";
    edge.source = "Wittenbrink 1993, FIGURE 26 and 27, TABLE 6";
    edge.joins = {{"object/scalar", "screen/scalar"}, {"object/coefficients", "screen/scalar"}};
    edge.parameters = {{"filter", any_filter({"zoh", "foh", "bspline3"})}};
    edge.laws = {Law::identity, Law::constant, Law::linear, Law::whole_shift, Law::quarter_turn};
    edge.plain = Parameters{};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = backward_model;
    edge.parts = parts;
    edge.run = run;
    edge.trials = warp_trials;
    edge.factors = {{"", 0.68}, {"/filter=bspline3", 0.42}, {"/filter=zoh", 1}};
    return edge;
}

Transition colored_warp() {
    Transition edge = backward_warp();
    edge.name = "warp.colored";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "Wittenbrink 1993, FIGURE 57";
    edge.joins = {{"object/colored", "screen/colored"}};
    edge.parameters = {{"filter", any_filter({"foh"})}};
    edge.laws.clear();
    edge.plain.reset();
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters& with) {
        Offer made = offer(from, ask, with);
        made.to.content = from.content;
        return made;
    };
    edge.error = {};
    edge.model = {};
    return edge;
}

}  // namespace edgewise
