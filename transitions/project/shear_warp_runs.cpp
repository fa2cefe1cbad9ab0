#include "transitions/project/shear_warp_runs.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "transitions/filters/filter.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/shear_warp_runs.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/shear_border.hpp"
#include "transitions/project/shear_view.hpp"
#include "transitions/project/shear_warp.hpp"
#include "transitions/shade/runs.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::kRunsHeight;
using kernels::kRunsWidth;

/// Floats of one plane of states, and what a vector that begins in the last row reads behind it.
constexpr std::ptrdiff_t kRunsPlane = kRunsWidth * kRunsHeight + 16;

/// The edge whose picture it is.
Transition plain() { return shear_warp(); }

kernels::Hold hold_of(const Parameters& with) {
    return kernels::hold_of(filter_named(with.word("filter")));
}

double tile_bytes(Mode mode) {
    const int planes = kernels::PixelStates::planes(mode->combine, mode->rule) + 2;
    return static_cast<double>(planes * kRunsPlane) * 4.0 + 2 * kArraySlack;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (unseen_of(ask.want, from.values).empty())
        return Offer::no("no value is transparent, so that runs would hold all samples");
    return plain().offer(from, ask, with);
}

/// Operations a voxel that is added: three interpolations of two, the rule, and what a block of
/// pixels is asked behind it.
double voxel_operations(const Offer& offer, const Ask& ask, double step) {
    const double hold = hold_of(offer.with) == kernels::Hold::zoh ? 0 : 6;
    if (!ask.want.mode->takes_transfer) return hold + 4 + ask.want.mode->operations;
    const kernels::Optics optics = optics_of(ask.want, offer.from.values);
    return hold + 16 + static_cast<double>(optics.ramps.size()) * (optics.grey ? 8 : 12) +
           (step == optics.unit ? 0 : kCorrectionOperations);
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const ShearView f = shear_view_of(offer.from, ask.want, view);
    const Extent& n = offer.from.extent;
    const double share = share_in_runs(ask), voxels = static_cast<double>(n.samples()) * share;
    // A tile's row asks each slice for its runs; of hidden ones it is soon told.
    const auto tiles = static_cast<double>((f.image.x + kRunsWidth - 1) / kRunsWidth);
    const double rows = static_cast<double>(n.y * n.z) * tiles;
    const double runs = ask.scene.fact(kRunsRow).value_or(1) * static_cast<double>(n.y * n.z);
    const int channels = ask.want.mode->channels;
    const bool nearest = hold_of(offer.with) == kernels::Hold::zoh;
    const double pixels = static_cast<double>(offer.to.samples());
    const double image = static_cast<double>(f.image.samples()), bytes = 4 * image * channels;
    const double lines = share * offer.from.bytes() / kLineBytes;
    return {.operations = voxels * voxel_operations(offer, ask, f.step) + 40 * rows + 60 * runs +
                          40 * image + pixels * (14 + (nearest ? 0 : 9 * channels)),
            .streamed = share * offer.from.bytes() + sizeof(kernels::VisibleRuns::Run) * runs +
                        2 * bytes + offer.to.bytes(),
            .gathers = pixels * (nearest ? 1 : 4) * channels,
            .lines = {lines, share * offer.from.bytes()},
            .scratch = tile_bytes(ask.want.mode),
            .workspace = bytes};
}

Error error(const Offer& offer, const Ask& ask) { return plain().error(offer, ask); }

/// A picture is one region: it is cut into tiles inside, which share the intermediate image. Runs
/// are those of all samples.
Partition parts(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

/// Makes a box of the image; `image` holds it. Tiles are those of project.shear_warp: to the bit
/// places hang on where a tile begins.
void project(const kernels::ShearWarp& warp, const kernels::VisibleRuns& runs, const Region& box,
             Mode mode, float* image, Context& context) {
    const int channels = mode->channels;
    const std::int64_t row = box.extent().x * channels;
    for_tiles(from_multiple(box, kRunsWidth), kRunsWidth, kRunsHeight, context,
              [&](const Region& tile) {
                  const Extent size = tile.extent();
                  const std::int64_t i = tile.begin[0], j = tile.begin[1];
                  const std::int64_t skip = std::max<std::int64_t>(box.begin[0] - i, 0);
                  Array scratch(static_cast<std::size_t>(tile_bytes(mode)), context.memory);
                  float* low = static_cast<float*>(scratch.data());
                  float* high = low + kRunsPlane;
                  const kernels::PixelStates states{high + kRunsPlane, kRunsWidth, kRunsPlane};
                  const kernels::PixelStates part{states.first + skip, kRunsWidth, kRunsPlane};
                  kernels::shear_spans(warp, i, j, size.x, size.y, low, high, kRunsWidth);
                  kernels::clear_states(warp.with, states, kRunsWidth, size.y);
                  kernels::shear_warp_runs(warp, runs, i, j, size.x, size.y,
                                           {low, high, kRunsWidth}, states);
                  kernels::finish_states(
                      warp.with, part, size.x - skip, size.y,
                      image + (j - box.begin[1]) * row + (i + skip - box.begin[0]) * channels, row);
              });
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Request& want = ask.want;
    const ShearView f = shear_view_of(in.what, want, context.view);
    const kernels::Optics optics = optics_of(want, in.what.values);
    const kernels::Hold hold = hold_of(offer.with);
    const kernels::ShearWarp warp = shear_warp_of(f, in, want, optics, hold);
    Representation what;
    what.extent = f.image;
    what.type = Type::f32;
    what.channels = want.mode->channels;
    Data image = Data::make(what, box_of_image(f, region), context.memory);
    const auto runs = runs_of(in);
    project(warp, *runs, image.box, want.mode, image.as<float>(), context);

    const auto outside = static_cast<float>(rule_miss(want));
    const ShearedImage sheared{.mode = want.mode,
                               .warp = warp,
                               .values = image.as<float>(),
                               .extent = f.image,
                               .held = image.box,
                               .channels = want.mode->channels,
                               .to_image = f.to_image,
                               .outside = outside};
    const kernels::BackwardWarp picture(kernels::grid_of(image), f.to_image, hold, outside);
    const kernels::WarpOutput output{out.as<float>(), out.held()};
    const Read read = hold == kernels::Hold::foh ? Read::bilinear : Read::nearest;
    const Extent& to = out.what.extent;
    const Extent size = kernels::preferred_tile(to);
    for_tiles(from_multiple(region, size.x), size.x, size.y, context, [&](const Region& tile) {
        Region part = tile, whole = tile;
        part.begin[0] = std::max(tile.begin[0], region.begin[0]);
        whole.end[0] = std::min(tile.begin[0] + size.x, to.x);
        picture(output, part);
        mend_border(sheared, read, output, part, whole);
    });
}

}  // namespace

Transition shear_warp_runs() {
    Transition edge;
    edge.name = "project.shear_warp_runs";
    edge.source = "Lacroute and Levoy 1994";
    edge.joins = {{"aligned/runs", "screen/picture"}, {"object/runs", "screen/picture"}};
    edge.parameters = plain().parameters;
    edge.offer = offer;
    edge.work = work;
    edge.shared_counts = {measure_casting};
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] { return picture_trials(Combine::over); };
    edge.factors = {{"", 1}};
    return edge;
}

}  // namespace edgewise
