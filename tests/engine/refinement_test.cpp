#include "engine/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/reached.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

TEST(FrontBound, IsTheTransparencyThatIsLeft) {
    MemoryBudget memory(1 << 20);
    Representation what;
    what.axes = 2;
    what.extent = {2, 2, 1};
    what.type = Type::f32;
    what.channels = 4;
    Data picture = Data::make(what, &memory);
    const float opacities[] = {0, 0.25, 1, 0.5};
    for (int i = 0; i < 4; ++i) {
        for (int c = 0; c < 3; ++c) picture.as<float>()[4 * i + c] = 7;
        picture.as<float>()[4 * i + 3] = opacities[i];
    }
    const FrontBound bound = front_bound_of(picture);
    EXPECT_EQ(bound.most, 1);
    EXPECT_EQ(bound.mean, (1 + 0.75 + 0 + 0.5) / 4);
}

TEST(FrontBound, NoSampleSendsMoreThanTheMostLight) {
    std::mt19937 random(7);
    std::normal_distribution<double> any;
    const auto direction = [&] { return Vec3(any(random), any(random), any(random)).normalized(); };
    for (const Shade by : {Shade::phong, Shade::torrance_sparrow, Shade::particles})
        for (const double phase : {0.0, 0.6, -0.9}) {
            Shading shading;
            shading.by = by;
            shading.phase = phase;
            shading.material = {0.3, 0.9, 0.4, 6};
            shading.lights = {{direction(), 1.5}, {direction(), 0.25}};
            const double most = most_light_of(shading);
            double seen = 0;
            for (int i = 0; i < 20000; ++i) {
                // Some look into a light, or stand where its mirror image is.
                const Vec3 eye = i % 3 ? direction() : shading.lights[0].towards * (i % 2 ? 1 : -1);
                const Lit lit = shading.at(i % 5 ? direction() : shading.lights[0].towards, eye);
                seen = std::max(seen, lit.diffuse + lit.specular);
            }
            EXPECT_LE(seen, most + 1e-12);
            EXPECT_GE(seen, 0.5 * most) << "the bound says something";
        }
    EXPECT_EQ(most_light_of({}), 1);
}

TEST(Refinement, GoesOnWhileNobodyTakesPictures) {
    const Data none;
    std::optional<Refinement> refinement(std::in_place, true);
    const FrontWatch watch = refinement->watch();
    EXPECT_TRUE(watch({0, 1, 2, none}));
    refinement->give_to([](const FrontPicture&) { return false; });
    EXPECT_FALSE(watch({0, 1, 2, none}));
    refinement->give_to({});
    EXPECT_TRUE(watch({0, 1, 2, none}));
    refinement.reset();
    EXPECT_TRUE(watch({0, 1, 2, none})) << "an edge may outlive it";
}

/// A composite of a phantom, content with what is there after some seconds.
std::vector<float> picture_after(double seconds, std::optional<Refined>& refined) {
    Query query;
    query.input = "phantom:gaussians:24";
    query.mode = mode_named("composite");
    query.geometry.size = OutputSize{.native = true};
    query.threads = 1;
    query.max_error = 9;
    const auto refinement = std::make_shared<Refinement>(false, seconds);
    Listener listener;
    const Engine engine(watched(catalogue(), refinement->watch()), default_profile(catalogue()));
    Reached reached(ask(engine, query, {.runs = true, .refinement = refinement}));
    reached.prepare({}, listener);
    std::vector<float> picture;
    const auto take = [&](int, const Data& result) {
        picture.assign(result.as<float>(), result.as<float>() + 4 * result.what.samples());
    };
    reached.run_all({.frames = take}, listener);
    refined = reached.run->measured.refined;
    return picture;
}

TEST(Refinement, AProgramStopsAtAPictureWithinItsBound) {
    std::optional<Refined> soon, late;
    const std::vector<float> front = picture_after(0, soon), whole = picture_after(1e9, late);
    ASSERT_TRUE(soon && late);
    EXPECT_TRUE(soon->stopped);
    EXPECT_FALSE(late->stopped);
    ASSERT_EQ(soon->pictures.size(), 1u);
    EXPECT_LE(late->pictures.size(), 16u);
    EXPECT_EQ(late->pictures.front().bound.most, soon->pictures.front().bound.most);
    ASSERT_EQ(front.size(), whole.size());
    for (std::size_t i = 0; i < front.size(); ++i) {
        const double through = 1 - front[i - i % 4 + 3];
        ASSERT_LE(std::abs(whole[i] - front[i]), through + 0x1p-20) << i;
    }
}

}  // namespace
}  // namespace edgewise
