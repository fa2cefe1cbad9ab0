#include "transitions/warp/permutation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <numbers>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/permutation.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/counts.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"
#include "transitions/warp/permutation_model.hpp"
#include "transitions/warp/scale.hpp"

namespace edgewise {
namespace {

using kernels::Send;
using kernels::ShearChain;

constexpr int kGreatestHalo = 4;       // samples; a wider one is no longer a neighbourhood
constexpr const char* kItself = "me";  // in place of a filter: a sample is sent as it is
constexpr double kGuess = 0.04;        // its error, as Filter::guess

std::string too_far(int view, const ShearChain& chain) {
    // A point moves by the bound, and foh reads the sample behind it.
    const int halo = static_cast<int>(std::min(std::floor(chain.bound()), 1e6)) + 1;
    if (halo <= kGreatestHalo) return {};
    return fmt::format(
        "view {}: the rule moves points by up to {:.3g} samples, a halo of {} would "
        "not pay (at most {})",
        view, chain.bound(), halo, kGreatestHalo);
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.field == Field::nearest && send_of(with) == Send::foh)
        return Offer::no("labels: only filter=me and filter=zoh make no new value");
    if (std::string reason = not_equiareal(from, ask, too_far); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
}

/// Multiplications, additions and roundings of the rule: 9 for the three shears of a plane, 20 for
/// four shears of a volume. The translation is inside the rounding and costs nothing.
double rule_operations(const ShearChain& chain) {
    double count = 0;
    for (int k = 0; k < chain.count; ++k) {
        ++count;
        for (double by : chain.shears[k].by) count += by != 0 ? 2 : 0;
    }
    return count;
}

/// Of one sample; the rule alone sends the sample that is there already.
WarpCounts counts_of(Send send, int axes) {
    WarpCounts counts = forward_counts(send == Send::foh ? 1 : 0, axes);
    if (send != Send::me) return counts;
    counts.inverse = {};
    counts.local = 0;
    return counts;
}

/// Spread over ranks, in step, as in the thesis (TABLE 6): no product by zero is left out, and the
/// neighbours' samples lie in a halo that every rank keeps.
Work spread_work(const Offer& offer, const Ask& ask, int view) {
    const Representation& from = offer.from;
    const WarpCounts counts = counts_of(send_of(offer.with), from.axes);
    const Moves moves = moves_of(residual(from, ask.want, view), from.extent, offer.to.extent,
                                 from.axes, from.layout, ask.want.ranks);
    const double samples = static_cast<double>(from.samples()), channels = from.channels;
    const double sends = samples * channels * counts.global;
    const Cut cut = cut_of(from.layout, from.extent, from.axes, ask.want.ranks);
    constexpr int kHalo =
        2;  // a point moves by at most 1.104 samples, and foh reads the one behind
    return {.operations =
                samples * ((counts.rule + counts.inverse).sum() + counts.filter.sum() * channels),
            .streamed = from.bytes() + 2 * offer.to.bytes(),
            .traffic = {.local = samples * channels * counts.local,
                        .global = sends,
                        .congested = sends * (moves.meet - 1)},
            .workspace = halo_samples(from.extent, cut, kHalo) * from.bytes() / samples};
}

Work work(const Offer& offer, const Ask& ask, int view) {
    if (is_spread(offer.from)) return spread_work(offer, ask, view);
    const WarpCounts counts = counts_of(send_of(offer.with), offer.from.axes);
    // FIGURE 30: a clip of two comparisons an axis, which TABLE 6 leaves out.
    const double clip = 2 * offer.from.axes;
    const double samples = static_cast<double>(offer.from.samples());
    const double rule = rule_operations(chain_of(offer.from, ask.want, view));
    return {.operations = samples * (rule + clip + counts.inverse.sum() +
                                     counts.filter.sum() * offer.from.channels),
            .streamed = offer.from.bytes() + 2 * offer.to.bytes(),  // the screen is cleared first
            .traffic = {.local = samples * counts.local * offer.from.channels,
                        .global = samples * offer.from.channels}};
}

/// Mean square error of a filter on a wave, over all places between samples.
double wrong_of_wave(const Filter& filter, double cycles_a_sample) {
    constexpr int kPlaces = 32;
    const double omega = 2 * std::numbers::pi * cycles_a_sample;
    const auto wave = [omega](double x) { return std::polar(1.0, omega * x); };
    double sum = 0;
    for (int i = 0; i < kPlaces; ++i) {
        const double f = (i + 0.5) / kPlaces;
        std::complex<double> got = wave(f < 0.5 ? 0 : 1);
        if (filter.taps == 2) {
            double weights[2];
            filter.weights(f, weights);
            got = weights[0] + weights[1] * wave(1);
        }
        sum += std::norm(got - wave(f));
    }
    return sum / kPlaces;
}

/// How much of a filter's error is left where samples lie closer than those of the input, at most:
/// that of the input's shortest waves, two samples long, along the axis that gained least.
double left_of_error(const Filter& filter, const Representation& from) {
    const Mat4 map = from.placed.at(0).matrix();
    double coarsest = 0;  // [input sample]
    for (int axis = 0; axis < from.axes; ++axis)
        coarsest = std::max(coarsest, 1 / map.block<3, 1>(0, axis).norm());
    if (coarsest > 1 - 1e-9) return 1;
    return std::sqrt(wrong_of_wave(filter, 0.5 * coarsest) / wrong_of_wave(filter, 0.5));
}

Error error(const Offer& offer, const Ask& ask) {
    const Send send = send_of(offer.with);
    const Scene& scene = ask.scene;
    int fewest = offer.from.axes, most = 0;
    const int looked_at = std::min(ask.want.views.different(), 8);
    for (int variant = 0; variant < looked_at; ++variant) {
        const int view = ask.want.views.first_view(variant);
        const int axes = axes_between_samples(chain_of(offer.from, ask.want, view));
        fewest = std::min(fewest, axes);
        most = std::max(most, axes);
    }
    const double greatest = std::max(std::abs(scene.low), std::abs(scene.high));
    Error error{.noise = 0x1p-23 * greatest};  // f32 rounds twice, by half of this
    error.copies = scene.fits_f32(offer.from.type, offer.from.values) &&
                   (send != Send::foh || (most == 0 && ask.want.views.different() == looked_at));
    // What f32 holds is sent as it is; and which label it is, rounding does not change.
    const bool labels = ask.want.job->of_points() && ask.want.field == Field::nearest;
    if (send != Send::foh && error.copies && (labels || offer.from.values.identity()))
        error.noise = 0;
    // Mean of the sum of squared weights of linear interpolation over all fractions: 2/3 an axis.
    if (send == Send::foh) error.noise_gain = std::pow(2.0 / 3, fewest / 2.0);
    if (most == 0 && ask.want.views.different() == looked_at) return error;
    if (send == Send::foh && ask.want.field == Field::linear) return error;
    if (send == Send::zoh && ask.want.field == Field::nearest) return error;
    const std::string& word = offer.with.word("filter");
    error.bias = send == Send::me ? hold_error(word, kGuess, ask) : hold_error(word, ask);
    if (offer.from.space == kScaled)
        error.bias *= left_of_error(
            field_filter(send == Send::foh ? Field::linear : Field::nearest), offer.from);
    return error;
}

/// Calls `use` for the tiles of a box, in parallel, until it is stopped.
template <class Use>
void in_tiles(const Region& box, const Extent& tile, const Context& context, const Use& use) {
    const auto tiles = [&](int axis) { return (box.extent()[axis] + tile[axis] - 1) / tile[axis]; };
    const std::int64_t across = tiles(0), down = tiles(1);
    tbb::parallel_for(std::int64_t{0}, across * down * tiles(2), [&](std::int64_t i) {
        if (context.stopped()) return;
        Region part = box;
        const std::array<std::int64_t, 3> at{i % across, i / across % down, i / across / down};
        for (int axis = 0; axis < 3; ++axis) {
            part.begin[axis] += at[axis] * tile[axis];
            part.end[axis] = std::min(part.begin[axis] + tile[axis], box.end[axis]);
        }
        use(part);
    });
}

/// The whole screen is one region: a box of it walks more sites than it gets values from.
Partition parts(const Offer& offer, const Ask& ask) {
    return {.kind = Partition::output,
            .leaf = offer.to.extent,
            .reads = [offer, want = ask.want](const Region& out, int view) {
                const kernels::Grid object{.extent = offer.from.extent, .values = {}};
                return kernels::PermutationWarp(object, chain_of(offer.from, want, view),
                                                send_of(offer.with), offer.to.extent, out)
                    .reads();
            }};
}

/// @param out  holds the region or all
void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    if (out.held() != region) {
        Data part = Data::make(out.what, region, context.memory);
        run(offer, ask, in, part, region, context);
        copy_box(part, out);
        return;
    }
    const kernels::PermutationWarp warp(kernels::grid_of(in),
                                        chain_of(offer.from, ask.want, context.view),
                                        send_of(offer.with), out.what.extent, region);
    const auto outside = static_cast<float>(outside_of(ask));
    const std::int64_t row = out.row();
    float* screen = out.as<float>();
    const Extent size = region.extent();
    in_tiles({{0, 0, 0}, {1, size.y, size.z}}, {1, 64, 1}, context, [&](const Region& rows) {
        const std::int64_t first = rows.begin[2] * size.y + rows.begin[1];
        std::fill_n(screen + first * row, (rows.end[1] - rows.begin[1]) * row, outside);
    });
    // No two sites have the same image, so tiles never write the same sample.
    in_tiles(warp.sites(), kernels::preferred_sites(in.what.extent), context,
             [&](const Region& sites) { warp(sites, screen); });
    context.poll();
}

}  // namespace

Send send_of(const Parameters& with) {
    const std::string& word = with.word("filter");
    if (word == kItself) return Send::me;
    return filter_named(word).taps == 1 ? Send::zoh : Send::foh;
}

Transition permutation_warp() {
    Transition edge;
    edge.name = "warp.permutation";
    edge.source = "Wittenbrink 1993, EQ 22, FIGURE 28 to 30, TABLE 6, Theorem 3.1";
    edge.joins = {{"object/scalar", "screen/scalar"}, {"scaled/scalar", "screen/scalar"}};
    edge.parameters = {
        {"filter", one_of({kItself, "zoh", "foh"},
                          "what a sample sends: me itself, zoh the nearest sample to "
                          "the screen site's point, foh linear reconstruction there")}};
    edge.laws = {Law::identity,    Law::constant,     Law::linear,
                 Law::whole_shift, Law::quarter_turn, Law::bijection};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = permutation_model;
    edge.parts = parts;
    edge.run = run;
    edge.trials = warp_trials;
    edge.factors = {{"", 2.9}, {"/filter=foh", 2.6}};
    return edge;
}

}  // namespace edgewise
