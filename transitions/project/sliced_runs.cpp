#include "transitions/project/sliced_runs.hpp"

#include <algorithm>
#include <any>
#include <fmt/format.h>
#include <vector>

#include "transitions/project/casting.hpp"
#include "transitions/project/shear_perspective_view.hpp"
#include "transitions/project/sliced_samples.hpp"
#include "transitions/shade/runs.hpp"

namespace edgewise {
namespace {

using kernels::UnseenSpan;
using kernels::VisibleRuns;

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.eye) return Offer::no("rays are parallel: slices of one axis are enough");
    if (std::string reason = no_runs(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (from.extent.y > VisibleRuns::kMost)
        return Offer::no(fmt::format("columns of {} samples; runs are counted to {}", from.extent.y,
                                     VisibleRuns::kMost));
    SlicedAxes axes = sliced_axes(from, ask.want);
    if (!axes.refused.empty()) return Offer::no(std::move(axes.refused));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "sliced_runs";
    offer.to.facet_bytes = axes.needed[0] ? from.bytes() : 0;
    for (int axis = 0; axis < 3; ++axis)
        if (axes.needed[static_cast<std::size_t>(axis)])
            offer.to.facet_bytes += VisibleRuns::bytes(SlicedSamples::extent_of(from.extent, axis));
    return offer;
}

Work work(const Offer& offer, const Ask& ask, int) {
    const std::array<bool, 3> needed = sliced_axes(offer.from, ask.want).needed;
    const auto axes = static_cast<double>(std::count(needed.begin(), needed.end(), true));
    Work work = work_of_runs(offer.from, ask);
    work.operations *= axes;
    work.streamed *= axes;
    // For rows along y samples are turned first.
    if (needed[0]) work.streamed += 2 * offer.from.bytes();
    return work;
}

/// Samples stay as they are.
Error error(const Offer&, const Ask&) { return {.copies = true}; }

void count(const Data& input, const Request& want, std::map<std::string, double>& facts,
           std::pmr::memory_resource* memory) {
    if (want.eye) count_runs(input, want, facts, memory);
}

void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region&, Context& context) {
    const std::vector<UnseenSpan> unseen = unseen_of(ask.want, in.what.values);
    const std::array<bool, 3> needed = sliced_axes(in.what, ask.want).needed;
    auto all = std::make_shared<RunsOfAxes>();
    for (std::size_t axis = 0; axis < needed.size(); ++axis) {
        if (!needed[axis]) continue;
        const SlicedSamples samples(in, ask.want, static_cast<int>(axis), context);
        (*all)[axis] = std::make_shared<SlicedRuns>(
            SlicedRuns{made_runs(samples.all(), unseen, context), samples.turned().shared()});
    }
    out.other = std::shared_ptr<const RunsOfAxes>(all);
}

}  // namespace

std::shared_ptr<const RunsOfAxes> runs_of_axes(const Data& data) {
    return std::any_cast<std::shared_ptr<const RunsOfAxes>>(data.other);
}

Transition sliced_runs() {
    Transition edge;
    edge.name = "project.sliced_runs";
    edge.source = "Lacroute and Levoy 1994";
    edge.joins = {{"object/scalar", "object/sliced_runs"}};
    edge.attaches = true;
    edge.offer = offer;
    edge.work = work;
    edge.shared_counts = {measure_casting};
    edge.error = error;
    edge.count = count;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
