#include "transitions/surface/nets.hpp"

#include "surface/label_groups.hpp"
#include "surface/mesh.hpp"
#include "surface/nets.hpp"
#include "transitions/surface/surface_of.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr Fact kVertices{"nets/vertices"};
constexpr double kSmooth = 1;

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_surface(from, ask.want, true); !reason.empty())
        return Offer::no(std::move(reason));
    const double vertices = vertices_of(ask, kVertices, from);
    return {.from = from, .to = mesh_of(from, ask.want, vertices, true), .with = with};
}

Work work(const Offer& offer, const Ask& ask, int) {
    const auto samples = static_cast<double>(offer.from.samples());
    const double vertices = vertices_of(ask, kVertices, offer.from);
    const double smoothing = offer.with.number("smooth") > 0 ? 1 : 0;
    constexpr double kAlone = 8;  // one by one: vectors hold eight
    return {.operations = 8 * samples + kAlone * (300 + 3700 * smoothing) * vertices,
            .streamed = 4 * offer.from.bytes() + 2 * surface::group_bytes(offer.from) +
                        surface::Mesh::bytes(vertices, 2 * vertices, true),
            .gathers = (15 + 290 * smoothing) * vertices,
            .workspace = surface::nets_scratch(offer.from, vertices, ask.want.threads)};
}

void count(const Data& input, const Request& want, std::map<std::string, double>& facts,
           std::pmr::memory_resource*) {
    if (no_surface(input.what, want, true).empty())
        facts[kVertices] = surface::expected_net_vertices(input, want.outside);
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    surface::put_mesh(out, surface::surface_nets(in, ask.want.outside, offer.with.number("smooth"),
                                                 place_of(offer, ask.want, context.view),
                                                 context.memory, [&] { context.poll(); }));
}

}  // namespace

Transition surface_nets_edge() {
    return {
        .name = "surface.nets",
        .source = "Gibson: Constrained elastic surface nets, MICCAI 1998",
        .joins = {{"object/scalar", "object/mesh"}},
        .parameters = {{"smooth",
                        number(0, 1, {kSmooth}, "how far vertices may go: of half a sample")}},
        .offer = offer,
        .work = work,
        .error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; },
        .count = count,
        .run = run,
        .trials = []() -> std::vector<Trial> {
            return {of_labels(mesh_trial("phantom:shepp-logan:64")),
                    of_labels(mesh_trial("phantom:shepp-logan:124"))};
        },
        .factors = {{"", 2.4}},
    };
}

}  // namespace edgewise
