#include "transitions/spectrum/gradients.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/kernels/volume_slopes.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

Request without_light(const Request& want) {
    Request plain = want;
    plain.shading = Shading{};
    return plain;
}

int degree_in(const Parameters& with) { return static_cast<int>(with.number("degree")); }

/// What the square of a gradient's length is of: g . metric g.
Eigen::Matrix3d metric_of(const Representation& from, const Request& want, int view) {
    const Eigen::Matrix3d to_screen = gradients_to_screen(from, want, view);
    return to_screen.transpose() * to_screen;
}

/// Whether lengths of gradients are the same in all views.
bool keeps_lengths(const Representation& from, const Request& want) {
    constexpr double kSame = 1e-6;
    const Eigen::Matrix3d first = metric_of(from, want, 0);
    for (int variant = 1; variant < want.views.different(); ++variant) {
        const Eigen::Matrix3d other = metric_of(from, want, want.views.first_view(variant));
        if (!((other - first).norm() <= kSame * first.norm())) return false;
    }
    return true;
}

Offer gradients_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_lit_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const double degree = with.number("degree");
    if (degree != 1 && degree != 2)
        return Offer::no(fmt::format("a degree of {}: harmonics are of degree 1 or 2", degree));
    if (degree == 2 && ask.want.shading.by == Shade::hemisphere)
        return Offer::no("light from a hemisphere is of degree 1");
    Offer offer = gradient_spectra().offer(from, {without_light(ask.want), ask.scene}, with);
    if (!offer.refused.empty()) return offer;
    if (!keeps_lengths(from, ask.want))
        return Offer::no(
            "views that stretch the volume: gradients are longer in some than in others");
    return offer;
}

Work gradients_work(const Offer& offer, const Ask& ask, int view) {
    // Of each axis two recursions of two operations, three more to begin with, and a difference;
    // then lengths. Products of degree 2 take a quotient and two products each.
    constexpr double kSlope = 9, kLength = 16, kProduct = 3;
    const Request plain = without_light(ask.want);
    Work work = gradient_spectra().work(offer, {plain, ask.scene}, view);
    const double voxels = static_cast<double>(offer.from.samples()),
                 products = gradient_spectra().count(degree_in(offer.with)) - 1;
    work.operations += voxels * (3 * kSlope + products * (kLength + kProduct));
    // Slopes are written, filtered and differenced; each product reads three of them.
    work.streamed += 3 * (offer.from.bytes() + 24 * voxels) + products * 20 * voxels;
    work.workspace += 16 * voxels;
    return work;
}

/// The length of a gradient, or a product of two of its components over it.
struct Product {
    const Eigen::Matrix3d& metric;
    int i = -1, j = -1;  // below 0: the length

    float operator()(const double (&g)[3]) const {
        const Eigen::Vector3d gradient(g[0], g[1], g[2]);
        const double length = std::sqrt(gradient.dot(metric * gradient));
        if (i < 0) return static_cast<float>(length);
        return length > 0 ? static_cast<float>(g[i] * g[j] / length) : 0.0F;
    }
};

void multiply(const Extent& n, const float* const (&slopes)[3], const Product& product, float* out,
              Context& context) {
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        if (context.stopped()) return;
        for (std::int64_t i = row * n.x; i < (row + 1) * n.x; ++i)
            out[i] = product({slopes[0][i], slopes[1][i], slopes[2][i]});
    });
    context.poll();
}

void gradients_run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
                   Context& context) {
    using kernels::Block;
    const kernels::SpectrumShape shape = SeveralSpectra::shape_of(offer);
    const int degree = degree_in(offer.with);
    const Extent& n = in.what.extent;
    const auto voxels = static_cast<std::size_t>(in.what.samples());
    const auto stopped = [&] { return context.stopped(); };
    auto* spectrum = out.as<kernels::Complex>();
    const auto add = [&](const kernels::Grid& volume, double subtract) {
        kernels::spectrum_of_volume(volume, subtract, shape, spectrum, context.memory, stopped);
        context.poll();
        spectrum += shape.stored().samples();
    };
    const double common = offer.to.values.offset;
    add(kernels::grid_of(in), common);
    Block<float> x(voxels, context.memory), y(voxels, context.memory), z(voxels, context.memory),
        product(voxels, context.memory);
    float* const made[3] = {x.data(), y.data(), z.data()};
    const auto by = ask.want.field == Field::linear ? kernels::SlopesOf::differences
                                                    : kernels::SlopesOf::spline;
    for (int axis = 0; axis < 3; ++axis) {
        kernels::volume_slopes(kernels::grid_of(in), axis, by, common, made[axis], context.memory,
                               stopped);
        context.poll();
    }
    const float* const slopes[3] = {made[0], made[1], made[2]};
    const Eigen::Matrix3d metric = metric_of(offer.from, ask.want, 0);
    const kernels::Grid products{product.data(), Type::f32, n, 1, {}};
    for (int k = 0; k + 1 < gradient_spectra().count(degree); ++k) {
        Product of{metric};
        if (degree == 2)
            std::tie(of.i, of.j) = std::pair(kAxesOfProducts[k][0], kAxesOfProducts[k][1]);
        multiply(n, slopes, of, product.data(), context);
        add(products, 0);
    }
    SeveralSpectra::name_facets(offer, out);
}

}  // namespace

LightHarmonics::LightHarmonics(Shade by, int degree) noexcept {
    if (by != Shade::lambert) return;
    // max(0, c) = c / 2 + |c| / 2. Over the sphere |c| is nearest to 1/2, or to 3/16 + 15/16 c^2,
    // and farthest from either at c = 0.
    even0 = degree == 1 ? 1. / 4 : 3. / 32;
    even2 = degree == 1 ? 0 : 15. / 32;
    largest = degree == 1 ? 1. / 4 : 3. / 32;
}

std::string no_lit_projection(const Ask& ask) {
    const Request& want = ask.want;
    if (!want.shading.on()) return "no light falls on samples: one spectrum has it all";
    if (!want.shading.of_sums())
        return message("@shade({}) is no sum over samples", name_of(want.shading.by)).marked();
    if (want.smooths_gradients())
        return "spectra are those of the field's own gradients; smoothed ones were asked for";
    return no_projection({without_light(want), ask.scene});
}

Eigen::Matrix3d gradients_to_screen(const Representation& from, const Request& want, int view) {
    const Eigen::Matrix3d to_input = residual(from, want, view).topLeftCorner<3, 3>().inverse();
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    return steps.cwiseInverse().asDiagonal() * to_input.transpose();
}

const SeveralSpectra& gradient_spectra() {
    static constexpr SeveralSpectra spectra{
        .content = "gradients", .most_degree = 2, .count = [](int degree) {
            return degree == 1 ? 2 : 1 + static_cast<int>(kAxesOfProducts.size());
        }};
    return spectra;
}

Transition spectrum_gradients() {
    Transition edge;
    edge.name = "spectrum.gradients";
    edge.source = "Levoy 1992; Totsuka, Levoy 1993; counts of FFTW's manual";
    for (const std::string& kind : gradient_spectra().kinds())
        edge.joins.emplace_back("object/scalar", kind);
    edge.parameters =
        gradient_spectra().parameters("of the harmonics that light is made of: 2 for lambert");
    edge.on_demand = true;  // its error is measured by making pictures
    edge.offer = gradients_offer;
    edge.work = gradients_work;
    edge.run = gradients_run;
    return edge;
}

}  // namespace edgewise
