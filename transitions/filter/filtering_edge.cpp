#include "transitions/filter/filtering_edge.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "graph/kinds.hpp"
#include "graph/with_type.hpp"
#include "transitions/filter/adjoint.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/trials/trials.hpp"

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

/// The passes of a request, and what they read and make.
struct Stages {
    const Filtering& filtering;
    SmallVector<Neighbourhood> passes;
    SmallVector<Representation> made;  // the first is what is read, then one for each pass
    /// The scene of the samples that are read; masks have their own.
    const Scene& scene;

    Stages(const Representation& from, const Ask& ask)
        : filtering(*ask.want.setting.as<Filtering>()),
          passes(passes_of(filtering)),
          made{from},
          scene(is_binary(filtering.op) ? of_masks() : ask.scene) {
        if (is_binary(filtering.op)) made[0] = mask_of(from);
        for (std::size_t i = 0; i < passes.size(); ++i)
            made.push_back(made_of(passes[i], read_by(i), scene));
    }
    bool is_gradient() const noexcept { return filtering.op == FilterOp::gradient; }
    /// Derivatives are all taken of the input.
    const Representation& read_by(std::size_t pass) const {
        return is_gradient() ? made[0] : made[pass];
    }
    const Representation& made_by(std::size_t pass) const { return made[pass + 1]; }
    PassAsk ask(std::size_t pass, const Parameters& with) const {
        return {passes[pass], read_by(pass), scene, with, made_by(pass).type};
    }
    /// Whether what the last pass makes is no result yet.
    bool ends_in_values() const noexcept {
        return is_gradient() || filtering.op == FilterOp::tophat;
    }
    bool adjoins(std::size_t pass) const {
        return pass > 0 && !is_gradient() && needs_adjoint(passes[pass]);
    }

    Representation result() const {
        Representation to = made.back();
        if (is_binary(filtering.op)) to.values = {.slope = filtering.inside, .offset = 0};
        if (!ends_in_values()) return to;
        // A difference, or a length.
        const bool wide = bytes_of(to.type) >= 4 && to.type != Type::f32;
        to.type = wide && !(is_gradient() && is_integer(made[0].type)) ? Type::f64 : Type::f32;
        to.values = {};
        return to;
    }

 private:
    static const Scene& of_masks() {
        static const Scene scene = [] {
            Scene mask;
            mask.low = 0, mask.high = mask.range = 1, mask.non_finite = 0;
            return mask;
        }();
        return scene;
    }
    static Representation mask_of(Representation from) {
        from.drop_facets();
        from.type = Type::u8;
        from.values = {};
        return from;
    }
};

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

Offer offer(const FilterAlgorithm& algorithm, const Representation& from, const Ask& ask,
            const Parameters& with) {
    if (std::string reason = not_as_read(from, ask.want); !reason.empty())
        return Offer::no(std::move(reason));
    const Stages stages(from, ask);
    for (std::size_t i = 0; i < stages.passes.size(); ++i)
        if (std::string reason = algorithm.refused(stages.ask(i, with)); !reason.empty())
            return Offer::no(std::move(reason));
    return {.from = from, .to = stages.result(), .with = with};
}

Work work(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask) {
    const Stages stages(offer.from, ask);
    const SmallVector<Neighbourhood>& passes = stages.passes;
    const double n = static_cast<double>(offer.from.samples()) * offer.from.channels;
    Work work;
    if (is_binary(stages.filtering.op)) {
        work.operations += 3 * n;
        work.streamed += offer.from.bytes() + stages.made[0].bytes();
        work.workspace += stages.made[0].bytes();
    }
    for (std::size_t i = 0; i < passes.size(); ++i) {
        // Samples into tiles and out of them.
        constexpr double kCopies = 4;
        const PassAsk pass = stages.ask(i, offer.with);
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
        work.streamed += stages.read_by(i).bytes() + stages.made_by(i).bytes();
        const TileShape shape(passes[i],
                              tile_for(passes[i], offer.from.extent, bytes_of(pass.type)));
        if (algorithm.scratch)
            work.scratch = std::max(work.scratch, algorithm.scratch(pass));
        else
            work.scratch = std::max(work.scratch, 3 * static_cast<double>(shape.values()) *
                                                      double(bytes_of(pass.type)));
        const bool last = i + 1 == passes.size() && !stages.ends_in_values();
        if (!last) work.workspace += stages.made_by(i).bytes();
        if (!stages.adjoins(i)) continue;
        // For each sample a read, a sum, two comparisons of places and one of values.
        constexpr double kEach = 8;
        work.operations += kEach * pass.alone() * double(passes[i].places()) *
                           adjoined_samples(passes[i], offer.from.extent) * offer.from.channels;
    }
    if (stages.filtering.op == FilterOp::tophat) work.operations += n;
    if (stages.is_gradient()) work.operations += n * (2.0 * double(passes.size()) + 1);
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

/// RMS of a rounding error, as a part of the value: a step of 2^-23 to 2^-24 of it, evenly
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
    const std::optional<double> rms = ask.scene.measured(kResultRms);
    if (exact_in_f32(pass, ask.from, ask.scene)) {
        // A sum of equal weights is scaled in the end, and rounded once.
        if (pass.scale == 1) return 0;
        return rms ? kRounded * unit * *rms : unit * all * largest;
    }
    if (!rms) return unit * all * largest;
    double square = 0;
    for (const double weight : pass.weights)
        if (pass.counts(weight)) square += weight * weight;
    // Partial sums rise to the result, or walk as far as weights of random signs take them; each is
    // rounded as its size is. A product that is rounded by itself adds half as much again.
    const double walk = scale * std::sqrt(square) * largest;
    const double sums = std::hypot(*rms, walk);
    return 1.5 * kRounded * unit * sums * std::sqrt(double(pass.places()) / 2);
}

/// Whether results are samples as they were read, or the 0 beyond them.
bool only_copies(const SmallVector<Neighbourhood>& passes, const Filtering& filtering) {
    return filtering.op != FilterOp::tophat &&
           std::all_of(passes.begin(), passes.end(), [](const Neighbourhood& pass) {
               return pass.rule == Neighbourhood::Rule::median || (!pass.of_sum() && pass.flat());
           });
}

/// What running the edge gave (scene/measured_results.hpp).
std::optional<Error> measured_error(const FilterAlgorithm& algorithm, const Offer& offer,
                                    const Scene& scene) {
    const std::string& name = algorithm.name;
    const Parameters& with = offer.with;
    const Type type = offer.from.type;
    if (scene.measured(kResultType) == static_cast<double>(type)) {
        if (const auto noise = scene.measured(fact_of_runs(name, with)))
            return Error{.noise = *noise};
    } else if (const auto noise = scene.measured(fact_of_runs(name, with, type))) {
        // It was measured from the samples on.
        return Error{.gain = 0, .noise_gain = 0, .noise = *noise};
    }
    return {};
}

/// How sums scale what samples are off: alike, or each by itself. A length is off by no more than
/// its derivatives together.
void take_gains(const SmallVector<Neighbourhood>& passes, bool of_length, Error& error) {
    Error together{.gain = 0, .noise_gain = 0};
    for (const Neighbourhood& pass : passes) {
        if (!pass.of_sum()) continue;
        double sum = 0, square = 0;
        for (const double weight : pass.weights)
            if (pass.counts(weight)) sum += weight, square += weight * weight;
        const double gain = std::abs(pass.scale * sum),
                     noise_gain = std::abs(pass.scale) * std::sqrt(square);
        error.gain *= gain;
        error.noise_gain *= noise_gain;
        together.gain = std::hypot(together.gain, gain);
        together.noise_gain = std::hypot(together.noise_gain, noise_gain);
    }
    if (of_length) error.gain = together.gain, error.noise_gain = together.noise_gain;
}

Error error(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask) {
    if (const auto measured = measured_error(algorithm, offer, ask.scene)) return *measured;
    const Stages stages(offer.from, ask);
    Error error;
    error.copies = only_copies(stages.passes, stages.filtering);
    take_gains(stages.passes, stages.is_gradient(), error);
    for (std::size_t i = 0; i < stages.passes.size(); ++i) {
        const PassAsk about = stages.ask(i, offer.with);
        error.noise = std::hypot(error.noise, rounding_noise(about));
        if (!algorithm.error) continue;
        const Error added = algorithm.error(about);
        error.known = error.known && added.known;
        error.bias += added.bias;
        error.noise = std::hypot(error.noise, added.noise);
    }
    if (stages.filtering.op == FilterOp::tophat && !is_integer(offer.from.type))
        error.noise = std::hypot(error.noise, unit_of(offer.to.type) * largest_of(ask.scene));
    // Lengths of f64 derivatives are rounded to f32.
    if (stages.is_gradient() && stages.result().type == Type::f32)
        for (const Neighbourhood& pass : stages.passes)
            error.noise =
                std::hypot(error.noise, 0x1p-25 * std::abs(pass.scale) * pass.sum_of_magnitudes() *
                                            largest_of(ask.scene));
    error.copies = error.copies && error.known;
    return error;
}

/// The value of number i.
double value_at(const Data& data, std::int64_t i) {
    if (data.what.type == Type::f16)
        return data.what.values(double(kernels::float_of_half(data.as<std::uint16_t>()[i])));
    return with_type(data.what.type, [&](auto type) {
        return data.what.values(static_cast<double>(data.as<decltype(type)>()[i]));
    });
}

/// Fills all numbers of some data by a function of their place.
template <class Value>
void fill(Data& out, const Context& context, const Value& value) {
    const std::int64_t n = out.what.samples() * out.what.channels;
    constexpr std::int64_t kGrain = 1 << 16;
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, kGrain), [&](const auto& part) {
        if (context.stopped()) return;
        with_type(out.what.type, [&](auto type) {
            using T = decltype(type);
            T* to = out.as<T>();
            for (std::int64_t i = part.begin(); i < part.end(); ++i)
                to[i] = static_cast<T>(value(i));
        });
    });
    context.poll();
}

/// Whether samples are other than 0; NaN is no number.
Data mask_in(const Data& in, const Representation& what, const Context& context) {
    Data mask = Data::make(what, context.memory);
    fill(mask, context, [&](std::int64_t i) {
        const double value = value_at(in, i);
        return value != 0 && !std::isnan(value) ? 1 : 0;
    });
    return mask;
}

/// What the passes made becomes the result of a top hat or a gradient.
void finish(const Stages& stages, const Data& in, const SmallVector<Data>& made, Data& out,
            const Context& context) {
    if (!stages.is_gradient()) {
        const Data& opened = made.back();
        fill(out, context, [&](std::int64_t i) { return value_at(in, i) - value_at(opened, i); });
        return;
    }
    fill(out, context, [&](std::int64_t i) {
        double squares = 0;
        for (const Data& derivative : made) {
            const double along = value_at(derivative, i);
            squares += along * along;
        }
        return std::sqrt(squares);
    });
}

void run(const FilterAlgorithm& algorithm, const Offer& offer, const Ask& ask, const Data& in,
         Data& out, Context& context) {
    const Stages stages(offer.from, ask);
    const SmallVector<Neighbourhood>& passes = stages.passes;
    std::optional<Data> mask;
    if (is_binary(stages.filtering.op)) mask = mask_in(in, stages.made[0], context);
    const Data& first = mask ? *mask : in;
    const bool finite = mask || ask.scene.non_finite == 0;
    SmallVector<Data> between;
    between.reserve(passes.size());
    for (std::size_t i = 0; i < passes.size(); ++i) {
        const Data& from = i == 0 || stages.is_gradient() ? first : between.back();
        const bool last = i + 1 == passes.size() && !stages.ends_in_values();
        if (!last) between.push_back(Data::make(stages.made_by(i), context.memory));
        Data& to = last ? out : between.back();
        kernels::Grid grid = kernels::grid_of(from);
        // Stored numbers are ordered as they are; those of masks get their value in the end.
        if ((mask || to.what.values == from.what.values) && !passes[i].of_sum()) grid.values = {};
        algorithm.run({passes[i], grid, to, offer.with, context, finite}, stages.made_by(i).type);
        if (stages.adjoins(i)) adjoin(passes[i], first, from, to, context);
    }
    if (stages.ends_in_values()) finish(stages, in, between, out, context);
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
    edge.trials = algorithm.trials;
    edge.factors = algorithm.factors;
    return edge;
}

namespace {

std::vector<Trial> trials_of(const Trial::Neighbourhood& of) {
    std::vector<Trial> all;
    for (const char* input : {"phantom:zone-plate:900", "phantom:gaussians:80"})
        for (const Type type : {Type::u8, Type::f32})
            all.push_back({.job = job_to("object/filtered"),
                           .input = input,
                           .type = type,
                           .filter = of,
                           .order = kFilterTrials});
    return all;
}

std::vector<Trial> trials_of(std::initializer_list<Trial::Neighbourhood> several) {
    std::vector<Trial> all;
    for (const Trial::Neighbourhood& of : several) join(all, trials_of(of));
    return all;
}

}  // namespace

std::vector<Trial> sum_trials() {
    return trials_of({{FilterOp::convolve, Stencil::Shape::gauss, 1},
                      {FilterOp::convolve, Stencil::Shape::ball, 4},
                      {FilterOp::convolve, Stencil::Shape::box, 3}});
}

std::vector<Trial> extreme_trials() {
    return trials_of(
        {{FilterOp::dilate, Stencil::Shape::ball, 4}, {FilterOp::dilate, Stencil::Shape::box, 4}});
}

std::vector<Trial> median_trials() {
    return trials_of({{FilterOp::median, Stencil::Shape::ball, 2}});
}

std::vector<Trial> sum_and_extreme_trials() {
    std::vector<Trial> all = sum_trials();
    join(all, extreme_trials());
    return all;
}

}  // namespace edgewise
