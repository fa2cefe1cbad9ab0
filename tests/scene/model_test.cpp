#include "scene/model.hpp"

#include <gtest/gtest.h>
#include <map>

#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// The facts that all models of a request measure, and what they go with.
std::map<std::string, ModelFact> facts_of(Job job, Mode mode, const Demands& asked = {}) {
    Representation what;
    what.extent = {12, 10, 8};
    Data data = Data::make(what, std::pmr::get_default_resource());
    for (std::int64_t i = 0; i < what.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(i * 37 % 101);
    Request want;
    want.job = job;
    want.mode = mode;
    want.input = want.screen = what.extent;
    Mat4 turned = Mat4::Identity();
    turned.topLeftCorner<2, 2>() << 0.8, -0.6, 0.6, 0.8;
    want.views = Placement(turned);
    want.transfer.points = {{0, 0, {0, 0, 0}}, {100, 0.1, {1, 1, 1}}};
    const ReferenceField field(data, Field::spline);
    const Statistics statistics = statistics_of(data, std::pmr::get_default_resource());
    ModelSetting setting{want, field, statistics, {}, {}, {}};
    std::map<std::string, ModelFact> facts;
    for (const auto& model : models_of(catalogue(), what, {.asked = asked}, setting))
        for (const ModelFact& fact : model->facts()) {
            EXPECT_FALSE(facts.contains(fact.name)) << fact.name.text() << " is measured twice";
            facts[fact.name] = fact;
        }
    return facts;
}

TEST(Models, MeasureWhatTheirEdgesAskFor) {
    const auto points = facts_of(Job::warp, Mode::mip);
    for (const char* name : {"field/zoh", "field/foh", "field/bspline3", "field/me", "sheared/foh",
                             "sheared/bspline3"})
        EXPECT_TRUE(points.contains(name)) << name;
    EXPECT_EQ(points.size(), 6u);
    const auto rays = facts_of(Job::render, Mode::mean);
    for (const char* name :
         {"field/zoh", "picture/foh/1", "picture/bspline3/0.25", "picture/screen/me",
          "picture/shear_warp/foh", "picture/spectrum/4x1.25", "gain/noise/zoh"})
        EXPECT_TRUE(rays.contains(name)) << name;
    EXPECT_FALSE(facts_of(Job::render, Mode::mip).contains("picture/spectrum/4x1.25"));
}

TEST(Models, KnowWhichCastsGoWithAFact) {
    const auto facts = facts_of(Job::render, Mode::composite);
    EXPECT_EQ(facts.at("picture/zoh/0.5").like, RayLook::kZoh1);
    EXPECT_EQ(facts.at("picture/zoh/2").like, RayLook::kZoh2);
    EXPECT_EQ(facts.at("picture/bspline3/2").like, RayLook::kFoh2);
    EXPECT_EQ(facts.at("picture/screen/me").like, RayLook::kZoh1);
    EXPECT_EQ(facts.at("picture/shear_warp/zoh").like, RayLook::kSlices);
    EXPECT_EQ(facts.at("picture/shear_warp/foh").like, RayLook::kFoh1);
    EXPECT_EQ(facts.at("gain/noise/zoh").like, RayLook::kCasts);
    EXPECT_EQ(facts.at("picture/ended").like, RayLook::kCasts);
}

TEST(Models, OfFiltersThatNobodyTriesAreMeasuredWhereTheyAreAskedFor) {
    EXPECT_FALSE(facts_of(Job::warp, Mode::mip).contains("field/keys"));
    const Catalogue edges = catalogue();
    const Demands asked = untried({.via = {demand_of("warp.backward/filter=keys", edges),
                                           demand_of("ray_cast/filter=foh/step=1", edges)}},
                                  edges);
    ASSERT_EQ(asked.via.size(), 1u);
    EXPECT_TRUE(facts_of(Job::warp, Mode::mip, asked).contains("field/keys"));
    EXPECT_TRUE(facts_of(Job::render, Mode::mip, asked).contains("picture/keys/1"));
}

}  // namespace
}  // namespace edgewise
