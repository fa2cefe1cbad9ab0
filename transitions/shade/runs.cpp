#include "transitions/shade/runs.hpp"

#include <algorithm>
#include <any>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::UnseenSpan;
using kernels::VisibleRuns;

std::vector<UnseenSpan> unseen_by_transfer(const Request& want, const ValueMap& values) {
    std::vector<kernels::OpticsPoint> points;
    for (const Transfer::Point& point : want.transfer.points)
        points.push_back({point.value, point.opacity, point.color});
    // Whatever the unit is: no opacity stays none.
    return kernels::unseen_of(kernels::optics_of(points, 1, values));
}

/// Values that do not reach the level.
std::vector<UnseenSpan> unseen_by_level(const Request& want, const ValueMap& values) {
    constexpr float kEnd = std::numeric_limits<float>::infinity();
    const RayRule::Setting setting{.values = values, .level = want.level()};
    const float level = setting.stored_level();
    if (values.slope < 0) return {{std::nextafter(level, kEnd), kEnd}};
    if (level == -kEnd) return {};
    return {{-kEnd, std::nextafter(level, -kEnd)}};
}

/// Whether a level is all that the mode asks of a value.
bool by_level(Mode mode) {
    return mode->takes_level && !mode->first_hit && mode->combine == Combine::other && mode->needs;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.eye) return Offer::no("the eye is at a finite distance: rays do not follow rows");
    if (std::string reason = no_runs(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "runs";
    offer.to.facet_bytes = VisibleRuns::bytes(from.extent);
    return offer;
}

Work work(const Offer& offer, const Ask& ask, int) { return work_of_runs(offer.from, ask); }

/// Samples stay as they are.
Error error(const Offer&, const Ask&) { return {.copies = true}; }

void count(const Data& input, const Request& want, std::map<std::string, double>& facts,
           std::pmr::memory_resource* memory) {
    if (!want.eye) count_runs(input, want, facts, memory);
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region&, Context& context) {
    // Of slices across the rays each copy has its own extent.
    out.what.extent = in.what.extent;
    const std::vector<UnseenSpan> unseen = unseen_of(ask.want, in.what.values);
    out.other = std::shared_ptr<const VisibleRuns>(
        std::make_shared<VisibleRuns>(made_runs(kernels::grid_of(in), unseen, context)));
}

}  // namespace

std::vector<UnseenSpan> unseen_of(const Request& want, const ValueMap& values) {
    if (want.mode->takes_transfer) return unseen_by_transfer(want, values);
    return by_level(want.mode) ? unseen_by_level(want, values) : std::vector<UnseenSpan>{};
}

std::shared_ptr<const VisibleRuns> runs_of(const Data& data) {
    return std::any_cast<std::shared_ptr<const VisibleRuns>>(data.other);
}

std::string no_runs(const Representation& from, const Ask& ask) {
    const Request& want = ask.want;
    if (!want.job->of_rays()) return "the result is a volume, not a picture";
    if (!want.mode->takes_transfer && !by_level(want.mode))
        return "no value is transparent in this mode";
    if (want.shading.on() || want.needs_gradients() || want.cue)
        return "light needs gradients across slices, which are combined one by one";
    if (!want.clips.empty()) return "the clip cuts slices, which are combined whole";
    if (!from.facets.empty()) return "something else lies beside the samples";
    if (from.axes != 3 || from.channels != 1) return "of volumes of one channel only";
    if (!is_whole(from)) return "needs all samples in memory, row by row";
    if (from.type == Type::c64) return "complex samples have no opacity";
    if (from.extent.x > VisibleRuns::kMost)
        return fmt::format("rows of {} samples; runs are counted to {}", from.extent.x,
                           VisibleRuns::kMost);
    if (unseen_of(want, from.values).empty()) return "every value may be seen";
    // What is hidden by opaque samples is left out as well, as rays count it.
    constexpr double kMost = 0.9;
    const double seen = ask.scene.fact(kRunsSeen).value_or(0);
    const double all = ask.scene.fact(kCastAll).value_or(0);
    const double taken = all > 0 ? ask.scene.fact(kCastTaken).value_or(all) / all : 1;
    if (seen > kMost && taken > kMost)
        return fmt::format("{:.0f} % of the samples are seen", 100 * seen);
    return {};
}

void count_runs(const Data& input, const Request& want, std::map<std::string, double>& facts,
                std::pmr::memory_resource* memory) {
    constexpr std::int64_t kRows = 512;
    const Scene scene;
    if (!no_runs(input.what, {want, scene}).empty()) return;
    const std::vector<UnseenSpan> unseen = unseen_of(want, input.what.values);
    const kernels::Grid volume = kernels::grid_of(input);
    const std::int64_t rows = volume.extent.y * volume.extent.z, taken = std::min(rows, kRows);
    std::int64_t runs = 0, cells = 0;
    for (std::int64_t i = 0; i < taken; ++i) {
        const std::int64_t row = (2 * i + 1) * rows / (2 * taken);
        kernels::count_row(volume, unseen, row % volume.extent.y, row / volume.extent.y, runs,
                           cells, memory);
    }
    facts[kRunsSeen] = static_cast<double>(cells) / static_cast<double>(taken * volume.extent.x);
    facts[kRunsRow] = static_cast<double>(runs) / static_cast<double>(taken);
}

Work work_of_runs(const Representation& from, const Ask& ask) {
    const auto samples = static_cast<double>(from.samples());
    const auto spans = static_cast<double>(unseen_of(ask.want, from.values).size());
    // Vectors hold the more samples the fewer bytes these have; the bits of all are looked at.
    const double share = static_cast<double>(bytes_of(from.type)) / 4;
    const double runs =
        ask.scene.fact(kRunsRow).value_or(2) * static_cast<double>(from.extent.y * from.extent.z);
    return {.operations = samples * share * (8 + 6 * spans) + 20 * runs,
            .streamed = from.bytes() + sizeof(VisibleRuns::Run) * runs};
}

VisibleRuns made_runs(const kernels::Grid& volume, std::span<const UnseenSpan> unseen,
                      Context& context) {
    VisibleRuns made(volume.extent, context.memory);
    tbb::parallel_for(std::int64_t{0}, volume.extent.z, [&](std::int64_t z) {
        if (context.stopped()) return;
        made.slices[static_cast<std::size_t>(z)] =
            kernels::visible_slice(volume, unseen, z, context.memory);
    });
    context.poll();
    return made;
}

double share_in_runs(const Ask& ask) {
    const double seen =
        ask.scene.fact(kRunsSeen).value_or(std::min(1.0, 2 * ask.scene.occupied_fraction));
    const double all = ask.scene.fact(kCastAll).value_or(0);
    if (!(all > 0)) return seen;
    return std::min(seen, ask.scene.fact(kCastBricks).value_or(all) / all);
}

Transition visible_runs() {
    Transition edge;
    edge.name = "shade.runs";
    edge.source = "Lacroute and Levoy 1994";
    edge.joins = {{"object/scalar", "object/runs"}, {"aligned/scalar", "aligned/runs"}};
    edge.attaches = true;
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.count = count;  // what casts runs counts the facts of rays that are read here
    edge.run = run;
    edge.trials = [] { return picture_trials(Combine::over); };
    edge.factors = {{"", 2}};
    return edge;
}

}  // namespace edgewise
