#include "transitions/store/octree.hpp"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/range.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/largest_opacity.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

Offer offer_octree(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays()) return Offer::no("the result is a volume, not a picture");
    if (from.axes != 3) return Offer::no("an image has no depth to look through");
    if (from.channels != 1)
        return Offer::no(fmt::format("{} channels; rays combine one", from.channels));
    if (from.type == Type::c64) return Offer::no("complex samples have no mean along a ray");
    if (ask.want.field == Field::nearest) return Offer::no("labels have no mean");
    if (!is_whole(from)) return Offer::no("needs all samples in memory, row by row");
    const double most = kernels::OctreeBuilder::most_nodes(from.extent);
    if (most > std::numeric_limits<std::int32_t>::max())
        return Offer::no(fmt::format("{:.3g} nodes; places of nodes have 31 bits", most));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = kOctree;
    offer.to.facets.insert(kOctree);
    offer.to.facet_bytes += most * sizeof(kernels::OctreeNode);
    return offer;
}

Work work_octree(const Offer& offer, const Ask&, int) {
    constexpr double kAgain = 25.0 / 16;  // rows on faces of nodes
    const double samples = static_cast<double>(offer.from.samples());
    const double sums = offer.with.number("tolerance") > 0 ? 5 : 0;
    return {.operations = kAgain * (3 + sums) * samples,
            .streamed = kAgain * offer.from.bytes(),
            .workspace = kernels::OctreeBuilder::scratch(offer.from.extent)};
}

// What is drawn of the data, so that the planner knows how much of them lies in leaves and differs
// there. Facts:
//  - "octree/varied": of finest nodes the share that is not constant, and not clear throughout;
//  - "octree/differs/I": of these the I-th of 17 quantiles of the tolerance from which on one is a
//    leaf [value].

constexpr int kDrawn = 512, kQuantiles = 16;

constexpr Fact kVaried{"octree/varied"};
constexpr FactFamily kDiffers{"octree/differs"};

/// The share of places in leaves that differ, an upper estimate.
double share_in_leaves(double tolerance, const Scene& scene) {
    const auto varied = scene.fact(kVaried);
    if (!varied) return 1;
    int quantile = 0;
    while (quantile < kQuantiles && scene.fact(kDiffers(quantile)).value_or(0) <= tolerance)
        ++quantile;
    // What is rarer than three of the nodes that were drawn may have been missed.
    constexpr double kMissed = 3.0 / kDrawn;
    return std::clamp(*varied * quantile / kQuantiles + kMissed, 0.0, 1.0);
}

Error error_octree(const Offer& offer, const Ask& ask) {
    const double share = offer.with.number("tolerance");
    if (share == 0) return {.copies = true};
    const double tolerance = share * range_between(ask.scene.low, ask.scene.high);
    // A maximum is of the few places that are off most, however many are not.
    if (ask.want.mode->combine == Combine::max) return {.bias = tolerance};
    return {.bias = tolerance * std::sqrt(share_in_leaves(tolerance, ask.scene))};
}

/// A finest node of the data.
class DrawnNode {
 public:
    DrawnNode(const Data& data, const std::array<std::int64_t, 3>& node) {
        constexpr std::int64_t kSide = 1 << kernels::Octree::kShift;
        const kernels::ScalarLoad load = kernels::scalar_load(data.what.type);
        const Extent& n = data.what.extent;
        std::array<std::int64_t, 3> first{}, last{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            first[axis] = node[axis] * kSide;
            last[axis] = std::min(first[axis] + kSide, n[static_cast<int>(axis)] - 1);
        }
        const auto half_at_ends = [&](std::int64_t i, std::size_t axis) {
            return i == first[axis] || i == last[axis] ? 0.5 : 1.0;
        };
        for (std::int64_t z = first[2]; z <= last[2]; ++z)
            for (std::int64_t y = first[1]; y <= last[1]; ++y)
                for (std::int64_t x = first[0]; x <= last[0]; ++x)
                    add(load(data.samples.data(), (z * n.y + y) * n.x + x),
                        half_at_ends(x, 0) * half_at_ends(y, 1) * half_at_ends(z, 2));
    }
    bool is_constant() const { return finite_ && span_.low >= span_.high; }
    const kernels::StoredSpan& span() const { return span_; }
    /// The least tolerance of which it is a leaf [stored number].
    double differs() const {
        if (!finite_) return std::numeric_limits<double>::infinity();
        const double off = sum_ / weight_, mean = origin_ + off;
        const double variance = std::max(0.0, squares_ / weight_ - off * off);
        return std::max({std::sqrt(variance),
                         (span_.high - mean) / kernels::OctreeBuilder::kFarthest,
                         (mean - span_.low) / kernels::OctreeBuilder::kFarthest});
    }

 private:
    void add(float value, double weight) {
        if (!std::isfinite(value)) {
            finite_ = false;
            return;
        }
        if (span_.empty()) origin_ = static_cast<double>(value);
        span_ = {std::min(span_.low, value), std::max(span_.high, value)};
        const double off = static_cast<double>(value) - origin_;
        weight_ += weight;
        sum_ += weight * off;
        squares_ += weight * off * off;
    }

    kernels::StoredSpan span_;
    bool finite_ = true;
    double origin_ = 0, weight_ = 0, sum_ = 0, squares_ = 0;
};

/// The optics of a request for stored numbers; null: it has none.
std::optional<kernels::Optics> optics_for(const Request& want, const ValueMap& values) {
    if (!want.mode->takes_transfer || want.transfer.points.empty()) return {};
    std::vector<kernels::OpticsPoint> points;
    for (const Transfer::Point& point : want.transfer.points)
        points.push_back({point.value, point.opacity, point.color});
    return kernels::optics_of(points, 1, values);
}

void count_octree(const Data& input, const Request& want, std::map<std::string, double>& facts,
                  std::pmr::memory_resource* /*memory*/) {
    const Representation& what = input.what;
    const Combine rule = want.mode->combine;
    if (!want.job->of_rays() || what.axes != 3 || what.channels != 1 || what.type == Type::c64 ||
        !(rule == Combine::sum || rule == Combine::mean || rule == Combine::over))
        return;
    const std::optional<kernels::Optics> optics = optics_for(want, what.values);
    // Spread evenly (Roberts 2018).
    constexpr std::array<double, 3> ratio = {0.8191725, 0.6710436, 0.5497005};
    std::vector<double> differs;
    for (int i = 0; i < kDrawn; ++i) {
        std::array<std::int64_t, 3> node{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t side = 1 << kernels::Octree::kShift;
            const std::int64_t nodes = (what.extent[static_cast<int>(axis)] + side - 1) / side;
            node[axis] = static_cast<std::int64_t>(std::fmod(0.5 + ratio[axis] * (i + 1), 1.0) *
                                                   static_cast<double>(nodes));
        }
        const DrawnNode drawn(input, node);
        if (drawn.is_constant()) continue;
        // What is clear throughout is as clear at its mean.
        if (optics && kernels::largest_opacity(*optics, drawn.span()) == 0) continue;
        differs.push_back(std::abs(what.values.slope) * drawn.differs());
    }
    facts[kVaried] = static_cast<double>(differs.size()) / kDrawn;
    std::sort(differs.begin(), differs.end());
    for (int quantile = 0; quantile <= kQuantiles && !differs.empty(); ++quantile) {
        const double value =
            differs[(differs.size() - 1) * static_cast<std::size_t>(quantile) / kQuantiles];
        // Some do not lie in leaves whatever is tolerated.
        constexpr double kNever = std::numeric_limits<float>::max();
        facts[kDiffers(quantile)] = std::min(value, kNever);
    }
}

void run_octree(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                Context& context) {
    kernels::OctreeBuilder builder(kernels::grid_of(in), offer.with.number("tolerance"),
                                   context.memory);
    const auto in_parallel = [&](std::int64_t count, const auto& make) {
        tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t layer) {
            if (!context.stopped()) make(layer, layer + 1);
        });
        context.poll();
    };
    in_parallel(builder.extent(0).z, [&](auto begin, auto end) { builder.sum_layers(begin, end); });
    builder.find_range();
    for (int level = 0; level < builder.levels(); ++level)
        in_parallel(builder.extent(level).z,
                    [&](auto begin, auto end) { builder.join_layers(level, begin, end); });
    auto made = std::make_shared<OctreeBeside>();
    const std::size_t count = builder.count();
    made->room = Array(count * sizeof(kernels::OctreeNode), context.memory);
    made->tree = builder.write({static_cast<kernels::OctreeNode*>(made->room.data()), count});
    out.facets[kOctree] = std::shared_ptr<const OctreeBeside>(made);
}

}  // namespace

std::shared_ptr<const OctreeBeside> octree_of(const Data& data) {
    return std::any_cast<std::shared_ptr<const OctreeBeside>>(data.facets.at(kOctree));
}

Transition octree() {
    Transition edge;
    edge.name = "store.octree";
    edge.source = "Wittenbrink 1993, FIGURE 60; Levoy 1990; Laur, Hanrahan 1991";
    edge.joins = {{"object/scalar", fmt::format("object/{}+{}", kOctree, kOctree)}};
    edge.parameters = {
        {"tolerance", number(0, 1, {0, 0.01},
                             "standard deviation of a leaf at most, share of the data's range")}};
    edge.attaches = true;
    edge.on_demand =
        true;  // rays in packets with min-max bricks take less, see project.octree_cast
    edge.offer = offer_octree;
    edge.work = work_octree;
    edge.error = error_octree;
    edge.count = count_octree;
    edge.run = run_octree;
    return edge;
}

}  // namespace edgewise
