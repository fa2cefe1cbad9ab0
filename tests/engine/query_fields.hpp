#pragma once

#include "graph/fingerprint.hpp"
#include "request/query.hpp"

namespace edgewise {

/// The fields of a query, by name and in order. One that is new and not named here does not
/// compile: so that tests which change one field after another leave none out.
template <Either<Query> T, class F>
void visit_fields(T& query, F&& f) {
    auto& [job, input, selection, level_by_result, out, geometry, clip, filter, radon, mode,
           isovalue, zero, outside, background, keeps_alpha, transfer, suiting_preset, shade,
           gradient, lights, material, phase, shadows, occlusion, cue, window, exposure, reference,
           labels, only_labels, smooth, look, finish, channel_name, max_error, like_linear, range,
           max_time, max_memory, notation, minimize, threads, ranks, planner, planning_time,
           demands, fps, film_encoder, bits, quality, verify, seed, repeat, strict, remembers] =
        query;
    f("job", job), f("input", input), f("selection", selection);
    f("level_by_result", level_by_result), f("out", out), f("geometry", geometry);
    f("clip", clip), f("filter", filter), f("radon", radon), f("mode", mode);
    f("isovalue", isovalue), f("zero", zero), f("outside", outside);
    f("background", background), f("keeps_alpha", keeps_alpha), f("transfer", transfer);
    f("suiting_preset", suiting_preset), f("shade", shade), f("gradient", gradient);
    f("lights", lights), f("material", material), f("phase", phase), f("shadows", shadows);
    f("occlusion", occlusion), f("cue", cue), f("window", window), f("exposure", exposure);
    f("reference", reference), f("labels", labels), f("only_labels", only_labels);
    f("smooth", smooth), f("look", look), f("finish", finish), f("channel_name", channel_name);
    f("max_error", max_error), f("like_linear", like_linear), f("range", range);
    f("max_time", max_time), f("max_memory", max_memory), f("notation", notation);
    f("minimize", minimize), f("threads", threads), f("ranks", ranks), f("planner", planner);
    f("planning_time", planning_time), f("demands", demands), f("fps", fps);
    f("film_encoder", film_encoder), f("bits", bits);
    f("quality", quality), f("verify", verify), f("seed", seed), f("repeat", repeat);
    f("strict", strict), f("remembers", remembers);
}

template <Either<GeometrySpec> T, class F>
void visit_fields(T& geometry, F&& f) {
    auto& [view, about, steps, perspective, zoom, grid_moves, crop, spacing, size, upright, eye,
           look_at] = geometry;
    f("view", view), f("about", about), f("steps", steps), f("perspective", perspective);
    f("zoom", zoom), f("grid_moves", grid_moves), f("crop", crop), f("spacing", spacing);
    f("size", size), f("upright", upright), f("eye", eye), f("look_at", look_at);
}

template <Either<ClipSpec> T, class F>
void visit_fields(T& clip, F&& f) {
    auto& [box, planes, balls, slab] = clip;
    f("box", box), f("planes", planes), f("balls", balls), f("slab", slab);
}

template <Either<FilterSpec> T, class F>
void visit_fields(T& filter, F&& f) {
    auto& [op, kernel, border, slices] = filter;
    f("op", op), f("kernel", kernel), f("border", border), f("slices", slices);
}

}  // namespace edgewise
