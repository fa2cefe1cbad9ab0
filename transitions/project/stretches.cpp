#include "transitions/project/stretches.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "graph/spread.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kTile = 32;  // pixels along each side

bool has_stretches(Combine rule) noexcept {
    switch (rule) {
        case Combine::max:
        case Combine::sum:
        case Combine::mean:
        case Combine::over:
            return true;
        case Combine::hit:
        case Combine::other:
            break;
    }
    return false;
}

}  // namespace

std::string no_stretches(const Representation& from, const Ask& ask) {
    const Request& want = ask.want;
    if (std::string reason = no_picture(from, ask); !reason.empty()) return reason;
    if (!has_stretches(want.mode->combine))
        return fmt::format("mode {} has no closed form of a stretch of one value", want.mode->name);
    if (want.field == Field::nearest) return "labels have no values between them";
    if (want.shading.on()) return "light differs along a stretch";
    if (want.cue) return "light falls off along a stretch";
    if (want.transfer.needs_gradients()) return "opacities need gradients, which no stretch has";
    if (is_spread(from)) return "over ranks: stretches end at boxes";
    return {};
}

double longest_way(const Representation& from, const Request& want) {
    const Vec3 n(static_cast<double>(from.extent.x), static_cast<double>(from.extent.y),
                 static_cast<double>(from.extent.z));
    const double diagonal = n.cwiseProduct(want.spacing).norm() / want.unit;
    if (want.eye) return diagonal;
    double longest = 0;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const kernels::Rays rays = rays_of(from, want, want.views.first_view(variant));
        double way = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis)
            way = std::min(way, n[axis] / std::abs(rays.direction.base[axis]));
        longest = std::max(longest, way);
    }
    return longest;
}

Work work_of_stretches(const Offer& offer, const Ask& ask, int view, double share,
                       double cells_a_look) {
    // A ray takes 60, a look at a map some 40; of a sample place and filter 30, and its rule. A
    // vector is not always full.
    constexpr double kRay = 60, kLook = 40, kSample = 30, kFilled = 0.6;
    const double pixels = static_cast<double>(offer.to.samples());
    const double cells =
        pixels * mean_length(offer.from, ask.want, view) / offer.with.number("step");
    const double combining = ask.want.mode->takes_transfer
                                 ? 12 * static_cast<double>(ask.want.transfer.points.size())
                                 : ask.want.mode->operations;
    const double sampled = share * cells / kFilled;
    return {.operations =
                kRay * pixels + kLook * cells / cells_a_look + sampled * (kSample + combining),
            .streamed = offer.to.bytes(),
            .gathers = 8 * sampled + 4 * cells / cells_a_look};
}

Partition parts_of_stretches(const Offer& offer, const Ask&) {
    return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
}

StretchRays::StretchRays(const Offer& offer, const Ask& ask, const Data& in, int view)
    : optics_(optics_of(ask.want, in.what.values)),
      kept_(kept_of(in.what, ask.want, view)),
      takes_optics_(ask.want.mode->takes_transfer) {
    const Request& want = ask.want;
    cast_ = {.volume = rule_grid(in, want),
             .hold = kernels::Hold::foh,
             .rule = want.mode->combine,
             .rays = rays_of(in.what, want, view, -0.5),
             .kept = kept_ ? &*kept_ : nullptr,
             .step = offer.with.number("step"),
             .unit = want.unit,
             .zero = want.zero,
             .miss = rule_miss(want),
             .optics = &optics_,
             .bound = kTerminated};
}

void cast_stretches(const kernels::StretchCast& by, const Request& want, Data& out,
                    const Region& region, const Context& context) {
    const std::int64_t row = out.row();
    for_tiles(region, kTile, kTile, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        float* const first = out.at<float>(tile.begin[0], tile.begin[1], 0);
        kernels::stretch_cast(by, tile.begin[0], tile.begin[1], size.x, size.y, first, row);
        give_sign(want, first, size.x, size.y, row);
    });
}

}  // namespace edgewise
