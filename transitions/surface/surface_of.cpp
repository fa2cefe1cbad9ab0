#include "transitions/surface/surface_of.hpp"

#include <cmath>
#include <fmt/format.h>

#include "surface/level.hpp"
#include "surface/mesh.hpp"

namespace edgewise {
std::string no_surface(const Representation& from, const Request& want, bool labels) {
    if (!want.surface) return "no surface is asked for";
    if (want.job->of_rays() && !want.mode->first_hit)
        return "the mode asks for more than a surface";
    if (want.surface->isovalue.has_value() == labels)
        return labels ? "an isosurface is asked for" : "surfaces of labels are asked for";
    if (from.extent != want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return "the surface would end where samples were left out";
    if (from.layout != Layout::linear || from.place != Place::memory)
        return "needs samples in memory, row by row";
    if (from.axes != 3 || from.channels != 1)
        return fmt::format("{} axes and {} channels; needs 3 and 1", from.axes, from.channels);
    if (labels ? from.type == Type::f16 || from.type == Type::c64 : !surface::can_be_cut(from.type))
        return fmt::format("{} samples are converted first", name_of(from.type));
    if (from.values.slope == 0) return "all stored numbers mean one value";
    if (want.projective()) return "the samples do not lie at even distances";
    return {};
}

Representation mesh_of(const Representation& from, const Request& want, double vertices,
                       bool labelled) {
    Representation to = from;
    to.content = "mesh";
    to.facets.clear();
    to.extent = {1, 1, 1};
    to.type = Type::u8;
    to.values = {};
    to.facet_bytes = surface::Mesh::bytes(vertices, 2 * vertices, labelled);
    // A mesh that is drawn stays where its samples are; one that is wanted lies as the view says.
    if (!want.job->of_rays()) to.placed = want.views;
    return to;
}

Mat4 place_of(const Offer& offer, const Request& want, int view) {
    return want.job->of_rays() ? Mat4(Mat4::Identity()) : residual(offer.from, want, view);
}

double vertices_of(const Ask& ask, const Fact& fact, const Representation& from) {
    // Of every fourth slice; those between may have more.
    constexpr double kMargin = 1.25;
    if (const auto counted = ask.scene.fact(fact)) return kMargin * *counted;
    // A few smooth surfaces as large as the volume's faces.
    return 6 * std::pow(static_cast<double>(from.samples()), 2.0 / 3);
}

}  // namespace edgewise
