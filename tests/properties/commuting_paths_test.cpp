// Commuting paths are each other's oracle: one graph holds many ways to one picture, and any two
// must agree within the sum of the errors that they announce. On phantoms each must also be within
// its own error of the formula.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/reference/scene.hpp"
#include "transitions/reference/verify.hpp"

namespace edgewise {
namespace {

struct Case {
    const char* phantom;
    Job job;
    Mode mode;
    double x, y, z;
};

void PrintTo(const Case& c, std::ostream* out) {
    *out << fmt::format("{} {} {} {},{},{}", c.phantom, name_of(c.job), name_of(c.mode), c.x, c.y,
                        c.z);
}

class CommutingPaths : public testing::TestWithParam<Case> {};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const char* phantom : {"gaussians", "marschner-lobb", "sphere"})
        for (const auto& [x, y, z] : {std::array{0., 0., 0.},
                                      {25., -40., 10.},
                                      {3., 170., 2.},
                                      {0., 90., 0.},
                                      {31., 0., 0.}}) {
            all.push_back({phantom, Job::warp, Mode::mip, x, y, z});
            for (const Mode mode : {Mode::mip, Mode::xray, Mode::mean, Mode::composite})
                all.push_back({phantom, Job::render, mode, x, y, z});
        }
    return all;
}

TEST_P(CommutingPaths, AgreeWithEachOtherAndWithTheFormula) {
    const Case& c = GetParam();
    MemoryBudget memory(std::size_t{1} << 30);
    const Phantom phantom = phantom_named(c.phantom, 32);
    const auto input = std::make_shared<const Data>(make_phantom(c.phantom, 32, &memory));
    Request want = request_of(c.job, c.mode, input->what, {rotation(c.x, c.y, c.z)});
    want.field = Field::formula;
    const Scene scene = measure_scene(*input, want, &phantom, &memory);
    const Ask ask{want, scene};
    const Catalogue edges = catalogue();
    const ReferenceField field(*input, Field::formula, &phantom);

    const std::vector<Plan> paths = paths_of(edges, ask, input->what, 200);
    ASSERT_GE(paths.size(), 4u);
    std::vector<std::vector<std::shared_ptr<const Data>>> results;
    for (const Plan& path : paths) {
        results.push_back(results_of(path, ask, input, 2, memory));
        if (!path.predicted.known) continue;
        Verifier verifier(want, field, 0, 1, &memory);
        verifier.frame(0, *results.back()[0]);
        EXPECT_LE(verifier.finish().nrmse, path.predicted.error)
            << fmt::format("{}", fmt::join(path.texts(), " "));
    }
    for (std::size_t i = 0; i < paths.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            if (!paths[i].predicted.known || !paths[j].predicted.known) continue;
            // The triangle inequality, over samples that see the input; others add nothing.
            EXPECT_LE(rms_difference(results[i], results[j]) / scene.range,
                      paths[i].predicted.error + paths[j].predicted.error)
                << fmt::format("{} against {}", fmt::join(paths[i].texts(), " "),
                               fmt::join(paths[j].texts(), " "));
        }
}

INSTANTIATE_TEST_SUITE_P(Phantoms, CommutingPaths, testing::ValuesIn(cases()));

}  // namespace
}  // namespace edgewise
