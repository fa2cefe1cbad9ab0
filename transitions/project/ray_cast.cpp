#include "transitions/project/ray_cast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "graph/lines_touched.hpp"
#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/kernels/transfer_integrals.hpp"
#include "transitions/project/arriving.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/cast_by.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/level_model.hpp"
#include "transitions/project/parallel_product.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/preintegrated_model.hpp"
#include "transitions/project/ray_cast_model.hpp"
#include "transitions/shade/gradient.hpp"
#include "transitions/store/reduce.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::Hold;

/// Pixels along each side of a tile: neighbouring rays share samples in the caches, but a tile of
/// the middle takes longest, and all threads should have some.
std::int64_t tile_side(const Extent& picture) {
    constexpr std::int64_t kLargest = 64, kLeast = 16, kTiles = 64;
    std::int64_t side = kLargest;
    while (side > kLeast && picture.samples() < kTiles * side * side) side /= 2;
    return side;
}

const Filter& filter_of(const Parameters& with) { return filter_named(with.word("filter")); }
Hold hold_of(const Parameters& with) { return kernels::hold_of(filter_of(with)); }

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason =
            not_read_by(filter_of(with), {.coefficients = from.content == "coefficients",
                                          .labels = ask.want.field == Field::nearest,
                                          .non_finite = ask.scene.non_finite});
        !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_picture(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (!from.facets.empty()) {
        constexpr double kMost = 1 << 28;  // voxels: gradients are found by 31 bits
        if (!ask.want.needs_gradients())
            return Offer::no("neither light nor opacity depends on gradients");
        if (static_cast<double>(from.samples()) > kMost)
            return Offer::no("more than 2^28 samples with gradients");
    }
    if (is_spread(from) && ask.want.eye)
        return Offer::no(
            "over ranks: the eye is at a finite distance, boxes have no order along z");
    if (ask.want.shading.has_shade()) {
        if (from.content == "coefficients")
            return Offer::no("shadows need samples, and spline coefficients are none");
        constexpr double kMost = 1 << 28;  // points of a light's grid, four a sample, have 31 bits
        if (static_cast<double>(from.samples()) > kMost)
            return Offer::no("more than 2^28 samples with shadows");
        if (is_spread(from)) return Offer::no("over ranks: shadows fall from one box on another");
    }
    if (ask.want.transfer.table && ask.want.shading.has_shade())
        return Offer::no("shadows need opacities by value alone, and the table has gradients");
    if (is_spread(from) && ask.want.mode->first_hit)
        return Offer::no("over ranks: the surface may lie between the samples of two boxes");
    if (is_spread(from) && !ask.want.clips.empty())
        return Offer::no("over ranks: the clip leaves some of the boxes out");
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

double samples_of(const Offer& offer, const Ask& ask, int view) {
    const double pixels = static_cast<double>(offer.to.samples());
    return pixels * mean_length(offer.from, ask.want, view) / offer.with.number("step");
}

/// Operations to make the bricks: extremes of a voxel and its neighbours along three axes. Packed
/// types hold more voxels a vector; measured with 0.3 to 32 MB of u8, 16 bits and f32.
double brick_operations(const Representation& from) {
    return (4 + 6 * static_cast<double>(bytes_of(from.type))) * static_cast<double>(from.samples());
}

kernels::LevelsOf levels_of(const Offer& offer, const Ask& ask, const kernels::Optics& optics,
                            const kernels::RayTable* table = nullptr) {
    const bool opacities = ask.want.mode->skips == ModeTraits::Levels::opacities;
    return {.optics = opacities ? &optics : nullptr,
            .overshoot = kernels::overshoot_of(filter_of(offer.with), 3),
            .table = table};
}

double brick_bytes(const Representation& from, bool ranges) {
    constexpr double kBrick = 64;  // samples
    const double floats = ranges ? 2 : 1;
    return floats * (4 * static_cast<double>(from.samples()) / kBrick * 1.1 + 4096);
}

/// Operations to combine one sample (TABLE 36 and 37: 3 a colour and 2 of transparency).
double combining(const Ask& ask, const kernels::Optics& optics) {
    if (!ask.want.mode->takes_transfer) return ask.want.mode->operations;
    const double colors = optics.grey ? 1 : 3;
    // A table is read in place of ramps, see work().
    const double ramps = ask.want.transfer.table ? 0 : static_cast<double>(optics.ramps.size());
    return ramps * (6 + 2 * colors) + 2 * colors + 4;
}

/// The samples that rays take: what is empty or hidden is left out, as counted on the preview.
/// Cropped data hold less that can be left out, so counts are a pixel's, not shares.
double counted_of(const Offer& offer, const Ask& ask, double samples, bool bricks) {
    const auto pixels = static_cast<double>(offer.to.samples());
    if (const auto counted = ask.scene.fact(bricks ? kCastBricks : kCastTaken))
        return std::min(samples, *counted * pixels / offer.with.number("step"));
    if (!bricks) return samples;
    // Measured on CT and MR: a MIP's bricks leave out about half of the samples.
    return ask.want.mode->skips == ModeTraits::Levels::values
               ? 0.5 * samples
               : samples * std::min(1.0, 2 * ask.scene.occupied_fraction);
}

/// The same with the bounds of a filter.
double taken_of(const Offer& offer, const Ask& ask, double samples, bool bricks) {
    const double counted = counted_of(offer, ask, samples, bricks);
    if (!bricks || filter_of(offer.with).positive) return counted;
    // Counts assume bounds of the samples. Bounds of filtered values, which may lie beyond, skipped
    // about half as much of the MR head.
    constexpr double kLess = 0.5;
    const double all = counted_of(offer, ask, samples, false);
    return all - kLess * std::max(0.0, all - counted);
}

/// Bricks are made from every voxel and asked along every ray: they pay where what they leave out
/// is more than that takes. A nearest sample is read faster than a brick is asked. What voxels and
/// questions take, in samples of a first-order hold, was measured with 128^3 and 256^3 of u8, 16
/// bits and f32.
bool with_bricks(const Offer& offer, const Ask& ask, int view) {
    const int taps = filter_of(offer.with).taps;
    if (ask.want.mode->skips == ModeTraits::Levels::none || taps == 1) return false;
    const double samples = samples_of(offer, ask, view);
    const double sample = std::pow(taps / 2, 3);  // a first-order hold has 8 taps
    const double voxels = static_cast<double>(offer.from.samples());
    const double made = voxels * (0.02 + 0.02 * static_cast<double>(bytes_of(offer.from.type)));
    const double asked = 0.12 * samples * offer.with.number("step");
    const double saved = taken_of(offer, ask, samples, false) - taken_of(offer, ask, samples, true);
    return saved * sample > made + asked;
}

/// The geometry of a cast, without its volume's samples.
kernels::RayCast cast_of(const Offer& offer, const Ask& ask, int view) {
    kernels::RayCast cast;
    cast.volume.type = offer.from.type;
    cast.volume.extent = offer.from.extent;
    cast.rays = rays_of(offer.from, ask.want, view);
    cast.step = offer.with.number("step");
    return cast;
}

/// Voxels from a sample to its neighbours to the right, below and behind, where the ray through the
/// middle of the picture is nearest to that of the volume.
Eigen::Matrix3d lattice_of(const kernels::RayCast& cast, const Extent& picture) {
    const auto vector = [](const std::array<double, 3>& v) { return Vec3(v[0], v[1], v[2]); };
    const double px = static_cast<double>(picture.x - 1) / 2;
    const double py = static_cast<double>(picture.y - 1) / 2;
    const kernels::Rays& rays = cast.rays;
    const Extent& n = cast.volume.extent;
    const Vec3 middle = Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2;
    const Vec3 direction = vector(rays.direction.at(px, py));
    const double there =
        direction.dot(middle - vector(rays.origin.at(px, py))) / direction.squaredNorm();
    Eigen::Matrix3d lattice;
    lattice.col(0) = vector(rays.origin.x) + there * vector(rays.direction.x);
    lattice.col(1) = vector(rays.origin.y) + there * vector(rays.direction.y);
    lattice.col(2) = direction * (cast.step / vector(rays.measure.at(px, py)).norm());
    return lattice;
}

std::string_view variant_of(bool bricks, bool sparse, bool from_eye, bool lit) {
    if (lit) return bricks ? "lit-bricks" : "lit";
    if (bricks) return sparse ? "sparse-bricks" : "bricks";
    if (sparse) return "sparse";
    return from_eye ? "perspective" : "";
}

/// Of a whole cell's opacity, corrected for its length: see WholeCells of the kernel. A square root
/// and a quotient take as long as 20 products.
double whole_cell_operations(double power) {
    constexpr double kDoubling = 2, kHalving = 20, kMost = 4;
    const double doublings = std::log2(power);
    if (doublings != std::round(doublings) || std::abs(doublings) > kMost)
        return kCorrectionOperations;
    return doublings > 0 ? kDoubling * doublings : -kHalving * doublings;
}

/// To correct opacities for lengths of samples: at the ends of rays; where the step is not the
/// length that opacities refer to, of all. Of these, as counted, those that a packet needs.
double correction_operations(const Offer& offer, const Ask& ask, const kernels::Optics& optics,
                             double samples, double ends) {
    if (!ask.want.mode->takes_transfer) return 0;
    const auto share = [&](const Fact& fact) { return ask.scene.fact(fact).value_or(1); };
    return kCorrectionOperations * share(kCastCorrectedEnds) * ends +
           whole_cell_operations(offer.with.number("step") / optics.unit) * share(kCastCorrected) *
               samples;
}

/// Samples that light is worked out for: those that a packet needs, as counted.
double lit_of(const Offer& offer, const Ask& ask, double samples, double ends) {
    if (!ask.want.shading.on() && !ask.want.needs_gradients()) return 0;
    if (ask.want.mode->first_hit) return 2 * static_cast<double>(offer.to.samples());
    const auto share = [&](const Fact& fact) { return ask.scene.fact(fact).value_or(1); };
    return share(kCastCorrectedEnds) * ends + share(kCastCorrected) * samples;
}

/// @param beside  gradients lie beside the samples
Work work_of(const Offer& offer, const Ask& ask, int view, bool beside) {
    const Hold hold = hold_of(offer.with);
    // TABLE 6: a first-order hold in 3D takes 7 interpolations of 3; a cubic one 3 x 16 for weights
    // and 21 sums of four products. Place: 3 products and sums, 3 roundings.
    const double filter = hold == Hold::zoh        ? 0
                          : hold == Hold::foh      ? 21
                          : hold == Hold::bspline3 ? 48 + 147
                                                   : filter_of(offer.with).operations_of(3);
    const double taps = filter_of(offer.with).taps;  // along each axis
    const double samples = samples_of(offer, ask, view);
    const bool bricks = with_bricks(offer, ask, view);
    const double taken = taken_of(offer, ask, samples, bricks);
    const kernels::Optics optics = optics_of(ask.want, offer.from.values);
    const double pixels = static_cast<double>(offer.to.samples());
    // To set a ray up takes 60 operations, where a rank works rays out one by one. Packets that may
    // meet the data take 60 a ray in f64, of which a vector holds half as many as of f32, and
    // keep 64 bytes a ray, written and read. A lane's result is worked out by itself: 20 numbers
    // are stored and read again.
    const kernels::RayCast cast = cast_of(offer, ask, view);
    const bool sparse = kernels::is_sparse(cast);
    const bool spread = is_spread(offer.from);
    const RaysMet met =
        spread ? RaysMet{} : rays_met(offer.from, ask.want, view, kernels::kPacketSide);
    // Both ends of a ray are parts of cells. At the ends of a packet cells are masked and weighed,
    // and positions brought into the data: least squares have 60 operations for zero-order and 120
    // to 180 for first-order holds. Bricks leave out as much of them as of whole cells.
    const double kept = bricks ? taken / samples : 1;
    const double all = taken + kept * (met.beyond / cast.step + met.packets);
    const double ends = kept * 2 * (met.ragged / cast.step + met.packets);
    const double bytes = static_cast<double>(bytes_of(offer.from.type));
    const Eigen::Matrix3d lattice = lattice_of(cast, offer.to.extent);
    const double lines = taken * lines_touched(lattice, bytes, Vec3::Constant(taps));
    // Of sparse samples they are asked for ahead, which leaves some of the wait: least squares over
    // casts of 13 to 32 MB have 0.5 to 0.85.
    const double waits = sparse && taps <= 2 ? 0.6 : 1;
    // Few rays come back to their own lines alone, one view after the other.
    const double own = kLineBytes * lines * ask.want.views.different();
    const double tiles = pixels / static_cast<double>(std::pow(tile_side(offer.to.extent), 2));
    // Light: six more samples, or the filter's weights with their derivatives; of smoothed
    // gradients 26 samples, or of a first-order hold all 64 around a place; 15 operations to bring
    // a gradient to the screen, 20 to make a normal of it, 40 a light.
    const double lit = lit_of(offer, ask, samples, ends);
    const bool differences = !beside && (hold == Hold::zoh || hold == Hold::foh);
    const bool smooth = !beside && ask.want.smooths_gradients();
    const double gradient = beside        ? 60
                            : smooth      ? (hold == Hold::foh ? 224 : 26 * (filter + 6))
                            : differences ? 6 * filter + 6
                                          : 3 * filter;
    const double reads = smooth ? (hold == Hold::foh ? 8 : 26) : differences ? 6 : 1;
    const double sources = static_cast<double>(ask.want.shading.lights.size());
    Work work{
        .operations = all * (9 + filter + combining(ask, optics)) +
                      lit * (gradient + 35 + 40 * sources) +
                      (spread ? 60 * pixels : 120 * met.packets) +
                      correction_operations(offer, ask, optics, samples, ends) +
                      (bricks ? brick_operations(offer.from) + 2 * samples : 0),
        .masked = (50 + 5 * filter) * ends,
        .streamed = offer.to.bytes() + 128 * met.packets + (bricks ? offer.from.bytes() : 0),
        .gathers =
            (all + lit * reads) * taps * taps * taps + 20 * met.packets + (beside ? 16 * lit : 0),
        .lines = {waits * lines, spread ? 0 : std::min(offer.from.bytes(), own)},
        .other_lines = {spread ? 0
                               : taken * lines_swept(lattice, kernels::kPacketSide, bytes,
                                                     Vec3::Constant(taps)),
                        kLineBytes * lines / std::max(1.0, tiles)},
        .workspace = bricks ? brick_bytes(offer.from, levels_of(offer, ask, optics).ranges()) : 0,
        .variant = hold == Hold::weighted ? "weighted"
                                          : variant_of(bricks, sparse, ask.want.eye.has_value(),
                                                       ask.want.shading.on() || ask.want.cue ||
                                                           ask.want.transfer.needs_gradients())};
    if (ask.want.mode->takes_transfer && ask.want.transfer.table) {
        // Every value reads its largest opacity; a visible one four corners of four numbers.
        const TransferTable& table = *ask.want.transfer.table;
        const auto search = [](const std::vector<double>& places) {
            return std::ceil(std::log2(static_cast<double>(places.size() + 1)));
        };
        const double by_value = search(table.values), by_gradient = search(table.gradients);
        work.operations += all * (3 * by_value + 12) + lit * (3 * by_gradient + 60);
        work.gathers += all * (by_value + 4) + lit * (by_gradient + 18);
        work.workspace += kernels::bytes_of_ray_table(table);
    }
    if (spread) add_subframes(work, offer, ask, view);
    if (ask.want.shading.has_shade()) {
        const ArrivingGrids grids(
            {.type = offer.from.type, .extent = offer.from.extent, .values = offer.from.values},
            offer.from, ask.want, view, std::pmr::get_default_resource());
        constexpr double kLookUp = 60;
        work.operations += grids.operations() +
                           kLookUp * lit * static_cast<double>(ask.want.shading.lights.size()) +
                           brick_operations(offer.from);
        work.streamed += grids.bytes();
        work.gathers += 8 * lit;
        work.workspace += grids.bytes() + brick_bytes(offer.from, true);
    }
    return work;
}

Work work(const Offer& offer, const Ask& ask, int view) { return work_of(offer, ask, view, false); }

Work work_with_gradients(const Offer& offer, const Ask& ask, int view) {
    return work_of(offer, ask, view, true);
}

Error error(const Offer& offer, const Ask& ask) {
    return cast_error(filter_of(offer.with), offer.with.number("step"), ask);
}

/// The box of the input that the rays of a part of a picture read. Rays go on together, so that a
/// ray is read as far as another one of the part is inside, and brought back to the faces there.
Region reads(const Offer& offer, const Request& want, const Region& out, int view) {
    const Extent& n = offer.from.extent;
    if (want.eye || out.empty() || want.shading.has_shade()) return Region::all(n);
    const kernels::Rays rays = rays_of(offer.from, want, view, -0.5);
    const auto corner = [&](int which) {
        return rays.origin.at(static_cast<double>(which & 1 ? out.end[0] - 1 : out.begin[0]),
                              static_cast<double>(which & 2 ? out.end[1] - 1 : out.begin[1]));
    };
    // Where all of them are before a slab's near face, and behind a far one, none is inside.
    double low = -std::numeric_limits<double>::infinity(), high = -low;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = rays.direction.base[axis];
        if (std::abs(d) < 1e-12) continue;
        double enters = std::numeric_limits<double>::infinity(), leaves = -enters;
        for (int which = 0; which < 4; ++which) {
            const double o = corner(which)[axis];
            const double a = (-0.5 - o) / d, b = (static_cast<double>(n[axis]) - 0.5 - o) / d;
            enters = std::min(enters, std::min(a, b));
            leaves = std::max(leaves, std::max(a, b));
        }
        low = std::max(low, enters);
        high = std::min(high, leaves);
    }
    // Cells that are cut by a face, and roundings of f32 places.
    const double step = offer.with.number("step");
    low -= step;
    high += step;
    // Gradients take a sample more.
    const double taps = filter_of(offer.with).taps / 2 + (want.needs_gradients() ? 2 : 1);
    Region box;
    for (int axis = 0; axis < 3; ++axis) {
        double first = std::numeric_limits<double>::infinity(), last = -first;
        for (int which = 0; which < 4; ++which)
            for (const double t : {low, high}) {
                const double p = corner(which)[axis] + t * rays.direction.base[axis];
                first = std::min(first, p);
                last = std::max(last, p);
            }
        const auto top = static_cast<double>(n[axis] - 1);
        box.begin[axis] = static_cast<std::int64_t>(std::clamp(std::floor(first - taps), 0.0, top));
        box.end[axis] = static_cast<std::int64_t>(std::clamp(std::ceil(last + taps), 0.0, top)) + 1;
    }
    return box;
}

/// A picture is one region: it is cut into tiles inside, which share what is made of all samples.
Partition parts(const Offer& offer, const Ask& ask) {
    return {.kind = Partition::output,
            .leaf = {offer.to.extent.x, offer.to.extent.y, 1},
            .reads = [offer, want = ask.want](const Region& out, int view) {
                return reads(offer, want, out, view);
            }};
}

/// @param integrated  pieces between samples are integrated
/// @param beside      gradients lie beside the samples, and are taken
void cast_picture(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                  const Region& region, Context& context, bool integrated,
                  const CastBy& by = {.tile = kernels::ray_cast}, bool beside = false) {
    const Request& want = ask.want;
    const kernels::Optics optics = optics_of(want, in.what.values);
    std::optional<kernels::TransferIntegrals> integrals;
    if (integrated) integrals = kernels::transfer_integrals_of(optics);
    const Hold hold = hold_of(offer.with);
    kernels::RayCast cast{.volume = rule_grid(in, want),
                          .hold = hold,
                          .weights = hold == Hold::weighted
                                         ? &kernels::TapPolynomials::of(filter_of(offer.with))
                                         : nullptr,
                          .rule = want.mode->combine,
                          .other = want.mode->rule,
                          // Cells of parallel rays begin at the front of the screen's first layer,
                          // so that a step of 1 samples its layers where they are.
                          .rays = rays_of(in.what, want, context.view, -0.5),
                          .step = offer.with.number("step"),
                          .unit = want.unit,
                          .zero = want.zero,
                          .miss = rule_miss(want),
                          .level = want.level(),
                          .optics = &optics,
                          .bound = kTerminated};
    if (integrals) cast.integrals = &*integrals;
    const std::optional<kernels::RayLight> light = light_of(in.what, want, context.view);
    if (light) cast.light = &*light;
    const std::optional<kernels::RayEdges> edges = edges_of(in.what, want, context.view);
    if (edges) cast.edges = &*edges;
    const std::optional<kernels::RayTable> table = table_of(in.what, want, context.view);
    if (table) cast.table = &*table;
    const std::optional<kernels::RayCue> cue = cue_of(want, context.view, -0.5);
    if (cue) cast.cue = &*cue;
    const std::optional<kernels::Kept> kept = kept_of(in.what, want, context.view);
    if (kept) cast.kept = &*kept;
    std::shared_ptr<const kernels::Gradients> gradients;
    if (beside) {
        gradients = gradients_of(in);
        cast.gradients = gradients.get();
    }
    cast.sobel = want.smooths_gradients();
    std::optional<ArrivingGrids> arriving;
    if (light && want.shading.has_shade()) {
        const auto opaque = bricks_beside(in, cast.volume, {.optics = &optics}, context.memory,
                                          [&] { return context.stopped(); });
        context.poll();
        arriving.emplace(cast.volume, in.what, want, context.view, context.memory);
        arriving->fill(opaque.get(), context);
        cast.arriving = &arriving->lanes();
    }
    std::shared_ptr<const kernels::Bricks> bricks;
    if (cast.volume.whole() && with_bricks(offer, ask, context.view)) {
        kernels::LevelsOf levels = levels_of(offer, ask, optics, cast.table);
        if (by.beyond) levels.overshoot = by.beyond(levels.overshoot);
        bricks = bricks_beside(in, cast.volume, levels, context.memory,
                               [&] { return context.stopped(); });
    }
    context.poll();
    cast.bricks = bricks.get();
    if (by.region) return by.region(cast);
    const std::int64_t row = out.row();
    const std::int64_t side = tile_side(out.what.extent);
    for_tiles(region, side, side, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        float* first = out.at<float>(tile.begin[0], tile.begin[1], 0);
        by.tile(cast, tile.begin[0], tile.begin[1], size.x, size.y, first, row);
        give_sign(want, first, size.x, size.y, row);
    });
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    cast_picture(offer, ask, in, out, region, context, false);
}

void run_with_gradients(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                        const Region& region, Context& context) {
    cast_picture(offer, ask, in, out, region, context, false, {.tile = kernels::ray_cast}, true);
}

void run_integrated(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                    const Region& region, Context& context) {
    cast_picture(offer, ask, in, out, region, context, true);
}

Offer offer_integrated(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (!want.mode->takes_transfer)
        return Offer::no("only a transfer function is integrated between samples");
    if (want.shading.on()) return Offer::no("light differs between two samples");
    if (want.cue) return Offer::no("light falls off between two samples");
    if (want.transfer.needs_gradients()) return Offer::no("gradients differ between two samples");
    if (is_spread(from)) return Offer::no("over ranks: a piece may lie between two boxes");
    return offer(from, ask, with);
}

Work work_integrated(const Offer& offer, const Ask& ask, int view) {
    // The table; of each sample two knots of four numbers, the middle of its piece, an exponential
    // and a correction of its opacity.
    constexpr double kTable = 8 * 60.0 * kernels::TransferIntegrals::kCells;
    Work work = edgewise::work(offer, ask, view);
    const double all =
        taken_of(offer, ask, samples_of(offer, ask, view), with_bricks(offer, ask, view));
    work.operations += kTable + (60 + 2 * kCorrectionOperations) * all;
    work.gathers += 8 * all;
    work.workspace += 16.0 * kernels::TransferIntegrals::kCells;
    work.variant = "integrated";
    return work;
}

Error error_integrated(const Offer& offer, const Ask& ask) {
    Error of_samples = error(offer, ask);
    const FactName fact = integrated_fact(filter_of(offer.with), offer.with.number("step"));
    if (const auto seen = ask.scene.fact(fact)) {
        // What rays are cut short by is in both.
        of_samples.bias = *seen + kTerminated;
        return of_samples;
    }
    return Error::unknown();
}

FactName fact_of_level(const Representation& from, const Parameters& with) {
    return level_fact(level_of(from.space), filter_of(with), with.number("step"));
}

Offer offer_level(const Representation& from, const Ask& ask, const Parameters& with) {
    if (ask.want.mode->sampled_every > 0)
        return Offer::no("the mode asks for the samples themselves, not for means");
    if (ask.want.shading.has_shade()) return Offer::no("shadows are worked out of all samples");
    if (ask.want.smooths_gradients())
        return Offer::no("gradients are those of means; smoothed ones of samples were asked for");
    if (ask.want.transfer.table)
        return Offer::no("the table is for gradients of the samples, not for those of their means");
    // A preview has looked, and not at this.
    const bool seen = ask.scene.fact(kPictureError(filter_of(with).name, 1)).has_value();
    if (seen && !ask.scene.fact(fact_of_level(from, with)))
        return Offer::no("its error was not measured: it could not pay, or nobody asked for it");
    return offer(from, ask, with);
}

Error error_level(const Offer& offer, const Ask& ask) {
    if (const auto seen = ask.scene.fact(fact_of_level(offer.from, offer.with))) {
        Error of_samples = error(offer, ask);
        of_samples.bias = *seen + kTerminated;
        return of_samples;
    }
    return Error::unknown();
}

/// Filters of first order interpolate the same central differences themselves, so these have no
/// error of their own.
Error error_of_gradients(const Offer& offer, const Ask& ask) {
    const auto own =
        ask.want.smooths_gradients() ? kernels::Differences::sobel : kernels::Differences::central;
    if (differences_of(offer.from) != own) return Error::unknown();
    return error(offer, ask);
}

}  // namespace

void cast_by(const CastBy& by, const Offer& offer, const Ask& ask, const Data& in, Data& out,
             const Region& region, Context& context) {
    cast_picture(offer, ask, in, out, region, context, false, by);
}

double samples_taken(const Offer& offer, const Ask& ask, int view) {
    return taken_of(offer, ask, samples_of(offer, ask, view), with_bricks(offer, ask, view));
}

Transition gradient_cast() {
    Transition edge = ray_cast();
    edge.name = "project.gradient_cast";
    edge.joins.clear();
    for (const auto by :
         {kernels::Differences::central, kernels::Differences::sobel, kernels::Differences::fourth})
        edge.joins.emplace_back("object/scalar+" + gradient_facet_of(by), "screen/picture");
    edge.parameters["filter"] = one_of({"zoh", "foh"}, "what reads the values");
    edge.laws.clear();
    edge.plain.reset();
    edge.work = work_with_gradients;
    edge.error = error_of_gradients;
    edge.run = run_with_gradients;
    edge.model = {};
    edge.trials = lit_trials;
    edge.factors = {{"", 0.53}};  // a guess: as project.ray_cast
    return edge;
}

Transition level_cast() {
    Transition edge = ray_cast();
    edge.name = "project.level_cast";
    edge.source = "Williams, Pyramidal parametrics, SIGGRAPH 1983; Wittenbrink 1993, 4.2.1";
    edge.joins.clear();
    for (int level = 1; level <= kLevels; ++level)
        edge.joins.emplace_back(level_space(level) + "/scalar", "screen/picture");
    edge.parameters["filter"] = one_of({"foh"}, "what reads the cells");
    edge.parameters["step"] =
        number(0.01, 64, {2, 4}, "distance of samples, in the input's smallest spacing");
    edge.laws.clear();
    edge.plain.reset();
    edge.offer = offer_level;
    edge.error = error_level;
    edge.model = level_model;
    edge.trials = [] { return picture_trials(); };
    edge.factors = {{"", 0.53}};  // a guess: as project.ray_cast
    return edge;
}

Transition preintegrated_cast() {
    Transition edge = ray_cast();
    edge.name = "project.preintegrated_cast";
    edge.source = "Engel, Kraus, Ertl 2001; Wittenbrink 1993, EQ 62 and 63";
    edge.parameters["step"] =
        number(0.01, 4, {1, 2}, "distance of samples, in the smallest spacing");
    edge.parameters["filter"] = any_filter({"foh", "bspline3"});
    edge.laws.clear();
    edge.plain.reset();
    edge.offer = offer_integrated;
    edge.work = work_integrated;
    edge.error = error_integrated;
    edge.model = preintegrated_model;
    edge.run = run_integrated;
    edge.trials = [] { return picture_trials(Combine::over); };
    edge.factors = {{"", 1.1}};
    return edge;
}

Transition ray_cast() {
    Transition edge;
    edge.name = "project.ray_cast";
    edge.source = "Wittenbrink 1993, 4.2.1, EQ 62 and 63, TABLE 6, 36 and 37";
    edge.joins = {{"object/scalar", "screen/picture"}, {"object/coefficients", "screen/picture"}};
    edge.parameters = {{"filter", any_filter({"zoh", "foh", "bspline3"})},
                       {"step", number(0.01, 4, {1, 0.5, 0.25, 2, 0.125},
                                       "distance of samples, in the smallest spacing")}};
    edge.laws = {Law::constant};
    edge.plain = Parameters{{"step", 1.0}};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = ray_cast_model;
    edge.shared_counts = {measure_casting};
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials();
        join(all, perspective_trials());
        return all;
    };
    edge.factors = {{"", 0.6}, {"/filter=foh", 0.53}, {"/filter=zoh", 0.9}};
    return edge;
}

}  // namespace edgewise
