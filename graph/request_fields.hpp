#pragma once

#include "graph/filtering.hpp"
#include "graph/fingerprint.hpp"
#include "graph/request.hpp"
#include "graph/transfer_table.hpp"

namespace edgewise {

// The members of a request, by name and in order. A member that is new in one of these types and
// not named here does not compile: so no fingerprint forgets one.

/// By name: one process's addresses are not another's.
inline void add_to(Fingerprint& to, Mode mode) { to.add(mode->name); }
inline void add_to(Fingerprint& to, Job job) { to.add(job->name); }
/// Matrices; of a deformation nothing is known.
inline void add_to(Fingerprint& to, const Transform& map) {
    const Mat4* matrix = map.as_matrix();
    matrix ? static_cast<void>(to.add(*matrix)) : to.cannot_tell();
}
inline void add_to(Fingerprint& to, const Placement& placed) {
    to.add(placed.different()).add(placed.one_a_view());
    for (int variant = 0; variant < placed.different(); ++variant)
        to.add(placed.first_view(variant)).add(placed.at(placed.first_view(variant)));
}

template <Either<WrittenAs> T, class F>
void visit_fields(T& written, F&& f) {
    auto& [type, values, straight, opaque] = written;
    f("type", type), f("values", values), f("straight", straight), f("opaque", opaque);
}

template <Either<Eye> T, class F>
void visit_fields(T& eye, F&& f) {
    auto& [at, plane, width, height] = eye;
    f("at", at), f("plane", plane), f("width", width), f("height", height);
}

template <Either<HalfSpace> T, class F>
void visit_fields(T& half, F&& f) {
    auto& [normal, offset] = half;
    f("normal", normal), f("offset", offset);
}

template <Either<Ball> T, class F>
void visit_fields(T& ball, F&& f) {
    auto& [centre, to_unit] = ball;
    f("centre", centre), f("to_unit", to_unit);
}

template <Either<Clip> T, class F>
void visit_fields(T& clip, F&& f) {
    auto& [low, high, planes, balls, least, most, volume] = clip;
    f("low", low), f("high", high), f("planes", planes), f("balls", balls);
    f("least", least), f("most", most), f("volume", volume);
}

template <Either<Transfer::Point> T, class F>
void visit_fields(T& point, F&& f) {
    auto& [value, opacity, color] = point;
    f("value", value), f("opacity", opacity), f("color", color);
}

template <Either<Transfer::Edge> T, class F>
void visit_fields(T& edge, F&& f) {
    auto& [magnitude, opacity] = edge;
    f("magnitude", magnitude), f("opacity", opacity);
}

template <Either<TransferTable> T, class F>
void visit_fields(T& table, F&& f) {
    auto& [values, gradients, opacity, color, steepest] = table;
    f("values", values), f("gradients", gradients), f("opacity", opacity), f("color", color);
    f("steepest", steepest);
}

template <Either<Transfer> T, class F>
void visit_fields(T& transfer, F&& f) {
    auto& [points, unit, edges, table] = transfer;
    f("points", points), f("unit", unit), f("edges", edges), f("table", table);
}

template <Either<Light> T, class F>
void visit_fields(T& light, F&& f) {
    auto& [towards, intensity] = light;
    f("towards", towards), f("intensity", intensity);
}

template <Either<Material> T, class F>
void visit_fields(T& material, F&& f) {
    auto& [ambient, diffuse, specular, exponent] = material;
    f("ambient", ambient), f("diffuse", diffuse), f("specular", specular);
    f("exponent", exponent);
}

template <Either<Shading> T, class F>
void visit_fields(T& shading, F&& f) {
    auto& [by, lights, material, phase, shadows, occlusion, least] = shading;
    f("by", by), f("lights", lights), f("material", material), f("phase", phase);
    f("shadows", shadows), f("occlusion", occlusion), f("least", least);
}

template <Either<DepthCue> T, class F>
void visit_fields(T& cue, F&& f) {
    auto& [per_length, linear] = cue;
    f("per_length", per_length), f("linear", linear);
}

template <Either<SurfaceOf> T, class F>
void visit_fields(T& surface, F&& f) {
    auto& [isovalue] = surface;
    f("isovalue", isovalue);
}

template <Either<Like> T, class F>
void visit_fields(T& like, F&& f) {
    auto& [name, filter, barred, times, step] = like;
    f("name", name), f("filter", filter), f("barred", barred), f("times", times);
    f("step", step);
}

template <Either<Budget> T, class F>
void visit_fields(T& budget, F&& f) {
    auto& [error, seconds, bytes, like, copied, error_yields] = budget;
    f("error", error), f("seconds", seconds), f("bytes", bytes), f("like", like);
    f("copied", copied), f("error_yields", error_yields);
}

template <Either<Request> T, class F>
void visit_fields(T& want, F&& f) {
    auto& [job, axes, input, spacing, views, frames, screen, unit, eye, clips, mode, transfer,
           shading, gradient, pixel, surface, setting, cue, zero, background, keeps_alpha, outside,
           magnitude, miss, field, range, written, budget, minimize, threads, ranks] = want;
    f("job", job), f("axes", axes), f("input", input), f("spacing", spacing), f("views", views);
    f("frames", frames), f("screen", screen), f("unit", unit), f("eye", eye), f("clips", clips);
    f("mode", mode), f("transfer", transfer), f("shading", shading), f("gradient", gradient);
    f("pixel", pixel), f("surface", surface), f("setting", setting), f("cue", cue);
    f("zero", zero), f("background", background), f("keeps_alpha", keeps_alpha);
    f("outside", outside), f("magnitude", magnitude), f("miss", miss), f("field", field);
    f("range", range), f("written", written), f("budget", budget), f("minimize", minimize);
    f("threads", threads), f("ranks", ranks);
}

}  // namespace edgewise
