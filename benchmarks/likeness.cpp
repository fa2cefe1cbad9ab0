// How the errors of paths compare with the plain path's on the same data: one line a path that may
// be as good, of random requests for a file.
//
//     build/release/bin/likeness_benchmark FILE [REQUESTS [SEED]] > ratios.csv
//
// Columns: file, job, mode, path, error over the plain path's, the plain path's error (NRMSE),
// predicted seconds over the plain path's, longest side of the picture over that of the input,
// tilt: the largest component of the line of sight along an axis of the input (1: along it).
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <numbers>
#include <random>
#include <string>

#include "planner/alike.hpp"
#include "planner/planner.hpp"
#include "planner/priced_graph.hpp"

using namespace edgewise;

namespace {

Query drawn_query(bool volume, std::mt19937& bits) {
    const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(bits); };
    const char* const modes[] = {"mip", "minip", "mean", "xray", "composite"};
    std::vector<Given> given;
    const bool warps = !volume || unit() < 0.15;
    if (!warps) given.push_back({"mode", std::string(modes[bits() % std::size(modes)])});
    if (volume)
        given.push_back({"rotate", std::to_string(360 * unit()) + "," +
                                       std::to_string(360 * unit()) + "," +
                                       std::to_string(360 * unit())});
    else
        given.push_back({"rotate", 360 * unit()});
    if (unit() < 0.5) given.push_back({"zoom", std::exp((2 * unit() - 1) * std::numbers::ln2)});
    if (!warps)
        given.push_back({"size", std::floor(128 * std::exp(unit() * 3 * std::numbers::ln2))});
    return query_of(warps ? Job::warp : Job::render, given);
}

void report(const char* file, const Prepared& plan) {
    const Planned& planned = plan.planned();
    const Request& want = planned.want;
    const auto graph = planned.graph();
    const auto& alike = graph->choice().alike;
    if (!alike || !alike->plain || !(alike->plain->likely > 0)) return;
    const double plain = alike->plain->likely / planned.scene.range;
    double seconds = 0;
    const std::vector<Plan> all = all_paths(graph->choice(), planned.engine.edges(), planned.ask(),
                                            planned.plan_options, 400);
    for (const Plan& path : all)
        if (path.steps.size() == 1 && path.texts()[0] == alike->plain->step)
            seconds = path.predicted.seconds;
    for (const Plan& path : all) {
        if (path.predicted.likeness == Likeness::barred || !path.predicted.known) continue;
        const auto error = likely_error(path, planned.ask(), planned.sources());
        if (!error) continue;
        std::string text;
        for (const std::string& step : path.texts()) text += (text.empty() ? "" : " > ") + step;
        double tilt = 0;
        if (want.job->of_rays()) {
            const Vec3 ray =
                want.views.at(0).matrix().topLeftCorner<3, 3>().inverse() * Vec3(0, 0, 1);
            tilt = ray.cwiseAbs().maxCoeff() / ray.norm();
        }
        std::printf("%s,%s,%s,\"%s\",%.5g,%.5g,%.4g,%.4g,%.4g\n", file, want.job->name.data(),
                    want.job->of_rays() ? want.mode->name.data() : "-", text.c_str(),
                    *error / plain, plain, path.predicted.seconds / seconds,
                    double(std::max(want.output().x, want.output().y)) /
                        double(std::max({want.input.x, want.input.y, want.input.z})),
                    tilt);
    }
}

}  // namespace

int main(int count, char** words) {
    if (count < 2) {
        std::fprintf(stderr, "usage: likeness_benchmark FILE [REQUESTS [SEED]]\n");
        return 2;
    }
    const int requests = count > 2 ? std::atoi(words[2]) : 40;
    std::mt19937 bits(count > 3 ? static_cast<unsigned>(std::atoi(words[3])) : 1);
    const Engine engine(catalogue(), default_profile(catalogue()));
    const Volume file = Volume::read(words[1]);
    for (int i = 0; i < requests; ++i) {
        const Query query = drawn_query(file.header().volume, bits);
        try {
            Query asked = query;
            asked.input = words[1];
            Opening as;
            as.keeps_samples = true;
            report(words[1], prepare(engine, asked, nullptr, {}));
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s: %s\n", words[1], error.what());
        }
    }
}
