#include "transitions/store/reduce.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

int level_of(const Parameters& with) { return std::stoi(with.word("level")); }

Domain levels(std::vector<Value> tried) {
    std::vector<std::string> words;
    for (int level = 1; level <= kLevels; ++level) words.push_back(std::to_string(level));
    return one_of(std::move(words), std::move(tried),
                  "cells are 2^level times the smallest spacing wide");
}

ReducedGrid grid_of(const Offer& offer, const Request& want) {
    return reduced_grid(offer.from.extent, want.spacing, level_of(offer.with));
}

/// Why no means are made of the samples; empty: they are.
std::string refusal(const Representation& from, const Ask& ask) {
    const Request& want = ask.want;
    if (!want.job->of_rays()) return "values at points are asked for, which no mean is";
    if (from.axes != 3) return "an image has no depth to look through";
    if (want.field == Field::nearest) return "labels have no mean";
    if (!is_whole(from)) return "needs all samples in memory, row by row";
    if (from.extent != want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return "the samples no longer lie where the input has them";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} samples are not finite, and so would be their cells",
                           ask.scene.non_finite);
    return {};
}

Offer offer_of(const Representation& from, const Ask& ask, const Parameters& with) {
    const int level = level_of(with);
    ReducedGrid grid = reduced_grid(from.extent, ask.want.spacing, level);
    if (grid.extent == from.extent)
        return Offer::no(fmt::format("no axis has two samples in a cell of level {}", level));
    Representation to = from;
    to.extent = grid.extent;
    to.placed = Placement(Mat4(grid.map * from.placed.at(0).matrix()));
    to.drop_facets();
    return {.from = from, .to = std::move(to), .with = with};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = refusal(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (from.channels != 1)
        return Offer::no(fmt::format("{} channels; rays combine one", from.channels));
    if (from.type == Type::c64) return Offer::no("complex samples have no depth to look through");
    Offer made = offer_of(from, ask, with);
    if (!made.refused.empty()) return made;
    made.to.space = level_space(level_of(with));
    made.to.type = Type::f32;
    made.to.values = {};
    return made;
}

Work work(const Offer& offer, const Ask& ask, int) {
    const ReducedGrid grid = grid_of(offer, ask.want);
    const auto n = [](std::int64_t count) { return static_cast<double>(count); };
    const Extent &from = offer.from.extent, &to = offer.to.extent;
    const double along_z = n(from.x) * n(from.y) * 2 * grid.axes[2].taps;
    const double along_y = n(from.x) * n(to.y) * 2 * grid.axes[1].taps;
    const double along_x = n(to.x) * n(to.y) * (2 * grid.axes[0].taps + 2);  // and the value map
    return {.operations = n(to.z) * (along_z + along_y + along_x),
            .streamed = offer.from.bytes() + offer.to.bytes(),
            .scratch = (n(from.y) + 1) * n(from.x) * sizeof(float)};
}

Error error(const Offer& offer, const Ask& ask) {
    // f32 rounds weights and the sums along three axes, of stored numbers.
    const double greatest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high)) +
                            std::abs(offer.from.values.offset);
    return {.noise = 0x1p-22 * greatest};
}

Partition parts(const Offer& offer, const Ask& ask) {
    constexpr std::int64_t kSlices = 4;
    return {.kind = Partition::output,
            .leaf = {offer.to.extent.x, offer.to.extent.y, kSlices},
            .reads = [offer, want = ask.want](const Region& out, int) {
                const kernels::Grid grid{.extent = offer.from.extent, .values = {}};
                return kernels::Scaling(grid, grid_of(offer, want).axes).reads(out);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const kernels::Scaling by(kernels::grid_of(in), grid_of(offer, ask.want).axes);
    const Extent held = out.held().extent();
    tbb::parallel_for(region.begin[2], region.end[2], [&](std::int64_t z) {
        if (context.stopped()) return;
        Region slice = region;
        slice.begin[2] = z;
        slice.end[2] = z + 1;
        kernels::Block<float> scratch(by.scratch_floats(slice), context.memory);
        by(slice, out.at<float>(region.begin[0], region.begin[1], z), held.x, held.x * held.y,
           scratch.data());
    });
    context.poll();
}

Offer offer_colored(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = refusal(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    return offer_of(from, ask, with);
}

Work work_colored(const Offer& offer, const Ask&, int) {
    return {.operations = 60 * static_cast<double>(offer.from.samples()),
            .streamed = offer.from.bytes() + offer.to.bytes()};
}

/// The mean of a cell: depths and emitted light are added, then become opacity and light again.
std::array<float, 4> mean_of(const Data& in, const ReducedGrid& grid,
                             const std::array<std::int64_t, 3>& cell) {
    constexpr double kOpaque = 1 - 0x1p-24;  // the largest opacity whose depth is finite in f32
    std::array<double, 4> sum{};
    const auto& [along_x, along_y, along_z] = grid.axes;
    for (int k = 0; k < along_z.taps; ++k)
        for (int j = 0; j < along_y.taps; ++j)
            for (int i = 0; i < along_x.taps; ++i) {
                const auto a = static_cast<std::size_t>(cell[0] * along_x.taps + i),
                           b = static_cast<std::size_t>(cell[1] * along_y.taps + j),
                           c = static_cast<std::size_t>(cell[2] * along_z.taps + k);
                const double weight = static_cast<double>(along_x.weight[a]) *
                                      static_cast<double>(along_y.weight[b]) *
                                      static_cast<double>(along_z.weight[c]);
                const float* at =
                    in.at<float>(along_x.sample[a], along_y.sample[b], along_z.sample[c]);
                const double opacity = std::clamp(static_cast<double>(at[3]), 0.0, kOpaque);
                if (weight == 0 || opacity == 0) continue;
                const double depth = -std::log1p(-opacity);
                for (std::size_t color = 0; color < 3; ++color)
                    sum[color] += weight * depth / opacity * static_cast<double>(at[color]);
                sum[3] += weight * depth;
            }
    const double opacity = -std::expm1(-sum[3]);
    std::array<float, 4> mean{};
    if (sum[3] == 0) return mean;
    for (std::size_t color = 0; color < 3; ++color)
        mean[color] = static_cast<float>(sum[color] / sum[3] * opacity);
    mean[3] = static_cast<float>(opacity);
    return mean;
}

void run_colored(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
                 Context& context) {
    const ReducedGrid grid = grid_of(offer, ask.want);
    const Extent& n = out.what.extent;
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        if (context.stopped()) return;
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const std::array<float, 4> mean = mean_of(in, grid, {x, y, z});
                std::copy(mean.begin(), mean.end(), out.at<float>(x, y, z));
            }
    });
    context.poll();
}

}  // namespace

std::string level_space(int level) { return "level" + std::to_string(level); }

int level_of(const std::string& space) noexcept {
    for (int level = 1; level <= kLevels; ++level)
        if (space == level_space(level)) return level;
    return 0;
}

ReducedGrid reduced_grid(const Extent& samples, const Vec3& spacing, int level) {
    ReducedGrid grid;
    const double width = std::ldexp(spacing.minCoeff(), level);
    grid.map = Mat4::Identity();
    std::array<std::int64_t, 3> cells{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<double>(samples[axis]);
        const auto at = static_cast<std::size_t>(axis);
        cells[at] =
            std::clamp<std::int64_t>(std::llround(n * spacing[axis] / width), 1, samples[axis]);
        grid.axes[at] = kernels::averaged_axis(samples[axis], cells[at]);
        const double ratio = static_cast<double>(cells[at]) / n;
        grid.map(axis, axis) = ratio;
        grid.map(axis, 3) = ratio / 2 - 0.5;
    }
    grid.extent = {cells[0], cells[1], cells[2]};
    return grid;
}

Transition reduce() {
    Transition edge;
    edge.name = "store.reduce";
    edge.source = "Williams, Pyramidal parametrics, SIGGRAPH 1983";
    for (int level = 1; level <= kLevels; ++level)
        edge.joins.emplace_back("object/scalar", level_space(level) + "/scalar");
    edge.parameters = {{"level", levels({"1", "2"})}};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] { return picture_trials(); };
    edge.factors = {{"", 2}};  // a guess: a plain loop
    return edge;
}

Transition reduce_colored() {
    Transition edge;
    edge.name = "store.reduce_colored";
    edge.source = "Kraus, Buerger, Interpolating and downsampling RGBA volume data, VMV 2008";
    edge.joins = {{"object/colored", "object/colored"}};
    edge.parameters = {{"level", levels({"1"})}};
    edge.offer = offer_colored;
    edge.work = work_colored;
    edge.on_demand = true;
    edge.run = run_colored;
    return edge;
}

}  // namespace edgewise
