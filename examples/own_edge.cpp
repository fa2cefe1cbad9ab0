// An edge of one's own: written, calibrated on this machine, and charted against all others.
#include <cmath>
#include <cstdio>

#include "evaluation/calibrate/calibration.hpp"
#include "evaluation/chart/chart_run.hpp"
#include "transitions/catalogue.hpp"

using namespace edgewise;

/// X-rays along the axes of the input: each pixel is the sum of the samples behind it.
Transition column_sums() {
    Transition edge;
    edge.name = "project.column_sums";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters&) -> Offer {
        const bool straight = residual(from, ask.want, 0).isIdentity(1e-12);
        if (ask.want.mode != Mode::xray || ask.want.eye || ask.want.frames > 1 || !straight ||
            from.type != Type::f32)
            return Offer::no("X-rays of f32 along an axis alone");
        return {.from = from, .to = screen_picture(from, ask.want)};
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = double(offer.from.samples()), .streamed = offer.from.bytes()};
    };
    edge.run = [](const Offer&, const Ask& ask, const Data& in, Data& out, const Region&,
                  Context&) {
        const std::int64_t pixels = out.what.samples();
        for (std::int64_t i = 0; i < pixels; ++i) out.as<float>()[i] = 0;
        for (std::int64_t i = 0; i < in.what.samples(); ++i)
            out.as<float>()[i % pixels] += float(ask.want.unit) * in.as<float>()[i];
    };
    // What it is timed on beside the requests of other edges, which look at volumes from the side.
    edge.trials = [] {
        std::vector<Trial> all;
        for (const char* input : {"phantom:gaussians:80", "phantom:gaussians:112"})
            all.push_back({.job = Job::render,
                           .input = input,
                           .mode = Mode::xray,
                           .alone = true,
                           .part = Trial::Part::quick});
        return all;
    };
    return edge;  // says nothing of errors: they are measured by running it on a few tiles
}

int main() {
    Catalogue edges = catalogue();
    edges.push_back(column_sums());
    Listener listener;
    const Profile machine = measured_profile(edges, true, listener);  // about 8 s

    Query query;
    query.input = "phantom:sphere:64";
    query.mode = Mode::xray;
    query.geometry.size = OutputSize{.native = true};  // a pixel for each column
    const Charted chart = charted(
        query, {edges, machine}, {}, [](double, const auto&) {}, listener);
    bool mine = false;
    for (const MeasuredPath& path : chart.paths) {
        std::printf("%-45s %.2e s, error %.1e\n", path_text(path.steps).c_str(), path.typical(),
                    path.error ? path.error->nrmse : NAN);
        mine = mine || path.steps == std::vector<std::string>{"project.column_sums"};
    }
    return mine ? 0 : 1;
}
