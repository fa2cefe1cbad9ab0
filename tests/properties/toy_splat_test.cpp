// An edge of a user's own, with nothing but what it does: no answer about errors and no model. Its
// errors are measured by running it on a few tiles.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "planner/planner.hpp"
#include "reference/phantoms.hpp"
#include "scene/scene.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// X-rays forward: each sample is spread over the four pixels around the point that it meets, for
/// the volume that it stands for (Westover 1990, with a bilinear footprint).
Transition toy_splat() {
    Transition edge;
    edge.name = "project.toy_splat";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters& with) -> Offer {
        if (ask.want.mode != Mode::xray || ask.want.eye || from.type != Type::f32)
            return Offer::no("parallel X-rays of f32 alone");
        return {.from = from, .to = screen_picture(from, ask.want), .with = with};
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = 30.0 * static_cast<double>(offer.from.samples()),
                    .streamed = offer.from.bytes() + offer.to.bytes()};
    };
    edge.parts = [](const Offer&, const Ask&) -> Partition {
        return {.kind = Partition::input,
                .leaf = {1 << 20, 1 << 20, 8},
                .merge = [](Data& into, const Data& from) {
                    for (std::int64_t i = 0; i < into.what.samples(); ++i)
                        into.as<float>()[i] += from.as<float>()[i];
                }};
    };
    edge.run = [](const Offer& offer, const Ask& ask, const Data& in, Data& out,
                  const Region& region, Context& context) {
        const Mat4 map = residual(offer.from, ask.want, context.view);
        const double each = std::abs(map.topLeftCorner<3, 3>().determinant()) * ask.want.unit;
        const Extent n = in.what.extent, to = out.what.extent;
        std::fill_n(out.as<float>(), to.samples(), 0.0f);
        for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
            for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y)
                for (std::int64_t x = region.begin[0]; x < region.end[0]; ++x) {
                    const Eigen::Vector4d p =
                        map * Eigen::Vector4d(double(x), double(y), double(z), 1);
                    const double value = each * in.as<float>()[(z * n.y + y) * n.x + x];
                    const double i = std::floor(p.x()), j = std::floor(p.y());
                    for (int corner = 0; corner < 4; ++corner) {
                        const double a = i + (corner & 1), b = j + (corner >> 1);
                        if (a < 0 || b < 0 || a >= double(to.x) || b >= double(to.y)) continue;
                        const double weight = (1 - std::abs(p.x() - a)) * (1 - std::abs(p.y() - b));
                        out.as<float>()[std::int64_t(b) * to.x + std::int64_t(a)] +=
                            static_cast<float>(value * weight);
                    }
                }
    };
    return edge;
}

Data volume(const char* kind, std::int64_t side, MemoryBudget& memory) {
    if (std::string(kind) != "noise" && std::string(kind) != "peaks") {
        Data phantom = make_phantom(kind, static_cast<int>(side), &memory);
        return phantom;
    }
    Representation what;
    what.extent = {side, side + 3, side - 5};
    Data data = Data::make(what, &memory);
    std::mt19937 bits(3);
    for (std::int64_t i = 0; i < what.samples(); ++i) {
        const double u = (bits() % 4096) / 4096.0;
        data.as<float>()[i] = static_cast<float>(std::string(kind) == "noise" ? u
                                                 : u > 0.995                  ? 100 * u
                                                                              : 0);
    }
    return data;
}

TEST(ToySplat, IsPlannedWithTheErrorThatItHas) {
    Catalogue edges = catalogue();
    edges.push_back(toy_splat());
    MemoryBudget memory(std::size_t{1} << 30);
    for (const char* kind : {"gaussians", "sphere", "noise", "peaks"})
        for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 30, 10), rotation(5, 80, 0)}) {
            auto data = std::make_shared<const Data>(volume(kind, 40, memory));
            Request want = request_of(Job::render, Mode::xray, data->what, {turn});
            const Statistics statistics = statistics_of(*data, &memory);
            const Scene scene = measure_scene(edges, *data, statistics, want, nullptr, &memory);
            PlanOptions options;
            options.demands.via = {demand_of("toy_splat", edges)};
            const Answer answer =
                plan(edges, {want, scene}, {{data->what}}, default_profile(edges), options);
            ASSERT_TRUE(answer.plan) << kind << answer.problem;
            const Predicted& predicted = answer.plan->predicted;
            ASSERT_TRUE(predicted.known) << kind;
            const ReferenceField field(*data, want.field, nullptr);
            const Expected expected(want, field, &memory);
            const double error =
                expected.error_of(results_of(*answer.plan, {want, scene}, data, 2, memory));
            EXPECT_GT(error, predicted.error / 3) << kind;
            EXPECT_LT(error, predicted.error * 3) << kind;
            // What it cannot keep is not promised.
            want.budget.error = error / 3.1;
            const Answer none =
                plan(edges, {want, scene}, {{data->what}}, default_profile(edges), options);
            EXPECT_FALSE(none.plan) << kind;
        }
}

TEST(ToySplat, NothingIsKnownWhereNothingCouldBeDrawn) {
    Catalogue edges = catalogue();
    edges.push_back(toy_splat());
    MemoryBudget memory(std::size_t{1} << 30);
    const auto data = std::make_shared<const Data>(volume("noise", 20, memory));
    Request want = request_of(Job::render, Mode::xray, data->what, {rotation(0, 0, 0)});
    Mat4 beside = want.views.at(0).matrix();
    beside(0, 3) += 1000;
    want.views = Placement(beside);
    const Scene scene =
        measure_scene(edges, *data, statistics_of(*data, &memory), want, nullptr, &memory);
    PlanOptions options;
    options.demands.via = {demand_of("toy_splat", edges)};
    const Answer answer =
        plan(edges, {want, scene}, {{data->what}}, default_profile(edges), options);
    ASSERT_TRUE(answer.plan);
    EXPECT_FALSE(answer.plan->predicted.known);
    want.budget.error = 1;
    EXPECT_FALSE(plan(edges, {want, scene}, {{data->what}}, default_profile(edges), options).plan);
}

}  // namespace
}  // namespace edgewise
