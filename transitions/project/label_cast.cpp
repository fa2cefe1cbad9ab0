#include "transitions/project/label_cast.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <optional>

#include "graph/label_surface.hpp"
#include "graph/spread.hpp"
#include "graph/with_type.hpp"
#include "transitions/project/no_rays.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr Fact kPassed{"label_cast/passed"}, kLit{"label_cast/lit"};
constexpr double kInfinite = std::numeric_limits<double>::infinity();

Vec3 vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// The first voxel of a ray with a label.
template <class T>
struct LabelHit {
    double t = 0;  // of its face
    Vec3 p = Vec3::Zero();
    T stored{};
    bool entered = false;  // where the ray enters what it sees
};

/// Rays of one view through labels of one type.
template <class T>
class LabelRays {
 public:
    LabelRays(const Data& in, const Request& want, int view)
        : want_(want),
          samples_(in.as<T>()),
          n_(in.what.extent),
          values_(in.what.values),
          rays_(rays_of(in.what, want, view)),
          kept_(kept_of(in.what, want, view)),
          strides_{1, n_.x, n_.x * n_.y} {}

    /// @param passed  grows by the voxels that are looked at
    std::optional<LabelHit<T>> first(double x, double y, double& passed) const {
        const Vec3 origin = vector_of(rays_.origin.at(x, y)),
                   along = vector_of(rays_.direction.at(x, y));
        double low = rays_.start, high = kInfinite;
        cut(origin, along, low, high);
        if (!(low < high)) return {};
        std::array<std::int64_t, 3> voxel, step;
        std::array<double, 3> next, inverse;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<int>(axis);
            const double p = std::floor(origin[a] + low * along[a] + 0.5);
            voxel[axis] =
                static_cast<std::int64_t>(std::clamp(p, 0.0, static_cast<double>(n_[a] - 1)));
            step[axis] = along[a] > 0 ? 1 : -1;
            inverse[axis] = std::abs(along[a]) < kAlongPlane ? 0 : 1 / along[a];
            next[axis] = leaves(voxel, step, inverse, origin, axis);
        }
        double at = low;
        for (;;) {
            const T stored = samples_[voxel[0] + strides_[1] * voxel[1] + strides_[2] * voxel[2]];
            passed += 1;
            if (is_label(want_, label_of(stored)))
                return LabelHit<T>{at, origin + at * along, stored, at == low};
            const double out = std::min({next[0], next[1], next[2]});
            if (!(out < high)) return {};
            at = std::max(at, out);
            // Through an edge or a corner: the voxels beside it are not passed.
            const double together = out + kTogether * (1 + std::abs(out));
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (next[axis] > together) continue;
                voxel[axis] += step[axis];
                if (voxel[axis] < 0 || voxel[axis] >= n_[static_cast<int>(axis)]) return {};
                next[axis] = leaves(voxel, step, inverse, origin, axis);
            }
        }
    }

    /// The gradient of the coverage of a label at p, but for its length. The B-spline is a sum of
    /// powers that begin at its knots: (2 - |x|)^3 - 4 (1 - |x|)^3, a sixth of it.
    Vec3 gradient(T stored, const Vec3& p) const {
        constexpr int kTaps = 4 * kCoverageWidth;
        std::array<std::int64_t, 3> base, begin, end;
        double weight[3][kTaps], slope[3][kTaps];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double place = p[static_cast<int>(axis)];
            const auto first = static_cast<std::int64_t>(std::ceil(place)) - kTaps / 2;
            begin[axis] = std::clamp<std::int64_t>(-first, 0, kTaps);
            end[axis] = std::clamp<std::int64_t>(n_[static_cast<int>(axis)] - first, 0, kTaps);
            base[axis] = first;
            for (int i = 0; i < kTaps; ++i) {
                const double x = (place - static_cast<double>(first + i)) / kCoverageWidth;
                const double near = std::abs(x), f = std::max(0.0, 2 - near),
                             g = std::max(0.0, 1 - near);
                weight[axis][i] = (f * f * f - 4 * g * g * g) / 6;
                slope[axis][i] = (x < 0 ? f * f - 4 * g * g : 4 * g * g - f * f) / 2;
            }
        }
        Vec3 sum = Vec3::Zero();
        for (std::int64_t k = begin[2]; k < end[2]; ++k)
            for (std::int64_t j = begin[1]; j < end[1]; ++j) {
                const std::int64_t row =
                    base[0] + strides_[1] * (base[1] + j) + strides_[2] * (base[2] + k);
                double along = 0, change = 0;
                for (std::int64_t i = begin[0]; i < end[0]; ++i) {
                    const bool is_there = samples_[row + i] == stored;
                    along += is_there ? weight[0][i] : 0;
                    change += is_there ? slope[0][i] : 0;
                }
                sum += Vec3(change * weight[1][j] * weight[2][k],
                            along * slope[1][j] * weight[2][k], along * weight[1][j] * slope[2][k]);
            }
        return sum;
    }

    double label_of(T stored) const { return values_(static_cast<double>(stored)); }
    /// Screen z of a place on a ray.
    double depth(double t) const {
        return want_.eye ? want_.eye->at.z() + t * (want_.eye->plane - want_.eye->at.z()) : t;
    }
    const Extent& extent() const { return n_; }

 private:
    static constexpr double kTogether = 1e-12;

    /// Where a ray leaves a voxel along one axis.
    static double leaves(const std::array<std::int64_t, 3>& voxel,
                         const std::array<std::int64_t, 3>& step,
                         const std::array<double, 3>& inverse, const Vec3& origin,
                         std::size_t axis) {
        if (inverse[axis] == 0) return kInfinite;
        const double face =
            static_cast<double>(voxel[axis]) + 0.5 * static_cast<double>(step[axis]);
        return (face - origin[static_cast<int>(axis)]) * inverse[axis];
    }

    /// Cuts a line to what rays see.
    void cut(const Vec3& origin, const Vec3& along, double& low, double& high) const {
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double from = kept_ ? kept_->low[a] : -0.5,
                         to = kept_ ? kept_->high[a] : static_cast<double>(n_[axis]) - 0.5;
            cut_by_plane(origin[axis] - from, along[axis], low, high);
            cut_by_plane(to - origin[axis], -along[axis], low, high);
        }
        if (!kept_) return;
        for (const kernels::Kept::Plane& plane : kept_->planes) {
            const Vec3 normal = vector_of(plane.normal);
            cut_by_plane(normal.dot(origin) + plane.offset, normal.dot(along), low, high);
        }
        for (const kernels::Kept::Ball& ball : kept_->balls)
            cut_by_ball(ball.from_centre({origin[0], origin[1], origin[2]}),
                        ball.turned({along[0], along[1], along[2]}), low, high);
    }

    const Request& want_;
    const T* samples_;
    const Extent n_;
    const ValueMap values_;
    const kernels::Rays rays_;
    const std::optional<kernels::Kept> kept_;
    const std::array<std::int64_t, 3> strides_;
};

/// What lights the hits of one view.
class LabelLight {
 public:
    LabelLight(const Representation& from, const Request& want, int view)
        : want_(want), steps_(want.pixel[0], want.pixel[1], 1) {
        const Eigen::Matrix3d to_input = residual(from, want, view).topLeftCorner<3, 3>().inverse();
        to_screen_ = steps_.cwiseInverse().asDiagonal() * to_input.transpose();
        nearest_ = want.cue ? nearest_corner(want, view) : 0;
    }

    template <class T>
    void put(const LabelRays<T>& rays, const LabelHit<T>& hit, double x, double y,
             float* out) const {
        Vec3 to_eye(0, 0, -1);
        if (want_.eye)
            to_eye =
                (want_.eye->at - Vec3(x, y, want_.eye->plane)).cwiseProduct(steps_).normalized();
        // On a clip's cut the surface faces the eye.
        Vec3 normal = to_eye;
        if (want_.shading.on() && (!hit.entered || on_face(rays.extent(), hit.p)))
            normal = to_screen_ * rays.gradient(hit.stored, hit.p);
        const Lit lit = want_.shading.at(normal, to_eye);
        const double left =
            want_.cue ? want_.cue->left((rays.depth(hit.t) - nearest_) * want_.unit) : 1;
        const std::array<double, 3> color = color_of_label(want_, rays.label_of(hit.stored));
        for (std::size_t c = 0; c < 3; ++c)
            out[c] = static_cast<float>((color[c] * lit.diffuse + lit.specular) * left);
        out[3] = 1;
    }

 private:
    const Request& want_;
    const Vec3 steps_;
    Eigen::Matrix3d to_screen_;
    double nearest_ = 0;
};

Offer offer_labels(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays()) return Offer::no("the result is a volume, not a picture");
    if (!shows_labels(ask.want)) return Offer::no("no surfaces of labels are asked for");
    if (std::string reason = no_rays(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (is_spread(from)) return Offer::no("over ranks: normals need samples of two boxes");
    if (from.values.slope == 0) return Offer::no("all stored numbers mean one value");
    if (!kernels::in_lanes(from.type))
        return Offer::no(fmt::format("{} samples are converted first", name_of(from.type)));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

Work work_labels(const Offer& offer, const Ask& ask, int view) {
    const auto pixels = static_cast<double>(offer.to.samples());
    // Where nobody has counted: half of the way through, by faces along three axes.
    constexpr double kShare = 0.5, kFaces = 1.5;
    const double passed = pixels * ask.scene.fact(kPassed).value_or(
                                       kShare * kFaces * mean_length(offer.from, ask.want, view));
    const double lit = ask.want.shading.on() ? pixels * ask.scene.fact(kLit).value_or(kShare) : 0;
    return {.operations = 60 * passed + 6000 * lit + 60 * pixels,
            .streamed = offer.to.bytes(),
            .gathers = passed + 512 * lit};
}

/// Counted on a lattice of pixels of the first view.
void count_labels(const Data& input, const Request& want, std::map<std::string, double>& facts,
                  std::pmr::memory_resource*) {
    const Scene nothing;
    if (!shows_labels(want) || !no_rays(input.what, {want, nothing}).empty() ||
        !kernels::in_lanes(input.what.type))
        return;
    with_type(input.what.type, [&](auto zero) {
        const LabelRays<decltype(zero)> rays(input, want, 0);
        constexpr int kSide = 24;
        double passed = 0, lit = 0;
        for (int j = 0; j < kSide; ++j)
            for (int i = 0; i < kSide; ++i) {
                const double x = (i + 0.5) / kSide * static_cast<double>(want.screen.x) - 0.5;
                const double y = (j + 0.5) / kSide * static_cast<double>(want.screen.y) - 0.5;
                lit += rays.first(x, y, passed).has_value();
            }
        facts[kPassed] = passed / (kSide * kSide);
        facts[kLit] = lit / (kSide * kSide);
    });
}

void run_labels(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
                Context& context) {
    const LabelLight light(offer.from, ask.want, context.view);
    with_type(in.what.type, [&](auto zero) {
        const LabelRays<decltype(zero)> rays(in, ask.want, context.view);
        constexpr std::int64_t kSide = 32;
        for_tiles(region, kSide, kSide, context, [&](const Region& tile) {
            double passed = 0;
            for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y)
                for (std::int64_t x = tile.begin[0]; x < tile.end[0]; ++x) {
                    float* const pixel = out.at<float>(x, y, 0);
                    const auto px = static_cast<double>(x), py = static_cast<double>(y);
                    const auto hit = rays.first(px, py, passed);
                    if (hit)
                        light.put(rays, *hit, px, py, pixel);
                    else
                        std::fill_n(pixel, 4, 0.0F);
                }
        });
    });
}

}  // namespace

Transition label_cast() {
    Transition edge;
    edge.name = "project.label_cast";
    edge.source = "Amanatides, Woo, A fast voxel traversal algorithm, Eurographics 1987";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.offer = offer_labels;
    edge.work = work_labels;
    edge.count = count_labels;
    edge.parts = [](const Offer& offer, const Ask&) -> Partition {
        return {.kind = Partition::output, .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
    };
    edge.run = run_labels;
    edge.trials = []() -> std::vector<Trial> {
        return {of_labels(surface_trial("phantom:shepp-logan:64")),
                of_labels(surface_trial("phantom:shepp-logan:124"))};
    };
    edge.factors = {{"", 2.4}};
    return edge;
}

}  // namespace edgewise
