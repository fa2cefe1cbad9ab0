#include "transitions/surface/nets.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/written.hpp"
#include "surface/level.hpp"
#include "surface/mesh.hpp"
#include "surface/nets.hpp"
#include "transitions/surface/surface_of.hpp"

namespace edgewise {
namespace {

constexpr const char* kVertices = "nets/vertices";
constexpr double kSteps = 16, kMostSteps = 1000;

/// In a picture labels that reach the volume's faces are closed there: by a frame of background,
/// one sample wide. A mesh that is wanted ends there.
bool closes_faces(const Request& want) { return want.job->of_rays(); }

Representation framed(Representation what) {
    for (int axis = 0; axis < 3; ++axis) what.extent[axis] += 2;
    return what;
}

/// The samples within such a frame. What is not finite is background as well.
Data framed(const Data& in, double background, std::pmr::memory_resource* memory) {
    Data out = Data::make(framed(in.what), memory);
    const Extent n = out.what.extent;
    surface::with_cut_type(in.what.type, [&](auto zero) {
        using T = decltype(zero);
        const auto outside =
            static_cast<T>((background - in.what.values.offset) / in.what.values.slope);
        tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
            for (std::int64_t y = 0; y < n.y; ++y) {
                T* const to = out.at<T>(0, y, z);
                std::fill_n(to, n.x, outside);
                if (y == 0 || z == 0 || y == n.y - 1 || z == n.z - 1) continue;
                const T* const from = in.at<T>(0, y - 1, z - 1);
                for (std::int64_t x = 0; x < n.x - 2; ++x)
                    if (std::isfinite(static_cast<float>(from[x]))) to[x + 1] = from[x];
            }
        });
    });
    return out;
}

/// Samples on the volume's faces that hold labels: each gets a part of a surface more, about one
/// vertex.
double labels_on_faces(const Data& in, double background) {
    const Extent n = in.what.extent;
    return surface::with_cut_type(in.what.type, [&](auto zero) {
        using T = decltype(zero);
        std::int64_t count = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (const std::int64_t at : {std::int64_t{0}, n[axis] - 1}) {
                Region face = Region::all(n);
                face.begin[axis] = at;
                face.end[axis] = at + 1;
                for (std::int64_t z = face.begin[2]; z < face.end[2]; ++z)
                    for (std::int64_t y = face.begin[1]; y < face.end[1]; ++y)
                        for (std::int64_t x = face.begin[0]; x < face.end[0]; ++x) {
                            const auto stored = static_cast<double>(*in.at<T>(x, y, z));
                            count += in.what.values(stored) != background;
                        }
            }
        // Where the surface turns to another face it has vertices of its own.
        constexpr double kEdges = 1.5, kLeast = 8;
        return kEdges * static_cast<double>(count) + kLeast;
    });
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_surface(from, ask.want, true); !reason.empty())
        return Offer::no(std::move(reason));
    if (closes_faces(ask.want) && !can_store(from.type, from.values, ask.want.outside))
        return Offer::no(fmt::format("no stored number means {}, which closes labels at the faces",
                                     ask.want.outside));
    const double vertices = vertices_of(ask, kVertices, from);
    return {.from = from, .to = mesh_of(from, ask.want, vertices, true), .with = with};
}

Work work(const Offer& offer, const Ask& ask, int) {
    const auto samples = static_cast<double>(offer.from.samples());
    const double vertices = vertices_of(ask, kVertices, offer.from);
    const double steps = offer.with.number("smooth");
    const double frame = closes_faces(ask.want) ? framed(offer.from).bytes() : 0;
    constexpr double kAlone = 8;  // one by one: vectors hold eight
    return {.operations = 4 * samples + kAlone * (400 + 45 * steps) * vertices,
            .streamed = 4 * offer.from.bytes() + 2 * frame +
                        surface::Mesh::bytes(vertices, 2 * vertices, true),
            .gathers = (20 + 5 * steps) * vertices,
            .workspace = frame + surface::nets_scratch(offer.from, vertices, ask.want.threads)};
}

void count(const Data& input, const Request& want, std::map<std::string, double>& facts,
           std::pmr::memory_resource*) {
    if (!no_surface(input.what, want, true).empty()) return;
    facts[kVertices] = surface::expected_net_vertices(input, want.outside) +
                       (closes_faces(want) ? labels_on_faces(input, want.outside) : 0);
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    const int steps = static_cast<int>(offer.with.number("smooth"));
    Mat4 place = place_of(offer, ask.want, context.view);
    const auto poll = [&] { context.poll(); };
    if (!closes_faces(ask.want)) {
        surface::put_mesh(
            out, surface::surface_nets(in, ask.want.outside, steps, place, context.memory, poll));
        return;
    }
    place.topRightCorner<3, 1>() -= place.topLeftCorner<3, 3>() * Vec3::Ones();
    const Data within = framed(in, ask.want.outside, context.memory);
    surface::put_mesh(
        out, surface::surface_nets(within, ask.want.outside, steps, place, context.memory, poll));
}

}  // namespace

Transition surface_nets_edge() {
    return {
        .name = "surface.nets",
        .source = "Gibson: Constrained elastic surface nets, MICCAI 1998",
        .joins = {{"object/scalar", "object/mesh"}},
        .parameters = {{"smooth", number(0, kMostSteps, {kSteps},
                                         "steps towards the mean of the neighbours")}},
        .offer = offer,
        .work = work,
        .error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; },
        .count = count,
        .run = run,
    };
}

}  // namespace edgewise
