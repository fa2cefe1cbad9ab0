// A job of a user's own: traits, and an edge that leads to their target. Planner and runtime treat
// it as any other; the reference says that it does not know it.
#include <algorithm>
#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "reference/view_geometry.hpp"
#include "scene/scene.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

constexpr JobTraits kHistogram{.name = "histogram", .target = "object/histogram"};
constexpr Job histogram_of_values{kHistogram};

/// How many samples lie in each of 16 parts of [0, 1]; parts of the input are added up.
Transition toy_histogram() {
    Transition edge;
    edge.name = "toy.histogram";
    edge.joins = {{"object/scalar", "object/histogram"}};
    edge.offer = [](const Representation& from, const Ask&, const Parameters& with) -> Offer {
        if (from.type != Type::f32) return Offer::no("f32 alone");
        Representation to = from;
        to.content = "histogram";
        to.axes = 2;
        to.extent = {16, 1, 1};
        return {.from = from, .to = to, .with = with};
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = 3.0 * static_cast<double>(offer.from.samples()),
                    .streamed = offer.from.bytes()};
    };
    edge.error = exact;
    edge.parts = [](const Offer&, const Ask&) -> Partition {
        return {.kind = Partition::input,
                .leaf = {1 << 20, 1 << 20, 8},
                .merge = [](Data& into, const Data& from) {
                    for (int i = 0; i < 16; ++i) into.as<float>()[i] += from.as<float>()[i];
                }};
    };
    edge.run = [](const Offer&, const Ask&, const Data& in, Data& out, const Region& region,
                  Context&) {
        std::fill_n(out.as<float>(), 16, 0.0f);
        const Extent n = in.what.extent;
        for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
            for (std::int64_t i = z * n.y * n.x; i < (z + 1) * n.y * n.x; ++i)
                out.as<float>()[std::clamp(int(in.as<float>()[i] * 16), 0, 15)] += 1;
    };
    return edge;
}

TEST(ToyJob, IsPlannedAndRun) {
    Catalogue edges = catalogue();
    edges.push_back(toy_histogram());
    MemoryBudget memory(std::size_t{1} << 30);
    const auto data = std::make_shared<const Data>(make_phantom("sphere", 40, &memory));
    Request want = request_of(Job::warp, Mode::mip, data->what, {rotation(0, 0, 0)});
    want.job = histogram_of_values;
    const Scene scene =
        measure_scene(edges, *data, statistics_of(*data, &memory), want, nullptr, &memory);
    const Ask ask{want, scene};
    const Answer answer = plan(edges, ask, {{data->what}}, default_profile(edges));
    ASSERT_TRUE(answer.plan) << answer.problem;
    EXPECT_EQ(answer.plan->texts(), std::vector<std::string>{"toy.histogram"});
    for (const int threads : {1, 2}) {
        const auto results = results_of(*answer.plan, ask, data, threads, memory);
        std::array<std::int64_t, 16> expected{};
        for (std::int64_t i = 0; i < data->what.samples(); ++i)
            ++expected[std::clamp(int(data->as<float>()[i] * 16), 0, 15)];
        for (int i = 0; i < 16; ++i) EXPECT_EQ(results[0]->as<float>()[i], float(expected[i]));
    }
    EXPECT_THROW(ViewGeometry{want}, RequestError);
    // No edge that comes with the library leads there.
    EXPECT_FALSE(plan(catalogue(), ask, {{data->what}}, default_profile(catalogue())).plan);
}

TEST(ToyJob, ThoseOfTheLibraryHaveNamesOfTheirOwn) {
    ASSERT_EQ(jobs().size(), 5u);
    EXPECT_EQ(name_of(jobs()[0]), "warp");
    EXPECT_EQ(name_of(jobs()[1]), "render");
    EXPECT_EQ(name_of(jobs()[2]), "mesh");
    EXPECT_EQ(name_of(jobs()[3]), "filter");
    EXPECT_EQ(name_of(jobs()[4]), "radon");
}

}  // namespace
}  // namespace edgewise
