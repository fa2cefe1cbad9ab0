// Surfaces are planned and run as any other result: by traits, an edge, and content that is no
// array.
#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "scene/scene.hpp"
#include "surface/mesh_measures.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

class MeshJob : public testing::Test {
 protected:
    Request want_of(const Data& data, std::optional<double> isovalue) {
        Request want = request_of(Job::warp, Mode::mip, data.what, {Mat4::Identity()});
        want.job = Job::mesh;
        want.views = Placement(Mat4::Identity());
        want.screen = {1, 1, 1};
        want.surface = SurfaceOf{isovalue};
        want.field = isovalue ? Field::linear : Field::nearest;
        want.budget = {.copied = true};
        return want;
    }
    Answer answer_to(const Data& data, const Request& want) {
        scene_ =
            measure_scene(edges_, data, statistics_of(data, &memory_), want, nullptr, &memory_);
        count_scene(edges_, data, want, scene_, &memory_);
        return plan(edges_, {want, scene_}, {{data.what}}, default_profile(edges_));
    }

    MemoryBudget memory_{std::size_t{1} << 30};
    const Catalogue edges_ = catalogue();
    Scene scene_;
};

TEST_F(MeshJob, IsPlannedAndRunWithinItsBytes) {
    const auto data = std::make_shared<const Data>(make_phantom("sphere", 40, &memory_));
    for (const std::optional<double> isovalue : {std::optional(0.5), std::optional<double>()}) {
        const Request want = want_of(*data, isovalue);
        const Answer answer = answer_to(*data, want);
        ASSERT_TRUE(answer.plan) << answer.problem;
        EXPECT_EQ(
            answer.plan->texts(),
            std::vector<std::string>{isovalue ? "surface.flying_edges" : "surface.nets/smooth=1"});
        std::optional<surface::Measures> first;
        for (const int threads : {1, 2, 7}) {
            const auto results = results_of(*answer.plan, {want, scene_}, data, threads, memory_);
            const auto mesh = surface::mesh_in(*results[0]);
            ASSERT_TRUE(mesh);
            const surface::Measures measures = surface::measures_of(*mesh, &memory_);
            EXPECT_TRUE(measures.closed);
            // A ball of radius 5 has an area of 314, and a triangle at most one half.
            EXPECT_GT(measures.triangles, 600);
            if (!first) first = measures;
            EXPECT_EQ(measures.area, first->area);
            EXPECT_EQ(measures.volume, first->volume);
            EXPECT_LE(surface::Mesh::bytes(double(measures.vertices), double(measures.triangles),
                                           !isovalue),
                      answer.plan->steps[0].offer.to.facet_bytes);
        }
    }
}

TEST_F(MeshJob, IsMadeOfSamplesAsTheyAre) {
    const Data data = make_phantom("sphere", 40, &memory_);
    const Request want = want_of(data, 0.5);
    const Answer answer = answer_to(data, want);
    for (const Plan& plan : answer.front) EXPECT_EQ(plan.steps.size(), 1u) << plan.texts()[0];
}

TEST_F(MeshJob, IsNoAnswerToOtherRequests) {
    const Data data = make_phantom("sphere", 16, &memory_);
    const auto refused = [&](Job job) {
        const Request want = request_of(job, Mode::mip, data.what, {Mat4::Identity()});
        int count = 0;
        for (const Refusal& refusal : answer_to(data, want).refused)
            if (refusal.transition.starts_with("surface.")) {
                ++count;
                EXPECT_TRUE(!refusal.asked || refusal.reason == "no surface is asked for")
                    << refusal.reason;
            }
        return count;
    };
    EXPECT_EQ(refused(Job::render), 3);
    EXPECT_EQ(refused(Job::warp), 0) << "no surface leads to moved samples";
}

}  // namespace
}  // namespace edgewise
