#include "transitions/surface/draw.hpp"

#include "graph/errors.hpp"
#include "graph/label_surface.hpp"
#include "surface/draw.hpp"
#include "surface/mesh.hpp"
#include "transitions/surface/surface_of.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.mode->first_hit) return Offer::no("the mode asks for more than a surface");
    if (ask.want.projective()) return Offer::no("a projective map of a volume");
    if (from.placed.one_a_view() || from.placed.at(0).matrix() != Mat4::Identity())
        return Offer::no("the mesh does not lie in the input's own space");
    if (shows_labels(ask.want) && !ask.want.clips.empty())
        return Offer::no(
            "a clip closes the labels that it cuts, and the mesh has no surface there");
    if (ask.want.smooths_gradients() && !shows_labels(ask.want))
        return Offer::no("normals are the mesh's own; smoothed gradients were asked for");
    if (with.word("light") == "vertex" && !ask.want.shading.on())
        return Offer::no("nothing is lit, so light=vertex is light=pixel");
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

/// Vertices of a mesh by the bytes that it takes.
double vertices_in(const Representation& mesh) {
    return mesh.facet_bytes / surface::Mesh::bytes(1, 2, false);
}

Work work(const Offer& offer, const Ask&, int) {
    const double vertices = vertices_in(offer.from), triangles = 2 * vertices;
    const auto pixels = static_cast<double>(offer.to.samples());
    constexpr double kCovered = 4;  // centres around a triangle that are looked at, each way twice
    constexpr double kAlone = 8;    // one by one: vectors hold eight
    return {
        .operations = kAlone * (30 * vertices + (60 + 20 * kCovered) * triangles + 150 * pixels),
        .streamed = 32 * vertices + 12 * triangles + offer.to.bytes(),
        .gathers = 3 * 4 * triangles,
        .workspace = surface::drawing_scratch(vertices, triangles, offer.to.extent)};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const auto mesh = surface::mesh_in(in);
    if (!mesh) throw RunError("surface.draw: the path has made no surface");
    const surface::Drawing drawing{mesh.get(), &ask.want, context.view,
                                   offer.with.word("light") == "vertex"};
    surface::draw(drawing, region, out.at<float>(region.begin[0], region.begin[1], 0), out.row(),
                  context.memory, [&] { context.poll(); });
}

}  // namespace

Transition draw_edge() {
    return {
        .name = "surface.draw",
        .source = "Wittenbrink 1993, 4.2.3; Catmull 1974; Gouraud 1971; Phong 1975",
        .joins = {{"object/mesh", "screen/picture"}},
        .parameters = {{"light", one_of({"pixel", "vertex"}, {std::string("pixel")},
                                        "where light is worked out")}},
        .offer = offer,
        .work = work,
        .run = run,
        .trials = []() -> std::vector<Trial> {
            return {surface_trial("phantom:gaussians:112"),
                    of_labels(surface_trial("phantom:shepp-logan:64")),
                    of_labels(surface_trial("phantom:shepp-logan:124"))};
        },
        .factors = {{"", 2}},
    };
}

}  // namespace edgewise
