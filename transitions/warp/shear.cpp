#include "transitions/warp/shear.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/ranges.h>
#include <memory>
#include <optional>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/spread.hpp"
#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/shear.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/counts.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"
#include "transitions/warp/shear_model.hpp"

namespace edgewise {
namespace {

using kernels::Hold;
using kernels::ShearChain;
using kernels::ShearPass;

constexpr double kSteepest = 8;  // samples of shift from line to line

const Filter& filter_of(const Parameters& with) { return filter_named(with.word("filter")); }
Hold hold_of(const Parameters& with) { return kernels::hold_of(filter_of(with)); }

/// Refuses maps that are far from a rotation of the samples, as turns of oblong pixels are.
std::string too_steep(int view, const ShearChain& chain) {
    double steepest = 0, coarsest = 0;
    for (int k = 0; k < chain.count; ++k) {
        for (double by : chain.shears[k].by) steepest = std::max(steepest, std::abs(by));
        for (double step : kernels::line_of_pass(chain, k))
            coarsest = std::max(coarsest, std::abs(step));
    }
    if (steepest > kSteepest)
        return fmt::format(
            "view {}: a shear by {:.3g} samples a line; intermediate boxes would be huge "
            "(at most {})",
            view, steepest, kSteepest);
    if (coarsest > kernels::kCoarsestLine)
        return fmt::format(
            "view {}: a pass would interpolate between samples that lie {:.3g} apart in the input, "
            "and lose what lies between (at most {})",
            view, coarsest, kernels::kCoarsestLine);
    return {};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.field == Field::nearest)
        return Offer::no("labels: interpolation would make new values");
    if (filter_of(with).taps % 2 != 0)
        return Offer::no("passes interpolate; nearest samples are moved by warp.permutation");
    if (is_spread(from) && hold_of(with) != Hold::foh)
        return Offer::no("over ranks: passes by filter=foh only");
    if (from.channels != 1) return Offer::no(fmt::format("{} channels; moves one", from.channels));
    if (ask.scene.non_finite > 0)
        return Offer::no(fmt::format("{} samples are not finite: every pass would spread them",
                                     ask.scene.non_finite));
    if (std::string reason = not_equiareal(from, ask, too_steep); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
}

struct Passes {
    ShearChain chain;
    std::vector<ShearPass> passes;
};

Passes passes_of(const Offer& offer, const Request& want, int view) {
    const ShearChain chain = chain_of(offer.from, want, view);
    return {chain, kernels::shear_passes(chain, offer.from.extent, offer.to.extent,
                                         hold_of(offer.with), &filter_of(offer.with))};
}

double samples_of(const Region& box) {
    return box.empty() ? 0 : static_cast<double>(box.extent().samples());
}

/// Spread over ranks (TABLE 6): the passes read neighbours, and one send puts samples in place.
Work spread_work(const Offer& offer, const Ask& ask, int view) {
    const ShearChain chain = chain_of(offer.from, ask.want, view);
    const WarpCounts counts = multipass_counts(chain.count);
    const double samples = static_cast<double>(offer.from.samples());
    const double floats = samples * sizeof(float);
    return {.operations = samples * counts.filter.sum(),
            .streamed = 2 * chain.count * floats,
            .traffic = {.local = samples * counts.local, .global = samples * counts.global},
            .workspace = 2 * floats / ask.want.ranks};
}

Work work(const Offer& offer, const Ask& ask, int view) {
    if (is_spread(offer.from)) return spread_work(offer, ask, view);
    const auto [chain, passes] = passes_of(offer, ask.want, view);
    const Filter& filter = filter_of(offer.with);
    // Of coefficients with their making.
    const double each = filter.coefficients ? 18 : 4 + 2 * filter.taps;
    constexpr double kFloat = sizeof(float);
    Work work{.streamed = offer.to.bytes()};  // the mask
    const double permuted = chain.starts_in_place() ? 0 : offer.from.bytes();
    work.streamed += 2 * permuted;
    double from = permuted;  // bytes that the next pass reads, unless it reads the input itself
    work.workspace = permuted;
    for (std::size_t k = 0; k < passes.size(); ++k) {
        const bool last = k + 1 == passes.size();
        const double samples = samples_of(passes[k].to);
        const double read = k == 0 ? offer.from.bytes() : samples_of(passes[k].from) * kFloat;
        const double to = last ? 0 : samples * kFloat;
        work.operations += each * samples;
        work.streamed += read + samples * kFloat;
        work.workspace = std::max(work.workspace, from + to);
        from = to;
        work.scratch = std::max(work.scratch, kernels::shear_scratch(passes[k]) * kFloat);
    }
    return work;
}

Error error(const Offer& offer, const Ask& ask) {
    const Scene& scene = ask.scene;
    double passes = 0, slanted = 0, axes = 0;
    const int looked_at = std::min(ask.want.views.different(), 8);
    for (int variant = 0; variant < looked_at; ++variant) {
        const ShearChain chain = chain_of(offer.from, ask.want, ask.want.views.first_view(variant));
        if (axes_between_samples(chain) == 0) continue;
        passes = std::max(passes, double(chain.count));
        slanted = std::max(slanted, double(kernels::slanted_passes(chain)));
        axes = std::max(axes, double(axes_between_samples(chain)));
    }
    const double greatest = std::max(std::abs(scene.low), std::abs(scene.high));
    Error error{.noise = 0x1p-23 * greatest * std::sqrt(std::max(passes, 1.0))};
    if (passes == 0 && ask.want.views.different() == looked_at) return error;
    const std::string& filter = offer.with.word("filter");
    error.bias = hold_error(filter, ask);
    const std::optional<double> pass = scene.fact(kShearedError(filter));
    if (slanted == 0) return error;
    if (!pass) {
        error.bias *= std::max(passes / std::max(axes, 1.0), 1.0);
        return error;
    }
    // The first pass interpolates along the samples' own lines, as the direct hold does; later ones
    // along slanted lines of the field. A linear hold blurs these as it does the axes that it has
    // no pass for; of a spline all that they get wrong is new. Losses of one sign add.
    const double direct = error.bias;
    error.bias += slanted * *pass;
    if (filter_named(filter).taps == 2 && ask.want.field != Field::linear)
        error.bias = std::max(direct + std::max(passes - axes, 0.0) * *pass,
                              direct / std::max(axes, 1.0) + slanted * *pass);
    // What sheared grids fold over has no sign, and passes into a picture as noise does.
    if (ask.want.job->of_rays()) error.noise = std::hypot(error.noise, *pass * std::sqrt(slanted));
    return error;
}

/// How the lines of a pass are shared out: whole lines, enough of them to fill cache lines.
Extent part_of(const ShearPass& pass) {
    const Extent all = pass.to.extent();
    if (pass.shear.axis == 0) return {all.x, 32, 1};
    if (pass.shear.axis == 1) return {64, all.y, 1};
    return {64, 1, all.z};
}

void run_pass(const ShearPass& pass, const kernels::Grid& in, float* out, const Region& held,
              Hold hold, Context& context) {
    if (pass.to.empty()) return;
    const Extent part = part_of(pass), all = pass.to.extent();
    const auto parts = [&](int axis) { return (all[axis] + part[axis] - 1) / part[axis]; };
    const std::int64_t across = parts(0), down = parts(1);
    tbb::parallel_for(std::int64_t{0}, across * down * parts(2), [&](std::int64_t i) {
        if (context.stopped()) return;
        const std::array<std::int64_t, 3> at{i % across, i / across % down, i / across / down};
        Region lines = pass.to;
        for (int axis = 0; axis < 3; ++axis) {
            lines.begin[axis] += at[axis] * part[axis];
            lines.end[axis] = std::min(lines.begin[axis] + part[axis], pass.to.end[axis]);
        }
        kernels::Block<float> scratch(kernels::shear_scratch(pass), context.memory);
        kernels::run_shear_pass(pass, in, out, held, hold, lines, scratch.data());
    });
    context.poll();
}

using Bytes = kernels::Block<std::byte>;

/// A box of the input behind the exact permutation, in its own type.
void permute(const ShearChain& chain, const Data& in, const Region& box, std::byte* out,
             Context& context) {
    const kernels::AxisPermutation permutation{.from = chain.from, .sign = chain.sign, .shift = {}};
    const kernels::Grid grid = kernels::grid_of(in);
    const std::byte outside[8] = {};  // never seen: the box lies in the input
    constexpr std::int64_t kRows = 32;
    const Extent to = box.extent();
    const std::int64_t blocks = (to.y + kRows - 1) / kRows;
    tbb::parallel_for(std::int64_t{0}, blocks * to.z, [&](std::int64_t i) {
        if (context.stopped()) return;
        Region part = box;
        part.begin[1] += i % blocks * kRows;
        part.end[1] = std::min(part.begin[1] + kRows, box.end[1]);
        part.begin[2] += i / blocks;
        part.end[2] = part.begin[2] + 1;
        kernels::copy_permuted(grid, bytes_of(in.what.type), permutation, outside, out, box, part);
    });
    context.poll();
}

void mask(const Offer& offer, const Ask& ask, Data& out, const Region& box, Context& context) {
    const Extent size = box.extent();
    const kernels::Affine to_input = inverse_map(offer.from, ask.want, context.view);
    tbb::parallel_for(std::int64_t{0}, size.z * size.y, [&](std::int64_t row) {
        Region part = box;
        part.begin[1] += row % size.y, part.end[1] = part.begin[1] + 1;
        part.begin[2] += row / size.y, part.end[2] = part.begin[2] + 1;
        kernels::mask_outside(to_input, offer.from.extent, static_cast<float>(outside_of(ask)),
                              out.as<float>(), out.held(), part);
    });
}

/// The box of the input that a box behind the chain's exact permutation is copied from.
Region in_place(const ShearChain& chain, const Region& box) {
    Region in;
    for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(chain.from[i]);
        const bool forward = chain.sign[i] > 0;
        in.begin[axis] = forward ? box.begin[i] : 1 - box.end[i];
        in.end[axis] = forward ? box.end[i] : 1 - box.begin[i];
    }
    return in;
}

Partition parts(const Offer& offer, const Ask& ask) {
    if (is_spread(offer.from)) return {};
    return {.kind = Partition::output,
            .leaf = offer.to.extent,
            .reads = [offer, want = ask.want](const Region& out, int view) {
                const auto [chain, whole] = passes_of(offer, want, view);
                const auto passes = kernels::passes_of_box(whole, hold_of(offer.with), out);
                return passes.empty() ? Region{} : in_place(chain, passes.front().from);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Hold hold = hold_of(offer.with);
    const auto [chain, whole] = passes_of(offer, ask.want, context.view);
    const std::vector<ShearPass> passes = kernels::passes_of_box(whole, hold, region);
    kernels::Grid now = kernels::grid_of(in);
    now.row = now.row_step();
    now.slice = now.slice_step();
    // What the next pass reads; taken away when the pass behind it has been made.
    std::unique_ptr<Bytes> held;
    const auto bytes = [](const Region& box, std::size_t each) {
        return static_cast<std::size_t>(box.extent().samples()) * each + kArraySlack;
    };
    if (!passes.empty() && !chain.starts_in_place()) {
        const Region& box = passes.front().from;
        held = std::make_unique<Bytes>(bytes(box, bytes_of(in.what.type)), context.memory);
        permute(chain, in, box, held->data(), context);
        now = {held->data(), in.what.type, box.extent(), 1, in.what.values};
    }
    for (std::size_t k = 0; k < passes.size(); ++k) {
        const Region& to = passes[k].to;
        if (k + 1 == passes.size()) {
            run_pass(passes[k], now, out.as<float>(), out.held(), hold, context);
            break;
        }
        auto next = std::make_unique<Bytes>(bytes(to, sizeof(float)), context.memory);
        run_pass(passes[k], now, reinterpret_cast<float*>(next->data()), to, hold, context);
        held = std::move(next);
        now = {held->data(), Type::f32, to.extent(), 1, {}};
    }
    mask(offer, ask, out, region, context);
    context.poll();
}

/// Passes interpolate: nearest samples are moved by warp.permutation.
Domain filters_between_samples() {
    Domain any = any_filter({"foh", "bspline3"});
    std::erase_if(any.words,
                  [](const std::string& name) { return filter_named(name).taps % 2 != 0; });
    any.meaning =
        fmt::format("reconstruction along the lines of each pass: {}", fmt::join(any.words, ", "));
    return any;
}

}  // namespace

Transition shear_warp_passes() {
    Transition edge;
    edge.name = "warp.shear";
    edge.source = "Wittenbrink 1993, 3.6.6, EQ 10 and 32, TABLE 6";
    edge.joins = {{"object/scalar", "screen/scalar"}};
    edge.parameters = {{"filter", filters_between_samples()}};
    edge.laws = {Law::identity, Law::constant, Law::linear, Law::whole_shift, Law::quarter_turn};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = shear_model;
    edge.parts = parts;
    edge.run = run;
    edge.trials = warp_trials;
    edge.factors = {{"", 2.2}};
    return edge;
}

}  // namespace edgewise
