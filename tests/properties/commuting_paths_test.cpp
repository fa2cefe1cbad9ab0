// Commuting paths are each other's oracle: one graph holds many ways to one picture, and any two
// must agree within the sum of the errors that they announce. On phantoms each must also be within
// its own error of the formula.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "reference/verify.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 24;

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
    for (const char* phantom : {"gaussians", "marschner-lobb", "sphere"}) {
        all.push_back({phantom, Job::warp, Mode::mip, 25, -40, 10});
        for (const Mode mode : modes()) all.push_back({phantom, Job::render, mode, 25, -40, 10});
    }
    // Nothing to move, a quarter turn, nearly a half turn, one axis that stays.
    for (const auto& [x, y, z] : {std::array{0., 0., 0.}, {0., 90., 0.}, {3., 170., 2.}}) {
        all.push_back({"gaussians", Job::warp, Mode::mip, x, y, z});
        all.push_back({"gaussians", Job::render, Mode::mip, x, y, z});
        all.push_back({"sphere", Job::render, Mode::xray, x, y, z});
    }
    all.push_back({"sphere", Job::warp, Mode::mip, 31, 0, 0});
    all.push_back({"marschner-lobb", Job::render, Mode::mean, 31, 0, 0});
    all.push_back({"gaussians", Job::render, Mode::composite, 31, 0, 0});
    return all;
}

TEST_P(CommutingPaths, AgreeWithEachOtherAndWithTheFormula) {
    const Case& c = GetParam();
    MemoryBudget memory(std::size_t{1} << 30);
    const Phantom phantom = phantom_named(c.phantom, kSide);
    const auto input = std::make_shared<const Data>(make_phantom(c.phantom, kSide, &memory));
    Request want = request_of(c.job, c.mode, input->what, {rotation(c.x, c.y, c.z)});
    want.field = Field::formula;
    const Scene scene = scene_of(*input, want, memory, &phantom);
    const Ask ask{want, scene};
    const ReferenceField field(*input, Field::formula, &phantom);
    const Expected expected(want, field, &memory);
    // Measured over less than the whole, and never by more than rounding too large.
    EXPECT_LE(scene.range, expected.range() * 1.001);

    const Catalogue edges = catalogue();
    const std::vector<Plan> paths = paths_of(edges, ask, input->what, 200);
    ASSERT_GE(paths.size(), 4u);
    std::vector<std::vector<std::shared_ptr<const Data>>> results;
    for (const Plan& path : paths) {
        results.push_back(results_of(path, ask, input, 2, memory));
        if (!path.predicted.known) continue;
        // The samples themselves are the formula rounded to f32.
        EXPECT_LE(expected.error_of(results.back()), path.predicted.error + 0x1p-24)
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

TEST(VerifiedError, IntervalOfFewSamplesCoversTheWholeError) {
    MemoryBudget memory(std::size_t{1} << 30);
    const Catalogue edges = catalogue();
    const auto input = std::make_shared<const Data>(make_phantom("gaussians", kSide, &memory));
    for (const Mode mode : {Mode::mip, Mode::xray, Mode::composite}) {
        const Request want = request_of(Job::render, mode, input->what, {rotation(25, -40, 10)});
        const Scene scene = scene_of(*input, want, memory);
        const Ask ask{want, scene};
        const ReferenceField field(*input, want.field);
        const Expected expected(want, field, &memory);
        Demands demands;
        demands.via = {demand_of("project.ray_cast/filter=foh/step=1", edges)};
        const Plan path = paths_of(edges, ask, input->what, 1, demands).at(0);
        const auto result = results_of(path, ask, input, 2, memory);
        const double error = expected.error_of(result);
        constexpr int kSeeds = 20;
        int covered = 0;
        for (int seed = 1; seed <= kSeeds; ++seed) {
            // Few enough for a part to be drawn: four times as many would all be compared.
            Verifier verifier(want, field, 100, static_cast<std::uint64_t>(seed), &memory);
            verifier.frame(0, *result[0]);
            const Verified verified = verifier.finish();
            constexpr double kRounding = 1e-6;  // of sums in another order
            covered +=
                verified.low <= error * (1 + kRounding) && error <= verified.high * (1 + kRounding);
        }
        // Of 20 intervals of 95 % four or more miss in 2 cases of 100.
        EXPECT_GE(covered, kSeeds - 3) << name_of(mode);
    }
}

}  // namespace
}  // namespace edgewise
