#include "transitions/radon/radon_edge.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

std::size_t values_of(const Extent& input) noexcept {
    return static_cast<std::size_t>((input.x + 2) * (input.y + 2));
}

RadonLines lines_of(const RadonSetting& setting, const Request& want) {
    return {want.input, {want.spacing[0], want.spacing[1]}, setting};
}

const char* word_of(RadonSetting::To to) {
    return to == RadonSetting::To::hough   ? "Hough votes"
           : to == RadonSetting::To::image ? "the image of a sinogram"
                                           : "a sinogram";
}

std::string not_of_lines(const RadonAlgorithm& algorithm, const Representation& from,
                         const Request& want) {
    const RadonSetting* setting = want.setting.as<RadonSetting>();
    if (!setting) return "the request names no lines";
    const std::string because =
        setting->to == RadonSetting::To::image ? "" : algorithm.not_the_other;
    if (setting->to != algorithm.to)
        return fmt::format("asked for: {}; this makes {}{}{}", word_of(setting->to),
                           word_of(algorithm.to), because.empty() ? "" : ": ", because);
    if (from.extent != want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return "the samples no longer lie where the input has them";
    if (from.layout != Layout::linear || from.place != Place::memory)
        return "needs samples in memory, row by row";
    if (from.type == Type::c64 || from.channels != 1)
        return "lines are of one channel of real samples";
    return {};
}

Offer offer_of_lines(const RadonAlgorithm& algorithm, const Representation& from, const Ask& ask,
                     const Parameters& with) {
    if (std::string reason = not_of_lines(algorithm, from, ask.want); !reason.empty())
        return Offer::no(std::move(reason));
    const RadonSetting& setting = *ask.want.setting.as<RadonSetting>();
    const RadonLines lines = lines_of(setting, ask.want);
    if (algorithm.refused)
        if (std::string reason = algorithm.refused({setting, lines, ask.scene, with});
            !reason.empty())
            return Offer::no(std::move(reason));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "hough";
    offer.to.drop_facets();
    offer.to.extent = lines.extent();
    offer.to.type = Type::f32;
    offer.to.values = {};
    return offer;
}

Work work_of_lines(const RadonAlgorithm& algorithm, const Offer& offer, const Ask& ask) {
    const RadonSetting& setting = *ask.want.setting.as<RadonSetting>();
    const RadonLines lines = lines_of(setting, ask.want);
    Work work = algorithm.work({setting, lines, ask.scene, offer.with});
    work.workspace += RadonPlane::bytes(lines.input);
    work.streamed += offer.from.bytes() + offer.to.bytes() +
                     RadonPlane::bytes(lines.input) * static_cast<double>(lines.input.z);
    return work;
}

}  // namespace

double RadonAsk::magnitude() const noexcept {
    return std::max(std::abs(scene.low), std::abs(scene.high));
}

double RadonAsk::rounding() const noexcept {
    // RMS of rounding to f32, as a part of the value, over all mantissas.
    constexpr double kRounded = 0.425;
    const std::optional<double> rms = scene.measured(kResultRms);
    if (!rms) return 0x1p-24 * magnitude();
    return kRounded * 0x1p-24 * *rms / lines.diagonal;
}

double RadonAsk::visits() const noexcept {
    return static_cast<double>(lines.input.samples()) * lines.angles;
}

RadonPlane::RadonPlane(const Data& in, std::int64_t slice, std::pmr::memory_resource* memory)
    : step_(in.what.extent.x + 2),
      block_(values_of(in.what.extent), memory),
      samples_(block_.data() + step_ + 1) {
    const Extent n = in.what.extent;
    const kernels::Grid grid = kernels::grid_of(in);
    const kernels::ScalarLoad load = kernels::scalar_load(grid.type);
    const bool as_stored = grid.values.identity();
    std::fill_n(block_.data(), values_of(n), 0.0f);
    for (std::int64_t y = 0; y < n.y; ++y) {
        const std::int64_t from = y * grid.row_step() + slice * grid.slice_step();
        float* to = block_.data() + (y + 1) * step_ + 1;
        for (std::int64_t x = 0; x < n.x; ++x) {
            const float stored = load(grid.samples, from + x);
            to[x] = as_stored ? stored : static_cast<float>(grid.values(double(stored)));
            finite_ = finite_ && std::isfinite(to[x]);
        }
    }
}

double RadonPlane::bytes(const Extent& input) noexcept {
    return static_cast<double>(values_of(input)) * sizeof(float);
}

void for_each_angle(const RadonRun& run, const std::function<void(int k)>& body) {
    tbb::parallel_for(0, run.lines.angles, [&](int k) {
        if (!run.context.stopped()) body(k);
    });
    run.context.poll();
}

Transition radon_edge(const RadonAlgorithm& algorithm) {
    Transition edge;
    edge.name = algorithm.name;
    edge.source = algorithm.source;
    edge.joins = {{"object/scalar", "hough/scalar"}};
    edge.parameters = algorithm.parameters;
    edge.offer = [algorithm](const Representation& from, const Ask& ask, const Parameters& with) {
        return offer_of_lines(algorithm, from, ask, with);
    };
    edge.work = [algorithm](const Offer& offer, const Ask& ask, int /*view*/) {
        return work_of_lines(algorithm, offer, ask);
    };
    edge.error = [algorithm](const Offer& offer, const Ask& ask) {
        // What running it gave (scene/measured_results.hpp).
        const Type type = offer.from.type;
        const bool is_as_read = ask.scene.measured(kResultType) == static_cast<double>(type);
        const FactName run = is_as_read ? fact_of_runs(algorithm.name, offer.with)
                                        : fact_of_runs(algorithm.name, offer.with, type);
        if (const std::optional<double> noise = ask.scene.measured(run))
            return is_as_read ? Error{.noise = *noise}
                              : Error{.gain = 0, .noise_gain = 0, .noise = *noise};
        const RadonSetting& setting = *ask.want.setting.as<RadonSetting>();
        return algorithm.error({setting, lines_of(setting, ask.want), ask.scene, offer.with});
    };
    if (algorithm.count)
        edge.count = [algorithm](const Data& input, const Request& want,
                                 std::map<std::string, double>& facts,
                                 std::pmr::memory_resource* /*memory*/) {
            const RadonSetting* setting = want.setting.as<RadonSetting>();
            if (setting && setting->to == algorithm.to) algorithm.count(input, *setting, facts);
        };
    edge.run = [algorithm](const Offer& offer, const Ask& ask, const Data& in, Data& out,
                           const Region& /*all*/, Context& context) {
        const RadonSetting& setting = *ask.want.setting.as<RadonSetting>();
        const RadonLines lines = lines_of(setting, ask.want);
        for (std::int64_t slice = 0; slice < lines.input.z; ++slice) {
            context.poll();
            const RadonPlane plane(in, slice, context.memory);
            algorithm.run({setting, lines, plane, out.at<float>(0, 0, slice), offer.with, context});
        }
    };
    edge.trials = algorithm.trials;
    edge.factors = algorithm.factors;
    return edge;
}

std::vector<Trial> line_trials(RadonSetting::To to) {
    std::vector<Trial> all;
    const auto lines = [&](const char* input, Type type, int angles) {
        // Of the plate half of the samples vote.
        all.push_back({.job = radon_job(),
                       .input = input,
                       .type = type,
                       .radon = RadonSetting{.angles = angles, .to = to, .threshold = 0.5},
                       .order = kLineTrials});
    };
    lines("phantom:zone-plate:256", Type::f32, 30);
    lines("phantom:zone-plate:500", Type::u8, 8);
    lines("phantom:shepp-logan:64", Type::u8, 6);
    return all;
}

}  // namespace edgewise
