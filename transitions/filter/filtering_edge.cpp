#include "transitions/filter/filtering_edge.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "graph/with_type.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

double largest_of(const Scene& scene) {
    return std::max(std::abs(scene.low), std::abs(scene.high));
}

/// Whether f32 holds every sum of the pass, and all on the way to it.
bool exact_in_f32(const Neighbourhood& pass, const Representation& from, const Scene& scene) {
    constexpr double kWhole = 0x1p24;
    return pass.sums_integers(from.type, from.values) &&
           pass.sum_of_magnitudes() * largest_of(scene) < kWhole;
}

/// Whether the stored numbers may be ordered as they are.
bool ordered_as_stored(const Neighbourhood& pass, const Representation& from) {
    const bool no_zero = pass.border == Border::zero && from.values.offset != 0;
    return pass.flat() && from.type != Type::f16 && from.values.slope > 0 && !no_zero;
}

/// The type in which a pass computes and stores.
Type type_of_pass(const Neighbourhood& pass, const Representation& from, const Scene& scene) {
    const bool wide = bytes_of(from.type) >= 4 && from.type != Type::f32;
    if (!pass.of_sum()) {
        const bool moves = pass.rule == Neighbourhood::Rule::median || pass.flat();
        if (moves && ordered_as_stored(pass, from)) return from.type;
        return wide ? Type::f64 : Type::f32;
    }
    if (exact_in_f32(pass, from, scene)) return Type::f32;
    return wide || is_integer(from.type) ? Type::f64 : Type::f32;
}

/// What a pass makes of samples; of a median the weights say nothing.
Representation made_of(const Neighbourhood& pass, const Representation& from, const Scene& scene) {
    Representation to = from;
    to.content = "filtered";
    to.drop_facets();
    to.type = type_of_pass(pass, from, scene);
    if (pass.of_sum() || !ordered_as_stored(pass, from)) to.values = {};
    return to;
}

/// What the passes make, one after another.
std::vector<Representation> stages(const std::vector<Neighbourhood>& passes,
                                   const Representation& from, const Scene& scene) {
    std::vector<Representation> all{from};
    for (const Neighbourhood& pass : passes) all.push_back(made_of(pass, all.back(), scene));
    return all;
}

std::string not_as_read(const Representation& from, const Request& want) {
    if (!want.setting.as<Filtering>()) return "the request names no kernel";
    if (from.extent != want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return "the samples no longer lie where the input has them";
    if (from.layout != Layout::linear || from.place != Place::memory)
        return "needs samples in memory, row by row";
    if (from.type == Type::c64) return "complex samples are not filtered";
    return {};
}

/// The difference of a top hat.
Representation difference_of(const Representation& opened) {
    Representation to = opened;
    const bool wide = bytes_of(opened.type) >= 4 && opened.type != Type::f32;
    to.type = wide ? Type::f64 : Type::f32;
    to.values = {};
    return to;
}

Offer offer(const FilterAlgorithm& algorithm, const Representation& from, const Ask& ask,
            const Parameters& with) {
    if (std::string reason = not_as_read(from, ask.want); !reason.empty())
        return Offer::no(std::move(reason));
    const Filtering& filtering = *ask.want.setting.as<Filtering>();
    const std::vector<Neighbourhood> passes = passes_of(filtering);
    const std::vector<Representation> made = stages(passes, from, ask.scene);
    for (std::size_t i = 0; i < passes.size(); ++i)
        if (std::string reason =
                algorithm.refused({passes[i], made[i], ask.scene, with, made[i + 1].type});
            !reason.empty())
            return Offer::no(std::move(reason));
    Offer offer{.from = from, .to = made.back(), .with = with};
    if (filtering.op == FilterOp::tophat) offer.to = difference_of(offer.to);
    return offer;
}

Work work(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask) {
    const std::vector<Neighbourhood> passes = passes_of(*ask.want.setting.as<Filtering>());
    const std::vector<Representation> made = stages(passes, offer.from, ask.scene);
    const double n = static_cast<double>(offer.from.samples()) * offer.from.channels;
    Work work;
    for (std::size_t i = 0; i < passes.size(); ++i) {
        // Samples into tiles and out of them.
        constexpr double kCopies = 4;
        const PassAsk pass{passes[i], made[i], ask.scene, offer.with, made[i + 1].type};
        // Vectors hold half as many f64, and twice or four times as many narrow integers.
        const double width = double(bytes_of(pass.type)) / sizeof(float);
        const double copied = algorithm.in_place && pass.in_place() ? 0 : kCopies;
        work.operations += n * (algorithm.operations(pass) * width + copied);
        if (algorithm.lines) {
            const Lines lines = algorithm.lines(pass);
            work.lines.count += n * lines.count;
            work.lines.span = std::max(work.lines.span, lines.span);
        }
        if (algorithm.variant) work.variant = algorithm.variant(pass);
        work.streamed += made[i].bytes() + made[i + 1].bytes();
        const TileShape shape(passes[i],
                              tile_for(passes[i], offer.from.extent, bytes_of(pass.type)));
        if (algorithm.scratch)
            work.scratch = std::max(work.scratch, algorithm.scratch(pass));
        else
            work.scratch = std::max(work.scratch, 3 * static_cast<double>(shape.values()) *
                                                      double(bytes_of(pass.type)));
        if (i > 0) work.workspace = made[i].bytes();
    }
    if (ask.want.setting.as<Filtering>()->op == FilterOp::tophat) {
        work.operations += n;
        work.workspace += made.back().bytes();
    }
    return work;
}

/// Whether what is added to samples, or subtracted, is exact in the type of the pass.
bool adds_exactly(const Neighbourhood& pass, const Representation& from, Type type,
                  const Scene& scene) {
    double highest = 0;
    for (const double weight : pass.weights)
        if (pass.counts(weight)) highest = std::max(highest, std::abs(weight));
    constexpr double kWhole = 0x1p24, kWide = 0x1p53;
    const bool whole = is_integer(from.type) && pass.whole() &&
                       from.values.slope == std::round(from.values.slope) &&
                       from.values.offset == std::round(from.values.offset);
    return whole && largest_of(scene) + highest < (type == Type::f64 ? kWide : kWhole);
}

/// RMS of what a rounding changes, as a part of the value: a step of 2^-23 to 2^-24 of it, evenly
/// within half of it, over values of all mantissas [log-uniform: sqrt(3 / (8 ln 2) / 3)].
constexpr double kRounded = 0.425;

double unit_of(Type type) { return type == Type::f64 ? 0x1p-53 : 0x1p-24; }

/// What rounding adds in one pass. Without measurements on the data it is a bound; with them what
/// roundings of sums that grow like a random walk, or steadily, come to.
double rounding_noise(const PassAsk& ask) {
    const Neighbourhood& pass = ask.of;
    const double unit = unit_of(ask.type), largest = largest_of(ask.scene);
    if (!pass.of_sum()) {
        if (pass.flat() || adds_exactly(pass, ask.from, ask.type, ask.scene)) return 0;
        double highest = 0;
        for (const double weight : pass.weights)
            if (pass.counts(weight)) highest = std::max(highest, std::abs(weight));
        return unit * (largest + highest);
    }
    const double scale = std::abs(pass.scale), all = scale * pass.sum_of_magnitudes();
    const auto rms = ask.scene.facts.find("result/rms");
    const bool is_measured = rms != ask.scene.facts.end();
    if (exact_in_f32(pass, ask.from, ask.scene)) {
        // A sum of equal weights is scaled in the end, and rounded once.
        if (pass.scale == 1) return 0;
        return is_measured ? kRounded * unit * rms->second : unit * all * largest;
    }
    if (!is_measured) return unit * all * largest;
    double square = 0;
    for (const double weight : pass.weights)
        if (pass.counts(weight)) square += weight * weight;
    // Partial sums rise to the result, or walk as far as weights of random signs take them; each is
    // rounded as its size is. A product that is rounded by itself adds half as much again.
    const double walk = scale * std::sqrt(square) * largest;
    const double sums = std::hypot(rms->second, walk);
    return 1.5 * kRounded * unit * sums * std::sqrt(double(pass.places()) / 2);
}

/// Whether results are samples as they were read, or the 0 beyond them.
bool only_copies(const std::vector<Neighbourhood>& passes, const Filtering& filtering) {
    return filtering.op != FilterOp::tophat &&
           std::all_of(passes.begin(), passes.end(), [](const Neighbourhood& pass) {
               return pass.rule == Neighbourhood::Rule::median ||
                      (!pass.of_sum() && pass.flat());
           });
}

/// What running the edge gave (scene/measured_results.hpp).
std::optional<double> measured_noise(const FilterAlgorithm& algorithm, const Offer& offer,
                                     const Scene& scene) {
    const auto found = scene.facts.find("run/" + algorithm.name + offer.with.text());
    return found == scene.facts.end() ? std::nullopt : std::optional(found->second);
}

Error error(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask) {
    const Filtering& filtering = *ask.want.setting.as<Filtering>();
    const std::vector<Neighbourhood> passes = passes_of(filtering);
    Error error;
    error.copies = only_copies(passes, filtering);
    if (const auto measured = measured_noise(algorithm, offer, ask.scene)) {
        error.noise = *measured;
        return error;
    }
    const std::vector<Representation> made = stages(passes, offer.from, ask.scene);
    for (std::size_t i = 0; i < passes.size(); ++i) {
        const PassAsk about{passes[i], made[i], ask.scene, offer.with, made[i + 1].type};
        error.noise = std::hypot(error.noise, rounding_noise(about));
        if (!algorithm.error) continue;
        const Error added = algorithm.error(about);
        error.known = error.known && added.known;
        error.bias += added.bias;
        error.noise = std::hypot(error.noise, added.noise);
    }
    if (filtering.op == FilterOp::tophat && !is_integer(offer.from.type))
        error.noise = std::hypot(error.noise, unit_of(offer.to.type) * largest_of(ask.scene));
    error.copies = error.copies && error.known;
    return error;
}

/// from - opened.
void subtract(const Data& from, const Data& opened, Data& out, const Context& context) {
    const std::int64_t n = out.what.samples() * out.what.channels;
    constexpr std::int64_t kGrain = 1 << 16;
    const auto numbers = [](const Data& data) {
        return [&data](std::int64_t i) {
            if (data.what.type == Type::f16)
                return data.what.values(
                    double(kernels::float_of_half(data.as<std::uint16_t>()[i])));
            return with_type(data.what.type, [&](auto type) {
                return data.what.values(static_cast<double>(data.as<decltype(type)>()[i]));
            });
        };
    };
    const auto minuend = numbers(from), subtrahend = numbers(opened);
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, kGrain), [&](const auto& part) {
        if (context.stopped()) return;
        for (std::int64_t i = part.begin(); i < part.end(); ++i) {
            const double difference = minuend(i) - subtrahend(i);
            if (out.what.type == Type::f64)
                out.as<double>()[i] = difference;
            else
                out.as<float>()[i] = static_cast<float>(difference);
        }
    });
    context.poll();
}

void run(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask, const Data& in,
         Data& out, Context& context) {
    const Filtering& filtering = *ask.want.setting.as<Filtering>();
    const std::vector<Neighbourhood> passes = passes_of(filtering);
    const std::vector<Representation> made = stages(passes, offer.from, ask.scene);
    const bool differs = filtering.op == FilterOp::tophat;
    std::vector<Data> between;
    between.reserve(passes.size());
    const Data* from = &in;
    for (std::size_t i = 0; i < passes.size(); ++i) {
        const bool last = i + 1 == passes.size() && !differs;
        if (!last) between.push_back(Data::make(made[i + 1], context.memory));
        Data& to = last ? out : between.back();
        kernels::Grid grid = kernels::grid_of(*from);
        // Stored numbers are ordered as they are.
        if (to.what.values == from->what.values && !passes[i].of_sum()) grid.values = {};
        algorithm.run({passes[i], grid, to, offer.with, context, ask.scene.non_finite == 0},
                      made[i + 1].type);
        from = &to;
    }
    if (differs) subtract(in, between.back(), out, context);
}

}  // namespace

Transition filtering_edge(const FilterAlgorithm& algorithm) {
    Transition edge;
    edge.name = algorithm.name;
    edge.source = algorithm.source;
    edge.joins = {{"object/scalar", "object/filtered"}};
    edge.parameters = algorithm.parameters;
    edge.on_demand = algorithm.on_demand;
    edge.offer = [algorithm](const Representation& from, const Ask& ask, const Parameters& with) {
        return offer(algorithm, from, ask, with);
    };
    edge.work = [algorithm](const Offer& made, const Ask& ask, int /*view*/) {
        return work(algorithm, made, ask);
    };
    edge.error = [algorithm](const Offer& made, const Ask& ask) {
        return error(algorithm, made, ask);
    };
    edge.run = [algorithm](const Offer& made, const Ask& ask, const Data& in, Data& out,
                           const Region& /*all*/,
                           Context& context) { run(algorithm, made, ask, in, out, context); };
    return edge;
}

}  // namespace edgewise
