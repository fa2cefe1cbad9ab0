#include "transitions/shade/classify.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

constexpr int kChannels = 4;

/// What samples of one representation become.
Representation colored_of(const Representation& from) {
    Representation to = from;
    to.content = "colored";
    to.channels = kChannels;
    to.type = Type::f32;
    to.values = {};
    to.facets.clear();
    to.facet_bytes = 0;
    return to;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Request& want = ask.want;
    if (!want.job->of_rays() || !want.mode->takes_transfer)
        return Offer::no("the mode has no transfer function");
    if (want.eye) return Offer::no("the eye is at a finite distance: rays are not parallel to z");
    if (want.cue) return Offer::no("light falls off along rays");
    if (want.shading.has_shade()) return Offer::no("shadows are worked out along rays");
    if (!want.clips.empty()) return Offer::no("the clip cuts between samples");
    if (want.transfer.table)
        return Offer::no("opacities go with gradients between samples, which are classified first");
    if (want.smooths_gradients())
        return Offer::no("takes its gradients from central differences; smoothed were asked for");
    if (want.shading.on() && want.views.different() > 1)
        return Offer::no("light differs from view to view");
    if (from.axes != 3 || from.channels != 1) return Offer::no("of volumes of one channel only");
    if (!is_whole(from)) return Offer::no("needs all samples in memory, row by row");
    if (!kernels::scalar_load(from.type)) return Offer::no("complex samples have no opacity");
    if (ask.scene.non_finite > 0)
        return Offer::no("samples that are not finite have no colour, and a warp spreads that");
    return {.from = from, .to = colored_of(from), .with = with};
}

Work work(const Offer& offer, const Ask& ask, int) {
    const auto samples = static_cast<double>(offer.from.samples());
    const auto points = static_cast<double>(ask.want.transfer.points.size());
    const double light =
        ask.want.shading.on() ? 60 + 40 * static_cast<double>(ask.want.shading.lights.size()) : 0;
    return {.operations = samples * (20 + 4 * points + light),
            .streamed = offer.from.bytes() + offer.to.bytes(),
            .gathers = ask.want.needs_gradients() ? 6 * samples : 0};
}

/// How values become colour and opacity, and what of them surfaces are found by.
struct Classifier {
    std::array<double, 4> (*optics)(const Transfer& transfer, double value);
    double (*density)(const Transfer& transfer, double value);
    /// A density's range over that of the values.
    double (*scale)(const Transfer& transfer);
};

constexpr Classifier kByPoints = {
    [](const Transfer& transfer, double value) { return transfer.at(value); },
    [](const Transfer&, double value) { return value; }, [](const Transfer&) { return 1.0; }};

/// A sample holds at most two materials, the neighbouring points of the transfer function, in
/// shares that follow from its value. What they emit and what they hide is added by shares;
/// surfaces lie where what is hidden changes.
constexpr Classifier kByMaterials = {
    [](const Transfer& transfer, double value) -> std::array<double, 4> {
        const std::vector<Transfer::Point>& points = transfer.points;
        const auto above = std::find_if(points.begin(), points.end(),
                                        [&](const auto& point) { return point.value > value; });
        if (above == points.begin() || above == points.end()) return transfer.at(value);
        const Transfer::Point &a = *(above - 1), &b = *above;
        const double share = (value - a.value) / (b.value - a.value);
        const double of_a = (1 - share) * a.opacity, of_b = share * b.opacity;
        std::array<double, 4> mixed{0, 0, 0, of_a + of_b};
        for (std::size_t c = 0; c < 3 && mixed[3] > 0; ++c)
            mixed[c] = (of_a * a.color[c] + of_b * b.color[c]) / mixed[3];
        return mixed;
    },
    [](const Transfer& transfer, double value) { return transfer.at(value)[3]; },
    [](const Transfer& transfer) {
        double least = 1, most = 0;
        for (const Transfer::Point& point : transfer.points) {
            least = std::min(least, point.opacity);
            most = std::max(most, point.opacity);
        }
        const double values = transfer.points.back().value - transfer.points.front().value;
        return values > 0 ? std::max(0.0, most - least) / values : 1.0;
    }};

/// One slice, sample by sample in f64.
void classify(const Data& in, const Request& want, int view, std::int64_t z, Data& out,
              const Classifier& by) {
    const Extent& n = in.what.extent;
    const kernels::ScalarLoad load = kernels::scalar_load(in.what.type);
    const ValueMap& values = in.what.values;
    const auto value = [&](std::int64_t x, std::int64_t y, std::int64_t k) {
        return values(static_cast<double>(load(in.samples.data(), (k * n.y + y) * n.x + x)));
    };
    const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t k) {
        return by.density(want.transfer, value(x, y, k));
    };
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    const Eigen::Matrix3d to_input = residual(in.what, want, view).topLeftCorner<3, 3>().inverse();
    const Eigen::Matrix3d to_screen = steps.cwiseInverse().asDiagonal() * to_input.transpose();
    const Eigen::Matrix3d placed = in.what.placed.at(view).inverse().matrix().topLeftCorner<3, 3>();
    const Vec3 per_length =
        (want.spacing.asDiagonal() * placed).colwise().norm().transpose().cwiseInverse();
    const bool gradients = want.needs_gradients();
    Shading shading = want.shading;
    shading.least *= by.scale(want.transfer);
    for (std::int64_t y = 0; y < n.y; ++y)
        for (std::int64_t x = 0; x < n.x; ++x) {
            const std::array<double, 4> optics = by.optics(want.transfer, value(x, y, z));
            Lit lit;
            double opacity = optics[3];
            if (opacity > 0 && (gradients || want.shading.on())) {
                Vec3 gradient = Vec3::Zero();
                if (gradients) {
                    const auto lower = [](std::int64_t i) {
                        return std::max<std::int64_t>(i - 1, 0);
                    };
                    const auto upper = [](std::int64_t i, std::int64_t end) {
                        return std::min(i + 1, end - 1);
                    };
                    gradient = Vec3(at(upper(x, n.x), y, z) - at(lower(x), y, z),
                                    at(x, upper(y, n.y), z) - at(x, lower(y), z),
                                    at(x, y, upper(z, n.z)) - at(x, y, lower(z))) /
                               2;
                }
                lit = shading.at(to_screen * gradient, Vec3(0, 0, -1));
                opacity *= want.transfer.edge_at(gradient.cwiseProduct(per_length).norm());
            }
            auto* to = out.at<float>(x, y, z);
            for (std::size_t c = 0; c < 3; ++c)
                to[c] = static_cast<float>(opacity * (optics[c] * lit.diffuse + lit.specular));
            to[3] = static_cast<float>(opacity);
        }
}

template <const Classifier& by>
void run(const Offer&, const Ask& ask, const Data& in, Data& out, const Region&, Context& context) {
    tbb::parallel_for(std::int64_t{0}, in.what.extent.z, [&](std::int64_t z) {
        if (!context.stopped()) classify(in, ask.want, context.view, z, out, by);
    });
    context.poll();
}

Offer offer_materials(const Representation& from, const Ask& ask, const Parameters& with) {
    Offer made = offer(from, ask, with);
    if (made.refused.empty() && !ask.want.transfer.edges.empty())
        return Offer::no("opacities go with the gradient of values, which materials replace");
    return made;
}

}  // namespace

Transition shade_classify() {
    Transition edge;
    edge.name = "shade.classify";
    edge.source = "Wittenbrink 1993, 4.1.1 to 4.1.3, FIGURE 57; Levoy 1988";
    edge.joins = {{"object/scalar", "object/colored"}};
    edge.offer = offer;
    edge.work = work;
    edge.error = [](const Offer&, const Ask&) -> Error { return {}; };
    edge.on_demand = true;
    edge.run = run<kByPoints>;
    return edge;
}

Transition shade_materials() {
    Transition edge = shade_classify();
    edge.name = "shade.materials";
    edge.source = "Drebin, Carpenter, Hanrahan, Volume rendering, SIGGRAPH 1988";
    edge.offer = offer_materials;
    edge.error = {};
    edge.run = run<kByMaterials>;
    return edge;
}

}  // namespace edgewise
