#include "transitions/warp/phase_shears.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <numbers>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/shear.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"
#include "transitions/warp/phase_lines.hpp"

namespace edgewise {
namespace {

using kernels::ShearChain;

/// A grid that holds the image before and behind each shear, with room around it.
struct ShearedBox {
    std::array<std::int64_t, 2> low{};           // place of the first sample of the grid
    Extent period;                               // of the grid; it repeats
    std::array<std::int64_t, 2> first{}, end{};  // the image's own samples in it, before any shear

    ShearedBox(const ShearChain& chain, const Extent& input) {
        constexpr double kRoom = 8;
        std::array<double, 2> least{INFINITY, INFINITY}, most{-INFINITY, -INFINITY};
        const auto with = [&](const std::array<double, 3>& y) {
            for (std::size_t i = 0; i < 2; ++i)
                least[i] = std::min(least[i], y[i]), most[i] = std::max(most[i], y[i]);
        };
        for (int corner = 0; corner < 4; ++corner) {
            const std::array<double, 3> x{corner & 1 ? double(input.x - 1) : 0.0,
                                          corner & 2 ? double(input.y - 1) : 0.0, 0};
            std::array<double, 3> y = kernels::permuted(chain, x);
            for (std::size_t i = 0; i < 2; ++i) {
                const auto at = static_cast<std::int64_t>(y[i]);
                first[i] = corner ? std::min(first[i], at) : at;
                end[i] = corner ? std::max(end[i], at + 1) : at + 1;
            }
            with(y);
            for (int k = 0; k < chain.count; ++k) {
                y[chain.shears[k].axis] += chain.shears[k].step(y);
                with(y);
            }
        }
        for (std::size_t i = 0; i < 2; ++i) {
            low[i] = static_cast<std::int64_t>(std::floor(least[i] - kRoom));
            const auto high = static_cast<std::int64_t>(std::ceil(most[i] + kRoom));
            period[static_cast<int>(i)] = kernels::good_length(high - low[i] + 1);
            first[i] -= low[i], end[i] -= low[i];
        }
    }
};

/// Shears that are steep need huge grids.
std::string not_by_phases(int view, const ShearChain& chain) {
    constexpr double kSteepest = 8;
    for (int k = 0; k < chain.count; ++k)
        for (const double by : chain.shears[k].by)
            if (std::abs(by) > kSteepest)
                return fmt::format("view {}: a shear by {:.3g} samples a line (at most {})", view,
                                   by, kSteepest);
    return {};
}

Offer offer_of_phase_shears(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_phases(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (from.axes != 2) return Offer::no("three shears turn images; this is a volume");
    if (std::string reason = not_equiareal(from, ask, not_by_phases); !reason.empty())
        return Offer::no(std::move(reason));
    return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
}

Work work_of_phase_shears(const Offer& offer, const Ask& ask, int view) {
    const ShearChain chain = chain_of(offer.from, ask.want, view);
    const ShearedBox box(chain, offer.from.extent);
    const auto samples = static_cast<double>(box.period.samples());
    Work work{.streamed = offer.from.bytes() + 2 * offer.to.bytes(),
              .workspace = 2 * samples * sizeof(float)};
    for (int k = 0; k < chain.count; ++k) {
        const std::int64_t n = box.period[chain.shears[k].axis];
        work.operations += samples / static_cast<double>(n) * PhaseLines::operations(n, n);
        work.streamed += 2 * samples * sizeof(float);
        work.scratch = std::max(work.scratch, PhaseLines::Line::bytes(n, n));
    }
    return work;
}

/// From the last sample smoothly to the first of the next period.
void continue_line(float* line, std::int64_t stride, std::int64_t first, std::int64_t end,
                   std::int64_t period) {
    const std::int64_t gap = period - (end - first);
    const float from = line[(end - 1) * stride], to = line[first * stride];
    for (std::int64_t i = 0; i < gap; ++i) {
        const double t = static_cast<double>(i + 1) / static_cast<double>(gap + 1);
        const double share = 0.5 - 0.5 * std::cos(std::numbers::pi * t);
        line[(end + i) % period * stride] =
            static_cast<float>((1 - share) * from + share * static_cast<double>(to));
    }
}

/// The image in its grid, behind the exact permutation, and its continuation.
void place_image(const Data& in, const ShearChain& chain, const ShearedBox& box, float* grid,
                 Context& context) {
    const Extent n = in.what.extent;
    kernels::Block<float> samples(static_cast<std::size_t>(n.samples()), context.memory);
    read_as_f32(in, samples.data(), context);
    for (std::int64_t y = 0; y < n.y; ++y)
        for (std::int64_t x = 0; x < n.x; ++x) {
            const auto at = kernels::permuted(chain, std::array<std::int64_t, 3>{x, y, 0});
            grid[at[0] - box.low[0] + box.period.x * (at[1] - box.low[1])] =
                samples[static_cast<std::size_t>(x + n.x * y)];
        }
    for (std::int64_t y = box.first[1]; y < box.end[1]; ++y)
        continue_line(grid + box.period.x * y, 1, box.first[0], box.end[0], box.period.x);
    for (std::int64_t x = 0; x < box.period.x; ++x)
        continue_line(grid + x, box.period.x, box.first[1], box.end[1], box.period.y);
}

void run_phase_shears(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                      const Region& /*all*/, Context& context) {
    const ShearChain chain = chain_of(offer.from, ask.want, context.view);
    const ShearedBox box(chain, in.what.extent);
    const auto count = static_cast<std::size_t>(box.period.samples());
    auto now = std::make_unique<kernels::Block<float>>(count, context.memory);
    place_image(in, chain, box, now->data(), context);
    auto next = std::make_unique<kernels::Block<float>>(count, context.memory);
    for (int k = 0; k < chain.count; ++k) {
        const kernels::Shear& shear = chain.shears[k];
        const int other = 1 - shear.axis;
        // The other index that read_lines_at counts by is z, of which there is one.
        const auto first = [&](std::int64_t line, std::int64_t) {
            std::array<double, 3> at{};
            at[static_cast<std::size_t>(other)] =
                static_cast<double>(line + box.low[static_cast<std::size_t>(other)]);
            return -shear.step(at);
        };
        read_lines_at(now->data(), box.period, shear.axis, box.period[shear.axis], first,
                      next->data(), context);
        std::swap(now, next);
    }
    const Extent n = out.what.extent;
    const kernels::Affine to_input = inverse_map(offer.from, ask.want, context.view);
    tbb::parallel_for(std::int64_t{0}, n.y, [&](std::int64_t y) {
        if (context.stopped()) return;
        const std::int64_t row = y - box.low[1];
        float* to = out.at<float>(0, y, 0);
        for (std::int64_t x = 0; x < n.x; ++x) {
            const std::int64_t column = x - box.low[0];
            const bool held =
                row >= 0 && row < box.period.y && column >= 0 && column < box.period.x;
            to[x] = held ? (*now)[static_cast<std::size_t>(column + box.period.x * row)] : 0;
        }
        Region part = Region::all(n);
        part.begin[1] = y, part.end[1] = y + 1;
        kernels::mask_outside(to_input, in.what.extent, static_cast<float>(outside_of(ask)),
                              out.as<float>(), out.held(), part);
    });
    context.poll();
}

}  // namespace

Transition phase_shears() {
    Transition edge;
    edge.name = "warp.phase_shears";
    edge.source = "[W93] EQ 10; Unser, Thevenaz and Yaroslavsky 1995";
    edge.joins = {{"object/scalar", "screen/scalar"}};
    edge.on_demand = true;
    edge.offer = offer_of_phase_shears;
    edge.work = work_of_phase_shears;
    edge.error = [](const Offer&, const Ask&) { return Error::unknown(); };
    edge.run = run_phase_shears;
    return edge;
}

}  // namespace edgewise
