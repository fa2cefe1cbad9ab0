#include "transitions/surface/flying_edges.hpp"

#include "surface/flying_edges.hpp"
#include "surface/lids.hpp"
#include "surface/mesh.hpp"
#include "transitions/surface/surface_of.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr Fact kVertices{"surface/vertices"};

bool has_lids(const Request& want) {
    const auto* setting = want.setting.as<surface::MeshSetting>();
    return setting && setting->lids;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_surface(from, ask.want, false); !reason.empty())
        return Offer::no(std::move(reason));
    const double vertices = vertices_of(ask, kVertices, from);
    return {.from = from, .to = mesh_of(from, ask.want, vertices, false), .with = with};
}

Work work(const Offer& offer, const Ask& ask, int) {
    const auto samples = static_cast<double>(offer.from.samples());
    const double vertices = vertices_of(ask, kVertices, offer.from), triangles = 2 * vertices;
    constexpr double kAlone = 8;  // one by one: vectors hold eight
    return {.operations = samples + kAlone * (140 * vertices + 30 * triangles),
            .streamed = offer.from.bytes() + surface::Mesh::bytes(vertices, triangles, false),
            .gathers = 14 * vertices,
            .workspace = surface::flying_edges_scratch(offer.from) +
                         (has_lids(ask.want) ? surface::frame_bytes(offer.from) : 0)};
}

void count(const Data& input, const Request& want, std::map<std::string, double>& facts,
           std::pmr::memory_resource* memory) {
    if (no_surface(input.what, want, false).empty())
        facts[kVertices] = surface::expected_vertices(input, *want.surface->isovalue, memory);
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    const double isovalue = *ask.want.surface->isovalue;
    const Mat4 place = place_of(offer, ask.want, context.view);
    const auto poll = [&] { context.poll(); };
    if (!has_lids(ask.want)) {
        surface::put_mesh(out, surface::flying_edges(in, isovalue, place, context.memory, poll));
        return;
    }
    Mat4 unframed = Mat4::Identity();
    unframed.topRightCorner<3, 1>().setConstant(-1);
    const Data framed = surface::with_frame(in, context.memory);
    surface::put_mesh(
        out, surface::flying_edges(framed, isovalue, place * unframed, context.memory, poll));
}

std::vector<Trial> trials() {
    std::vector<Trial> all;
    for (const char* input : {"phantom:gaussians:64", "phantom:gaussians:112"})
        for (const Type type : {Type::u8, Type::f32}) all.push_back(mesh_trial(input, type));
    return all;
}

}  // namespace

Transition flying_edges_edge() {
    return {
        .name = "surface.flying_edges",
        .source = "Schroeder, Maynard, Geveci: Flying Edges, LDAV 2015",
        .joins = {{"object/scalar", "object/mesh"}},
        .offer = offer,
        .work = work,
        .error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; },
        .count = count,
        .run = run,
        .trials = trials,
        .factors = {{"", 1.4}},
    };
}

}  // namespace edgewise
