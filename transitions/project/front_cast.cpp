#include "transitions/project/front_cast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "graph/spread.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/cast_by.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kTile = 32;  // pixels along each side
constexpr double kMostSlabs = 4096, kUsualSlabs = 16;

/// A range of t, in steps.
struct Steps {
    double begin = 0, end = 0;

    bool empty() const noexcept { return !(begin < end); }
};

struct PixelRange {
    double x0, y0, x1, y1;  // the outermost pixels
};

/// Steps in which some of the pixels may be inside the volume; may be too many. Along parallel rays
/// the place where a slab of the volume begins is linear in the pixel: corners bound it.
Steps inside_parallel(const kernels::RayCast& cast, const kernels::ParallelRays& shared,
                      const PixelRange& of) {
    constexpr double kAny = std::numeric_limits<double>::infinity();
    Steps in{-kAny, kAny};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (shared.inverse[axis] == 0) continue;
        double enters = kAny, leaves = -kAny;
        for (const double x : {of.x0, of.x1})
            for (const double y : {of.y0, of.y1})
                for (const double face :
                     {kernels::low_face(cast, axis), kernels::high_face(cast, axis)}) {
                    const double t =
                        (face - cast.rays.origin.at(x, y)[axis]) * shared.inverse[axis];
                    enters = std::min(enters, t);
                    leaves = std::max(leaves, t);
                }
        in.begin = std::max(in.begin, enters);
        in.end = std::min(in.end, leaves);
    }
    return in;
}

/// The same from an eye, of any pixels: from the place of the volume that is nearest to it to the
/// corner that is farthest.
Steps inside_from_eye(const kernels::RayCast& cast, const Request& want) {
    double nearest = 0, farthest = 0;  // squares
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const double eye = cast.rays.origin.base[a];
        const double low = kernels::low_face(cast, a) - eye,
                     high = kernels::high_face(cast, a) - eye;
        const double unit = want.spacing[axis] / want.unit;
        const double near = low > 0 ? low : std::min(high, 0.0);
        nearest += near * near * unit * unit;
        farthest += std::max(low * low, high * high) * unit * unit;
    }
    return {std::sqrt(nearest) / cast.step, std::sqrt(farthest) / cast.step};
}

/// What the tiles of a picture share.
class Fronts {
 public:
    Fronts(const kernels::RayCast& cast, const Request& want, const Region& picture, int slabs)
        : cast_(cast), shared_(cast), slabs_(slabs) {
        all_ = shared_.parallel ? inside_parallel(cast, shared_, pixels_of(picture))
                                : inside_from_eye(cast, want);
        all_.begin = std::floor(all_.begin);
        all_.end = std::max(all_.begin + 1, std::ceil(all_.end));
        slabs_ = static_cast<int>(std::min<double>(slabs_, all_.end - all_.begin));
    }

    int slabs() const noexcept { return slabs_; }

    /// Adds a slab to a tile of the picture.
    /// @param scratch  as many pixels as the tile has
    void add(int slab, const Region& tile, float* scratch, Data& out) const {
        const Extent size = tile.extent();
        float* const first = out.at<float>(tile.begin[0], tile.begin[1], 0);
        if (slab == 0) clear(first, size, out.row());
        const Steps steps = steps_of(slab);
        if (shared_.parallel) {
            const Steps in = inside_parallel(cast_, shared_, pixels_of(tile));
            if (in.end < steps.begin || in.begin > steps.end) return;
        }
        if (slab > 0 && all_opaque(first, size, out.row())) return;
        kernels::RayCast part = cast_;
        part.rays.start = std::max(cast_.rays.start, steps.begin * cast_.step);
        part.rays.end = steps.end * cast_.step;
        const std::ptrdiff_t row = 4 * size.x;
        kernels::ray_cast(part, tile.begin[0], tile.begin[1], size.x, size.y, scratch, row);
        for (std::int64_t y = 0; y < size.y; ++y) {
            float* to = first + y * out.row();
            const float* behind = scratch + y * row;
            for (std::int64_t i = 0; i < row; i += 4) {
                const float through = 1 - to[i + 3];
                for (int c = 0; c < 4; ++c) to[i + c] += through * behind[i + c];
            }
        }
    }

 private:
    static PixelRange pixels_of(const Region& tile) {
        return {static_cast<double>(tile.begin[0]), static_cast<double>(tile.begin[1]),
                static_cast<double>(tile.end[0] - 1), static_cast<double>(tile.end[1] - 1)};
    }
    static void clear(float* first, const Extent& size, std::ptrdiff_t row) {
        for (std::int64_t y = 0; y < size.y; ++y) std::fill_n(first + y * row, 4 * size.x, 0.0f);
    }
    static bool all_opaque(const float* first, const Extent& size, std::ptrdiff_t row) {
        for (std::int64_t y = 0; y < size.y; ++y)
            for (std::int64_t x = 0; x < size.x; ++x)
                if (!(1 - first[y * row + 4 * x + 3] < kTerminated)) return false;
        return true;
    }
    /// The first and the last slab are open, so that no rounding leaves out a sample.
    Steps steps_of(int slab) const {
        constexpr double kAny = std::numeric_limits<double>::infinity();
        const auto at = [&](int k) {
            return all_.begin + std::round((all_.end - all_.begin) * k / slabs_);
        };
        return {slab == 0 ? -kAny : at(slab), slab + 1 == slabs_ ? kAny : at(slab + 1)};
    }

    const kernels::RayCast& cast_;
    const kernels::ParallelRays shared_;
    Steps all_;
    int slabs_;
};

/// Why rays are not cast slab by slab; empty: they are.
std::string no_fronts(const Representation& from, const Ask& ask) {
    if (ask.want.mode->combine != Combine::over)
        return "nothing hides what lies behind it: there is no picture of what lies in front";
    if (is_spread(from)) return "over ranks: each has a box, not a depth";
    return {};
}

int slabs_of(const Parameters& with) { return static_cast<int>(with.number("slabs")); }

Work work_of_fronts(const Offer& offer, const Ask& ask, int view) {
    constexpr double kRay = 120, kJoin = 8;
    Work work = ray_cast().work(offer, ask, view);
    const auto pixels = static_cast<double>(offer.to.samples());
    // A tile of parallel rays knows which slabs it meets.
    const double slabs = slabs_of(offer.with);
    const Extent& n = offer.from.extent;
    const double longest =
        std::hypot(static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z));
    const double met =
        ask.want.eye
            ? slabs
            : std::min(slabs, 2 + slabs * mean_length(offer.from, ask.want, view) / longest);
    work.operations += (kRay + kJoin) * met * pixels;
    work.streamed += 2 * met * offer.to.bytes();
    work.scratch += 4.0 * sizeof(float) * static_cast<double>(kTile * kTile) + kArraySlack;
    return work;
}

Error error_of_fronts(const Offer& offer, const Ask& ask) {
    Error error = ray_cast().error(offer, ask);
    error.noise = std::hypot(error.noise, 0x1p-24 * std::sqrt(offer.with.number("slabs")));
    return error;
}

}  // namespace

Transition front_cast(FrontWatch watch) {
    Transition edge = ray_cast();
    edge.name = "project.front_cast";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "Wittenbrink 1993, Appendix B, 2.5";
    edge.parameters["slabs"] =
        number(1, kMostSlabs, {kUsualSlabs}, "pictures, each of a slab more");
    edge.on_demand = true;  // project.ray_cast makes the last picture for less
    edge.laws.clear();
    edge.plain.reset();
    if (watch) edge.plain = Parameters{{"step", 1.0}, {"slabs", kUsualSlabs}};
    edge.offer = [offer = edge.offer](const Representation& from, const Ask& ask,
                                      const Parameters& with) {
        if (std::string reason = no_fronts(from, ask); !reason.empty())
            return Offer::no(std::move(reason));
        if (with.number("slabs") != std::floor(with.number("slabs")))
            return Offer::no("slabs are whole");
        return offer(from, ask, with);
    };
    edge.work = work_of_fronts;
    edge.error = error_of_fronts;
    edge.model = {};
    edge.parts = [](const Offer&, const Ask&) { return Partition{}; };  // one depth for all rays
    edge.run = [watch = std::move(watch)](const Offer& offer, const Ask& ask, const Data& in,
                                          Data& out, const Region& region, Context& context) {
        const auto cast_region = [&](const kernels::RayCast& cast) {
            const Fronts fronts(cast, ask.want, region, slabs_of(offer.with));
            for (int slab = 0; slab < fronts.slabs(); ++slab) {
                for_tiles(region, kTile, kTile, context, [&](const Region& tile) {
                    Array scratch(4 * sizeof(float) * static_cast<std::size_t>(kTile * kTile),
                                  context.memory);
                    fronts.add(slab, tile, static_cast<float*>(scratch.data()), out);
                });
                // Tiles end early where the run is cancelled: then this is no picture.
                if (context.stopped()) return;
                if (watch && !watch({context.view, slab + 1, fronts.slabs(), out})) return;
            }
        };
        cast_by({.region = cast_region}, offer, ask, in, out, region, context);
    };
    return edge;
}

}  // namespace edgewise
