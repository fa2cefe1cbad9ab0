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

/// A grid that holds the samples before and behind each shear. Along axes that shears move there is
/// room around them.
struct ShearedBox {
    std::array<std::int64_t, 3> low{};           // place of the first sample of the grid
    Extent period;                               // of the grid; it repeats
    std::array<std::int64_t, 3> first{}, end{};  // the input's samples in it, before any shear

    ShearedBox(const ShearChain& chain, const Extent& input) {
        constexpr double kRoom = 8;
        std::array<double, 3> least, most;
        least.fill(INFINITY), most.fill(-INFINITY);
        std::array<bool, 3> moves{};
        const auto with = [&](const std::array<double, 3>& y) {
            for (std::size_t i = 0; i < 3; ++i)
                least[i] = std::min(least[i], y[i]), most[i] = std::max(most[i], y[i]);
        };
        for (int corner = 0; corner < 8; ++corner) {
            const std::array<double, 3> x{corner & 1 ? double(input.x - 1) : 0.0,
                                          corner & 2 ? double(input.y - 1) : 0.0,
                                          corner & 4 ? double(input.z - 1) : 0.0};
            std::array<double, 3> y = kernels::permuted(chain, x);
            for (std::size_t i = 0; i < 3; ++i) {
                const auto at = static_cast<std::int64_t>(y[i]);
                first[i] = corner ? std::min(first[i], at) : at;
                end[i] = corner ? std::max(end[i], at + 1) : at + 1;
            }
            with(y);
            for (int k = 0; k < chain.count; ++k) {
                y[chain.shears[k].axis] += chain.shears[k].step(y);
                moves[std::size_t(chain.shears[k].axis)] = true;
                with(y);
            }
        }
        for (std::size_t i = 0; i < 3; ++i) {
            const double room = moves[i] ? kRoom : 0;
            low[i] = static_cast<std::int64_t>(std::floor(least[i] - room));
            const auto high = static_cast<std::int64_t>(std::ceil(most[i] + room));
            const std::int64_t places = high - low[i] + 1;
            period[static_cast<int>(i)] = moves[i] ? kernels::good_length(places) : places;
            first[i] -= low[i], end[i] -= low[i];
        }
    }
    /// The samples of the grid, in f64: a product of extents may overflow an integer.
    double samples() const noexcept {
        return static_cast<double>(period.x) * static_cast<double>(period.y) *
               static_cast<double>(period.z);
    }
};

/// The axes that index lines along an axis, ascending, as read_lines_at() counts them.
constexpr int inner_of(int axis) noexcept { return axis == 0 ? 1 : 0; }
constexpr int outer_of(int axis) noexcept { return axis == 2 ? 1 : 2; }

/// Why phases cannot shear so: steep shears need huge grids. Empty: they can.
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
    if (std::string reason = not_equiareal(from, ask, not_by_phases); !reason.empty())
        return Offer::no(std::move(reason));
    constexpr double kMostSamples = 0x1p40;
    for (int variant = 0; variant < ask.want.views.different(); ++variant) {
        const int view = ask.want.views.first_view(variant);
        const ShearedBox box(chain_of(from, ask.want, view), from.extent);
        if (box.samples() > kMostSamples)
            return Offer::no(fmt::format("view {}: all shears need a grid of {:.3g} samples", view,
                                         box.samples()));
    }
    return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
}

Work work_of_phase_shears(const Offer& offer, const Ask& ask, int view) {
    const ShearChain chain = chain_of(offer.from, ask.want, view);
    const ShearedBox box(chain, offer.from.extent);
    const double samples = box.samples(), own = static_cast<double>(offer.from.samples());
    Work work{.streamed = offer.from.bytes() + 2 * offer.to.bytes(),
              .workspace = (samples + own) * sizeof(float)};
    for (int k = 0; k < chain.count; ++k) {
        const std::int64_t n = box.period[chain.shears[k].axis];
        work.operations += samples / static_cast<double>(n) * PhaseLines::operations(n, n);
        work.streamed += 2 * samples * sizeof(float);
        work.scratch = std::max(work.scratch, PhaseLines::Line::bytes(n, n));
    }
    return work;
}

/// Continues lines smoothly from their last sample to the first of the next period. They lie in the
/// input along the axes after this one; the axes before it are continued already.
void continue_along(float* grid, const ShearedBox& box, int axis) {
    const Extent& n = box.period;
    const auto at = [&](int of) { return static_cast<std::size_t>(of); };
    const std::array<std::int64_t, 3> stride{1, n.x, n.x * n.y};
    const std::int64_t first = box.first[at(axis)], end = box.end[at(axis)];
    const std::int64_t gap = n[axis] - (end - first);
    const int inner = inner_of(axis), outer = outer_of(axis);
    const auto begin_of = [&](int of) { return of < axis ? 0 : box.first[at(of)]; };
    const auto end_of = [&](int of) { return of < axis ? n[of] : box.end[at(of)]; };
    tbb::parallel_for(begin_of(outer), end_of(outer), [&](std::int64_t j) {
        for (std::int64_t i = 0; i < gap; ++i) {
            const double t = static_cast<double>(i + 1) / static_cast<double>(gap + 1);
            const double share = 0.5 - 0.5 * std::cos(std::numbers::pi * t);
            const std::int64_t to = (end + i) % n[axis] * stride[at(axis)];
            for (std::int64_t k = begin_of(inner); k < end_of(inner); ++k) {
                float* line = grid + k * stride[at(inner)] + j * stride[at(outer)];
                const auto last = static_cast<double>(line[(end - 1) * stride[at(axis)]]);
                const auto next = static_cast<double>(line[first * stride[at(axis)]]);
                line[to] = static_cast<float>((1 - share) * last + share * next);
            }
        }
    });
}

/// The samples in their grid, behind the exact permutation, and their continuation.
void place_samples(const Data& in, const ShearChain& chain, const ShearedBox& box, float* grid,
                   Context& context) {
    const Extent n = in.what.extent;
    kernels::Block<float> samples(static_cast<std::size_t>(n.samples()), context.memory);
    read_as_f32(in, samples.data(), context);
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        for (std::int64_t x = 0; x < n.x; ++x) {
            const auto at =
                kernels::permuted(chain, std::array<std::int64_t, 3>{x, row % n.y, row / n.y});
            grid[at[0] - box.low[0] +
                 box.period.x * (at[1] - box.low[1] + box.period.y * (at[2] - box.low[2]))] =
                samples[static_cast<std::size_t>(x + n.x * row)];
        }
    });
    for (int axis = 0; axis < 3; ++axis) continue_along(grid, box, axis);
}

void run_phase_shears(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                      const Region& /*all*/, Context& context) {
    const ShearChain chain = chain_of(offer.from, ask.want, context.view);
    const ShearedBox box(chain, in.what.extent);
    kernels::Block<float> grid(static_cast<std::size_t>(box.period.samples()), context.memory);
    place_samples(in, chain, box, grid.data(), context);
    for (int k = 0; k < chain.count; ++k) {
        const kernels::Shear& shear = chain.shears[k];
        const auto inner = static_cast<std::size_t>(inner_of(shear.axis));
        const auto outer = static_cast<std::size_t>(outer_of(shear.axis));
        const auto first = [&](std::int64_t i, std::int64_t j) {
            std::array<double, 3> at{};
            at[inner] = static_cast<double>(i + box.low[inner]);
            at[outer] = static_cast<double>(j + box.low[outer]);
            return -shear.step(at);
        };
        read_lines_at(grid.data(), box.period, shear.axis, box.period[shear.axis], first,
                      grid.data(), context);
    }
    const Extent n = out.what.extent;
    const kernels::Affine to_input = inverse_map(offer.from, ask.want, context.view);
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t line) {
        if (context.stopped()) return;
        const std::int64_t y = line % n.y, z = line / n.y;
        const std::int64_t row = y - box.low[1], sheet = z - box.low[2];
        const bool crosses = row >= 0 && row < box.period.y && sheet >= 0 && sheet < box.period.z;
        float* to = out.at<float>(0, y, z);
        for (std::int64_t x = 0; x < n.x; ++x) {
            const std::int64_t column = x - box.low[0];
            const bool held = crosses && column >= 0 && column < box.period.x;
            to[x] = held ? grid[static_cast<std::size_t>(column + box.period.x *
                                                                      (row + box.period.y * sheet))]
                         : 0;
        }
        Region part = Region::all(n);
        part.begin[1] = y, part.end[1] = y + 1, part.begin[2] = z, part.end[2] = z + 1;
        kernels::mask_outside(to_input, in.what.extent, static_cast<float>(outside_of(ask)),
                              out.as<float>(), out.held(), part);
    });
    context.poll();
}

}  // namespace

Transition phase_shears() {
    Transition edge;
    edge.name = "warp.phase_shears";
    edge.source = "[W93] EQ 10; Unser, Thevenaz and Yaroslavsky 1995; Welling and others 2006";
    edge.joins = {{"object/scalar", "screen/scalar"}};
    edge.on_demand = true;
    edge.offer = offer_of_phase_shears;
    edge.work = work_of_phase_shears;
    edge.error = [](const Offer&, const Ask&) { return Error::unknown(); };
    edge.run = run_phase_shears;
    return edge;
}

}  // namespace edgewise
