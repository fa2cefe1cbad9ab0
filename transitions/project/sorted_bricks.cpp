#include "transitions/project/sorted_bricks.hpp"

#include <algorithm>
#include <any>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <span>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <vector>

#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::SortedBrick;

double bytes_of_bricks(const Extent& volume) {
    return static_cast<double>(kernels::sorted_bricks_in(volume).samples()) * sizeof(SortedBrick);
}

bool is_of_splines(const Representation& what) { return what.content == "coefficients"; }

Offer offer_bricks(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_sorting(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = is_of_splines(from) ? kSortedCoefficients : kSortedSamples;
    offer.to.facets.insert(sorted_facet_of(ask.want, from.values));
    offer.to.facet_bytes += bytes_of_bricks(from.extent);
    return offer;
}

Work work_of_bricks(const Offer& offer, const Ask&, int) {
    // As for the caster's bricks, but for a sort; a brick reads 9 rows of 9 for 8 of 8.
    constexpr double kAgain = 81.0 / 64;
    const double bricks = bytes_of_bricks(offer.from.extent) / sizeof(SortedBrick);
    const double each = 4 + 6 * static_cast<double>(bytes_of(offer.from.type));
    return {.operations = kAgain * each * static_cast<double>(offer.from.samples()) +
                          12 * bricks * std::log2(bricks + 1),
            .streamed = kAgain * offer.from.bytes() + 4 * bytes_of_bricks(offer.from.extent)};
}

Error error_of_bricks(const Offer&, const Ask&) { return {.copies = true}; }

void run_bricks(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
                Context& context) {
    const kernels::Grid volume = rule_grid(in, ask.want);
    const Extent n = kernels::sorted_bricks_in(volume.extent);
    const auto count = static_cast<std::size_t>(n.samples());
    auto made = std::make_shared<BricksBeside>();
    made->room = Array(count * sizeof(SortedBrick), context.memory);
    const std::span<SortedBrick> bricks{static_cast<SortedBrick*>(made->room.data()), count};
    const kernels::Reach reach =
        is_of_splines(in.what) ? kernels::Reach{1, 2} : kernels::Reach{0, 1};
    std::vector<float> least(static_cast<std::size_t>(n.z));
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t layer) {
        if (!context.stopped())
            least[static_cast<std::size_t>(layer)] =
                kernels::bound_bricks(volume, reach, layer, layer + 1, bricks, context.memory);
    });
    context.poll();
    // Values between finite samples are no less than the least of these. Splines round.
    const bool finite =
        is_integer(volume.type) || (volume.type == Type::f32 && ask.scene.non_finite == 0);
    const float floor = finite && reach.before == 0 ? *std::min_element(least.begin(), least.end())
                                                    : -std::numeric_limits<float>::infinity();
    // Places decide ties, so that the order is one.
    const auto end =
        std::partition(bricks.begin(), bricks.end(),
                       [floor](const SortedBrick& brick) { return brick.bound > floor; });
    tbb::parallel_sort(bricks.begin(), end, [](const SortedBrick& a, const SortedBrick& b) {
        return a.bound != b.bound ? a.bound > b.bound : a.place < b.place;
    });
    made->sorted = {
        .bricks = {bricks.begin(), end}, .floor = floor, .extent = n, .volume = volume.extent};
    const std::string facet = sorted_facet_of(ask.want, offer.from.values);
    out.facets[facet] = std::shared_ptr<const BricksBeside>(made);
}

}  // namespace

std::string sorted_facet_of(const Request& want, const ValueMap& values) {
    return kSortedFacets[(values.slope < 0) != want.mode->negated ? 1 : 0];
}

std::optional<double> share_needed(const Scene& scene) {
    const auto taken = scene.fact(kCastBricks), all = scene.fact(kCastAll);
    if (!taken || !all || !(*all > 0)) return {};
    // The caster takes a sixteenth first, to know early what cannot matter.
    constexpr double kFirst = 1.0 / 16;
    return std::clamp(*taken / *all - kFirst, 0.0, 1.0);
}

std::string no_sorting(const Representation& from, const Ask& ask) {
    const ModeTraits& mode = *ask.want.mode;
    if (std::string reason = no_picture(from, ask); !reason.empty()) return reason;
    if (mode.combine != Combine::max)
        return fmt::format("mode {} needs all samples of a ray, not the greatest", mode.name);
    if (ask.want.eye) return "the eye is at a finite distance: rays are not parallel";
    if (is_spread(from)) return "over ranks: each would sort its own bricks";
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    if (const std::int64_t bricks = kernels::sorted_bricks_in(from.extent).samples();
        bricks > kMost)
        return fmt::format("{} bricks; places of bricks have 31 bits", bricks);
    // Dense data, of which rays need much in any order, are cast in less time: packets that come
    // back to each brick take a third longer for a cell, and 1.0 to 1.4 times as many.
    constexpr double kMostNeeded = 0.3;
    if (const auto needed = share_needed(ask.scene); needed && *needed > kMostNeeded)
        return fmt::format(
            "rays need {:.0f} % of their samples in any order; this pays below {:.0f} %",
            100 * *needed, 100 * kMostNeeded);
    return {};
}

std::shared_ptr<const BricksBeside> sorted_bricks_of(const Data& data, const std::string& facet) {
    return std::any_cast<std::shared_ptr<const BricksBeside>>(data.facets.at(facet));
}

Transition sorted_bricks() {
    Transition edge;
    edge.name = "project.sorted_bricks";
    edge.source = "Mroz, Hauser, Groeller 2000";
    for (const char* facet : kSortedFacets) {
        edge.joins.emplace_back("object/scalar",
                                fmt::format("object/{}+{}", kSortedSamples, facet));
        edge.joins.emplace_back("object/coefficients",
                                fmt::format("object/{}+{}", kSortedCoefficients, facet));
    }
    edge.attaches = true;
    edge.offer = offer_bricks;
    edge.work = work_of_bricks;
    edge.shared_counts = {measure_casting};
    edge.error = error_of_bricks;
    edge.run = run_bricks;
    edge.trials = [] { return picture_trials(Combine::max); };
    return edge;
}

}  // namespace edgewise
