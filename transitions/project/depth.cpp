#include "transitions/project/depth.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "transitions/filters/read_by.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// What would make a mode's picture of depths refuse; empty: nothing.
std::string refusal(const Request& want) {
    if (!want.job->of_rays() || !want.mode->first_hit)
        return "the mode asks for more than a surface";
    if (want.eye) return "the eye is at a finite distance: pixels are no steps across the surface";
    if (want.shading.has_shade()) return "shadows are worked out of all samples";
    if (want.smooths_gradients())
        return "normals are those of depths; smoothed gradients of samples were asked for";
    return {};
}

/// The longest way through the input along screen z [file unit].
double longest(const Request& want) {
    const Vec3 sides(static_cast<double>(want.input.x) * want.spacing.x(),
                     static_cast<double>(want.input.y) * want.spacing.y(),
                     static_cast<double>(want.input.z) * want.spacing.z());
    double scale = 0;
    for (int view = 0; view < want.frames; ++view) {
        const Eigen::Matrix3d map = want.views.at(view).matrix().topLeftCorner<3, 3>();
        scale = std::max(scale, (map * want.spacing.cwiseInverse().asDiagonal()).row(2).norm());
    }
    return sides.norm() * scale * want.unit;
}

/// The same pictures, with light that falls off by depth alone: a hit of half of the light is half
/// of the range away.
Request of_depths(const Request& want) {
    Request depths = want;
    depths.shading = Shading{};
    depths.cue = DepthCue{1 / (2 * longest(want)), true};
    return depths;
}

Offer offer_cast(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = refusal(ask.want); !reason.empty())
        return Offer::no(std::move(reason));
    const Request depths = of_depths(ask.want);
    Offer made = ray_cast().offer(from, {depths, ask.scene}, with);
    if (!made.refused.empty()) return made;
    made.to.content = "depth";
    made.to.channels = 1;
    return made;
}

/// The offer of the cast whose picture tells depths.
Offer cast_of(const Offer& offer, const Request& depths) {
    Offer cast = offer;
    cast.to = screen_picture(offer.from, depths);
    return cast;
}

Work work_cast(const Offer& offer, const Ask& ask, int view) {
    const Request depths = of_depths(ask.want);
    const Offer cast = cast_of(offer, depths);
    Work work = ray_cast().work(cast, {depths, ask.scene}, view);
    work.workspace += cast.to.bytes();
    return work;
}

Partition parts_cast(const Offer& offer, const Ask& ask) {
    const Request depths = of_depths(ask.want);
    return ray_cast().parts(cast_of(offer, depths), {depths, ask.scene});
}

void run_cast(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
              Context& context) {
    const Request depths = of_depths(ask.want);
    const Offer cast = cast_of(offer, depths);
    Data picture = Data::make(cast.to, region, context.memory);
    ray_cast().run(cast, {depths, ask.scene}, in, picture, region, context);
    const double nearest = nearest_corner(ask.want, context.view);
    for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y)
        for (std::int64_t x = region.begin[0]; x < region.end[0]; ++x) {
            const float* const at = picture.at<float>(x, y, 0);
            const double away = (1 - static_cast<double>(at[0])) / depths.cue->per_length;
            *out.at<float>(x, y, 0) =
                static_cast<float>(at[3] > 0 ? nearest + away / ask.want.unit : kNone);
        }
}

/// How depth changes from pixel to pixel along one axis.
double change(double before, double here, double after, bool adaptive) {
    const double left = here - before, right = after - here;
    if (!std::isfinite(left)) return std::isfinite(right) ? right : 0;
    if (!std::isfinite(right)) return left;
    constexpr double kAlike = 3;  // times as steep
    const double small = std::min(std::abs(left), std::abs(right)),
                 large = std::max(std::abs(left), std::abs(right));
    // A pixel's step: below it surfaces that bend are told from edges by nothing.
    if (!adaptive || large <= std::max(1.0, kAlike * small)) return (left + right) / 2;
    return std::abs(left) < std::abs(right) ? left : right;
}

void run_light(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
               Context& context) {
    const Request& want = ask.want;
    const bool adaptive = offer.with.word("normals") == "adaptive";
    const double nearest = nearest_corner(want, context.view);
    Shading shading = want.shading;
    shading.least = 0;  // depths tell directions alone
    const auto depth = [&](std::int64_t x, std::int64_t y) {
        const bool there = x >= 0 && y >= 0 && x < in.what.extent.x && y < in.what.extent.y;
        return there ? static_cast<double>(*in.at<float>(x, y, 0)) : kNone;
    };
    constexpr std::int64_t kAcross = 256, kDown = 16;
    for_tiles(region, kAcross, kDown, context, [&](const Region& tile) {
        for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y)
            for (std::int64_t x = tile.begin[0]; x < tile.end[0]; ++x) {
                float* const pixel = out.at<float>(x, y, 0);
                const double here = depth(x, y);
                std::fill_n(pixel, 4, 0.0F);
                if (!std::isfinite(here)) continue;
                const Vec3 gradient(
                    -change(depth(x - 1, y), here, depth(x + 1, y), adaptive) / want.pixel[0],
                    -change(depth(x, y - 1), here, depth(x, y + 1), adaptive) / want.pixel[1], 1);
                const Lit lit = shading.at(gradient, Vec3(0, 0, -1));
                const double left = want.cue ? want.cue->left((here - nearest) * want.unit) : 1;
                std::fill_n(pixel, 3, static_cast<float>(left * (lit.diffuse + lit.specular)));
                pixel[3] = 1;
            }
    });
}

}  // namespace

Transition depth_cast() {
    Transition edge = ray_cast();
    edge.name = "project.depth";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "Wittenbrink 1993, 4.1.2; Gordon, Reynolds 1985";
    edge.joins = {{"object/scalar", "screen/depth"}, {"object/coefficients", "screen/depth"}};
    // Between the nearest samples nothing is told of a slope.
    edge.parameters["filter"] = any_filter({"foh", "bspline3"});
    edge.parameters["step"] = number(0.01, 4, {1}, "distance of samples, in the smallest spacing");
    edge.laws.clear();
    edge.plain.reset();
    edge.offer = offer_cast;
    edge.work = work_cast;
    edge.error = [](const Offer&, const Ask&) -> Error { return {}; };
    edge.model = {};
    edge.parts = parts_cast;
    edge.run = run_cast;
    return edge;
}

Transition depth_light() {
    Transition edge;
    edge.name = "shade.depth";
    edge.source =
        "Gordon, Reynolds, Image space shading of 3-dimensional objects, CVGIP 29, 1985; Yagel, "
        "Cohen, Kaufman, Normal estimation in 3D discrete space, The Visual Computer 8, 1992";
    edge.joins = {{"screen/depth", "screen/picture"}};
    edge.on_demand = true;
    edge.parameters = {{"normals", one_of({"adaptive", "central"}, {std::string("adaptive")},
                                          "how differences of depth are taken")}};
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters& with) {
        if (std::string reason = refusal(ask.want); !reason.empty())
            return Offer::no(std::move(reason));
        return Offer{.from = from, .to = screen_picture(from, ask.want), .with = with};
    };
    edge.work = [](const Offer& offer, const Ask& ask, int) -> Work {
        const auto lights = static_cast<double>(ask.want.shading.lights.size());
        return {.operations = static_cast<double>(offer.to.samples()) * (30 + 40 * lights),
                .streamed = offer.from.bytes() + offer.to.bytes()};
    };
    edge.run = run_light;
    return edge;
}

}  // namespace edgewise
