#include "transitions/project/parallel_product.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/permutation.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/counts.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/pixel_spans.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"
#include "transitions/warp/permutation.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 64;  // of a cube of the screen: its samples fit a second-level cache
constexpr std::ptrdiff_t kPlane = kSide * kSide;

std::int64_t cubes_along(std::int64_t n) { return (n + kSide - 1) / kSide; }

// The two edges that it is made of, and what they would be offered.

const Transition& sends() {
    static const Transition edge = permutation_warp();
    return edge;
}
const Transition& combines() {
    static const Transition edge = combine();
    return edge;
}
Offer sent(const Offer& offer, const Request& want) {
    return {.from = offer.from, .to = screen_scalar(offer.from, want), .with = offer.with};
}
Offer combined(const Offer& offer, const Request& want) {
    return {.from = screen_scalar(offer.from, want), .to = offer.to};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (is_spread(from))
        return Offer::no("over ranks samples are sent first, and combined by another edge");
    Offer first = sends().offer(from, ask, with);
    if (!first.refused.empty()) return first;
    Offer second = combines().offer(first.to, ask, {});
    if (!second.refused.empty()) return second;
    return {.from = from, .to = std::move(second.to), .with = with};
}

/// Rows of samples that a cube looks through: those of its box in object space.
double rows_of_cube(const Representation& from, const Request& want, int view) {
    constexpr double kHalo = 4;  // the rule moves points by about one sample, at both ends
    const Mat4 to_input = residual(from, want, view).inverse();
    double rows = 1;
    for (const int axis : {1, 2}) {
        const double side = to_input.row(axis).head<3>().cwiseAbs().sum() * kSide + kHalo;
        rows *= std::min(side, static_cast<double>(from.extent[axis]) + kHalo);
    }
    return rows;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    constexpr double kRow = 60;  // operations to find what of a row lies in a cube
    const Request& want = ask.want;
    const Work warp = sends().work(sent(offer, want), ask, view);
    const Work picture = combines().work(combined(offer, want), ask, view);
    const Extent& screen = want.screen;
    const std::int64_t columns = cubes_along(screen.x) * cubes_along(screen.y);
    const auto along = static_cast<double>(cubes_along(screen.z));
    const double cubes = along * static_cast<double>(columns);
    const int planes = kernels::PixelStates::planes(want.mode->combine, want.mode->rule);
    const double states = static_cast<double>(columns * kPlane * planes) * sizeof(float);
    Work work = warp;
    work.operations += picture.operations + cubes * kRow * rows_of_cube(offer.from, want, view) +
                       3 * (along - 1) * states / sizeof(float);
    work.streamed += picture.streamed + 3 * along * states;  // cleared, made, joined
    work.scratch = (kPlane * (kSide + 2)) * sizeof(float) + 2 * kArraySlack;
    work.workspace = along * states;
    return work;
}

Error error(const Offer& offer, const Ask& ask) {
    const Error samples = sends().error(sent(offer, ask.want), ask);
    const Error rule = combines().error(combined(offer, ask.want), ask);
    return {.gain = rule.gain * samples.gain,
            .noise_gain = rule.noise_gain * samples.noise_gain,
            .bias = rule.gain * samples.bias + rule.bias,
            .noise = std::hypot(rule.noise_gain * samples.noise, rule.noise),
            .known = samples.known && rule.known};
}

/// The column of the screen behind a box of the picture.
Region column_of(Region pixels, const Request& want) {
    pixels.begin[2] = 0;
    pixels.end[2] = want.screen.z;
    return pixels;
}

Partition parts(const Offer& offer, const Ask& ask) {
    return {.kind = Partition::output,
            .leaf = offer.to.extent,
            .reads = [offer, want = ask.want](const Region& out, int view) {
                const kernels::Grid object{.extent = offer.from.extent, .values = {}};
                return kernels::PermutationWarp(object, chain_of(offer.from, want, view),
                                                send_of(offer.with), want.screen,
                                                column_of(out, want))
                    .reads();
            }};
}

/// Cubes of the screen, cut at multiples of their side, that a box of a picture needs.
class Cubes {
 public:
    Cubes(const Region& pixels, std::int64_t depth) : within_(pixels) {
        within_.begin[2] = 0;
        within_.end[2] = depth;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            first_[axis] = within_.begin[axis] / kSide;
            count_[axis] = cubes_along(within_.end[axis]) - first_[axis];
        }
    }
    std::int64_t columns() const noexcept { return count_[0] * count_[1]; }
    std::int64_t along() const noexcept { return count_[2]; }
    /// The part of a cube that is needed; `place` along the rays.
    Region box(std::int64_t column, std::int64_t place) const noexcept {
        const std::array<std::int64_t, 3> at{column % count_[0], column / count_[0], place};
        Region box;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t begin = (first_[axis] + at[axis]) * kSide;
            box.begin[axis] = std::max(begin, within_.begin[axis]);
            box.end[axis] = std::min(begin + kSide, within_.end[axis]);
        }
        return box;
    }

 private:
    Region within_;
    std::array<std::int64_t, 3> first_{}, count_{};
};

/// Whether a ray has samples in a cube.
bool met(const Region& box, const float* low, const float* high) {
    const auto first = static_cast<float>(box.begin[2]), last = static_cast<float>(box.end[2] - 1);
    const Extent size = box.extent();
    for (std::int64_t y = 0; y < size.y; ++y)
        for (std::int64_t x = 0; x < size.x; ++x) {
            const std::int64_t i = y * kSide + x;
            if (low[i] <= high[i] && low[i] <= last && high[i] >= first) return true;
        }
    return false;
}

void run_product(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                 const Region& region, Context& context) {
    const Request& want = ask.want;
    const Representation screen = screen_scalar(offer.from, want);
    const kernels::Grid object = kernels::grid_of(in);
    const kernels::ShearChain chain = chain_of(offer.from, want, context.view);
    const kernels::Optics optics = optics_of(want, screen.values);
    const kernels::Combining with = combining_of(want, screen.values, optics);
    const kernels::RayCast rays = rays_through_input(want, context.view);
    const auto outside = static_cast<float>(outside_of(ask));

    const Cubes cubes(region, want.screen.z);
    const std::int64_t along = cubes.along();
    const std::ptrdiff_t each = kernels::PixelStates::planes(with.rule, with.other) * kPlane;
    kernels::Block<float> states(
        static_cast<std::size_t>(cubes.columns() * along * each) + kArraySlack, context.memory);
    const auto states_of = [&](std::int64_t column, std::int64_t place) {
        return kernels::PixelStates{states.data() + (column * along + place) * each, kSide, kPlane};
    };

    // Subframes: samples are sent to a cube and combined there.
    tbb::parallel_for(std::int64_t{0}, cubes.columns() * along, [&](std::int64_t i) {
        if (context.stopped()) return;
        const Region box = cubes.box(i / along, i % along);
        const Extent size = box.extent();
        const kernels::PixelStates subframe = states_of(i / along, i % along);
        kernels::clear_states(with, subframe, size.x, size.y);
        kernels::Block<float> spans(2 * kPlane + kArraySlack, context.memory);
        float* const low = spans.data();
        float* const high = low + kPlane;
        fill_spans(rays, box, kSide, low, high);
        if (!met(box, low, high)) return;
        Data samples = Data::make(screen, box, context.memory);
        std::fill_n(samples.as<float>(), size.samples(), outside);
        const kernels::PermutationWarp warp(object, chain, send_of(offer.with), want.screen, box);
        warp(warp.sites(), samples.as<float>());
        kernels::combine(with, kernels::grid_of(samples), box.begin[0], box.begin[1], size.x,
                         size.y, box.begin[2], box.end[2], {low, high, kSide}, subframe);
    });
    context.poll();

    // The parallel product: neighbours along the rays, then neighbours of these; one tree whatever
    // the number of threads.
    tbb::parallel_for(std::int64_t{0}, cubes.columns(), [&](std::int64_t column) {
        const Region box = cubes.box(column, 0);
        const Extent size = box.extent();
        for (std::int64_t apart = 1; apart < along; apart *= 2)
            for (std::int64_t place = 0; place + apart < along; place += 2 * apart)
                kernels::merge_states(with, states_of(column, place),
                                      states_of(column, place + apart), size.x, size.y);
        float* const first = out.at<float>(box.begin[0], box.begin[1], 0);
        kernels::finish_states(with, states_of(column, 0), size.x, size.y, first, out.row());
        give_sign(want, first, size.x, size.y, out.row());
    });
}

}  // namespace

Transition parallel_product() {
    Transition edge;
    edge.name = "project.parallel_product";
    edge.source = "Wittenbrink 1993, 4.5, FIGURE 66 and 70 to 74, Lemma 4.1";
    edge.joins = {{"object/scalar", "screen/picture"}, {"scaled/scalar", "screen/picture"}};
    edge.parameters = sends().parameters;
    edge.laws = {Law::constant};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run_product;
    edge.trials = [] { return picture_trials(); };
    edge.factors = {{"", 2.9}, {"/filter=foh", 2.6}};  // a guess: as warp.permutation
    return edge;
}

double state_bytes(Mode mode) noexcept {
    return mode->state_numbers * static_cast<double>(sizeof(float));
}

double shadow_of_box(const Mat4& map, const Extent& extent, const Cut& cut) {
    const auto side = [&](int axis) {
        const double n = std::ceil(static_cast<double>(extent[axis]) / cut[axis]);
        return Vec3(map.topLeftCorner<3, 3>().col(axis) * n);
    };
    double area = 0;
    for (int axis = 0; axis < 3; ++axis)
        area += std::abs(side((axis + 1) % 3).cross(side((axis + 2) % 3)).z());
    return area;
}

void add_subframes(Work& work, const Offer& offer, const Ask& ask, int view) {
    constexpr double kMostMet = 17,
                     kRay = 60;  // kRay: operations to set up a ray, as project.ray_cast
    const Representation& from = offer.from;
    const int ranks = ask.want.ranks;
    const Cut cut = cut_of(from.layout, from.extent, 3, ranks);
    const auto pixels = static_cast<double>(offer.to.samples());
    const double subframe =
        std::min(pixels, shadow_of_box(residual(from, ask.want, view), from.extent, cut));
    const double states = state_bytes(ask.want.mode), boxes = ranks;
    const double halo =
        halo_samples(from.extent, cut, 1) * from.bytes() / static_cast<double>(from.samples());
    work.operations += kRay * std::max(0.0, subframe * boxes - pixels) + 2 * subframe * boxes;
    work.workspace = work.workspace / boxes + halo + subframe * states;
    for (const int n : cut) work.traffic.messages += n > 1 ? 2 : 0;  // halos
    work.traffic.messages += std::min(kMostMet, boxes - 1);
    work.traffic.sent += halo + subframe * states;
    add_parallel_product(work, ask.want.mode, cut, pixels);
}

void add_parallel_product(Work& work, Mode mode, const Cut& cut, double pixels) {
    if (cut[2] < 2) return;
    const double own = pixels / (double(cut[0]) * cut[1]);
    // The intensities of boxes are premultiplied already, and have transparencies.
    const double colors = mode->takes_transfer ? 3 : mode->operations;
    double a_pixel = composites(cut[2]) * colors;
    if (mode->takes_transfer)
        a_pixel = composites(cut[2]) * 2 * colors +
                  transparency_updates(Compositing::tree_from_front, cut[2]);
    work.operations += a_pixel * pixels;
    work.traffic.messages += std::bit_width(static_cast<unsigned>(cut[2] - 1));
    work.traffic.sent += own * state_bytes(mode) * (1 - 1.0 / cut[2]);
    work.workspace += own * state_bytes(mode);
}

}  // namespace edgewise
