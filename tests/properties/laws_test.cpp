// The laws that edges declare, on paths of random shapes down to one sample.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <random>

#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/reference/scene.hpp"

namespace edgewise {
namespace {

constexpr std::array<Extent, 6> kShapes = {
    {{1, 1, 1}, {5, 1, 3}, {1, 7, 2}, {2, 2, 2}, {6, 5, 4}, {3, 1, 1}}};

bool keeps(const Plan& path, Law law) {
    for (const Step& step : path.steps) {
        if (step.by->name == "store.crop") return false;  // what it cuts depends on the samples
        if (std::find(step.by->laws.begin(), step.by->laws.end(), law) == step.by->laws.end())
            return false;
    }
    return !path.steps.empty();
}

template <class Value>
std::shared_ptr<const Data> volume_of(const Extent& extent, MemoryBudget& memory, Value&& value) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, &memory);
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(value(i));
    return std::make_shared<const Data>(std::move(data));
}

/// Calls check(path, ask, input) for the paths of turns of all shapes that keep a law.
template <class Check>
void sweep(Job job, Mode mode, Law law, Check&& check) {
    MemoryBudget memory(std::size_t{1} << 30);
    const Catalogue edges = catalogue();
    int kept = 0;
    for (const Extent& shape : kShapes)
        for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50)}) {
            std::mt19937 bits(11);
            const auto input = volume_of(shape, memory, [&](std::int64_t) {
                return 1 + static_cast<double>(bits() % 4096) / 4096;
            });
            const Request want = request_of(job, mode, input->what, {turn});
            const Scene scene = measure_scene(*input, want, nullptr, &memory);
            const Ask ask{want, scene};
            for (const Plan& path : paths_of(edges, ask, input->what, 60)) {
                if (!keeps(path, law)) continue;
                SCOPED_TRACE(fmt::format("{}x{}x{}: {}", shape.x, shape.y, shape.z,
                                         fmt::join(path.texts(), " ")));
                check(path, ask, shape, memory);
                ++kept;
            }
        }
    EXPECT_GT(kept, 10);
}

TEST(Laws, AConstantStaysConstant) {
    constexpr double kValue = 0.75;
    const auto check = [&](const Plan& path, const Ask& ask, const Extent& shape,
                           MemoryBudget& memory) {
        const auto input = volume_of(shape, memory, [](std::int64_t) { return kValue; });
        Request want = ask.want;
        want.outside = want.miss = kValue;  // so that all of the result is constant
        const Ask constant{want, ask.scene};
        for (float value : values_of(*results_of(path, constant, input, 2, memory)[0]))
            EXPECT_NEAR(value, kValue, 1e-6);
    };
    sweep(Job::warp, Mode::mip, Law::constant, check);
    sweep(Job::render, Mode::mip, Law::constant, check);
    sweep(Job::render, Mode::mean, Law::constant, check);
}

TEST(Laws, SumsOfInputsGiveSumsOfOutputs) {
    sweep(
        Job::warp, Mode::mip, Law::linear,
        [](const Plan& path, const Ask& ask, const Extent& shape, MemoryBudget& memory) {
            const auto one = [](std::int64_t i) { return std::sin(1.0 + static_cast<double>(i)); };
            const auto two = [](std::int64_t i) { return std::cos(2.0 * static_cast<double>(i)); };
            const auto run = [&](auto&& value) {
                return values_of(
                    *results_of(path, ask, volume_of(shape, memory, value), 2, memory)[0]);
            };
            const auto a = run(one), b = run(two);
            const auto both = run([&](std::int64_t i) { return one(i) + two(i); });
            // f32 rounds some ten times on the way, by 6e-8 of values up to 2.
            for (std::size_t i = 0; i < both.size(); ++i) EXPECT_NEAR(both[i], a[i] + b[i], 2e-6);
        });
}

TEST(Laws, ABijectionSendsEverySampleToOnePlace) {
    // The rule moves points by fewer samples than this; nearer to a face a place that sees the
    // input may be sent the outermost sample in place of one beyond it.
    constexpr std::int64_t kHalo = 4, kSide = 13, kScreen = 25;
    MemoryBudget memory(std::size_t{1} << 30);
    const Catalogue edges = catalogue();
    Demands demands;
    demands.via = {demand_of("warp.permutation/filter=me", edges)};
    const auto input =
        volume_of({kSide, kSide, kSide}, memory, [](std::int64_t i) { return double(i + 1); });
    int paths = 0;
    for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50), rotation(0, 31, 0)}) {
        Request want = request_of(Job::warp, Mode::mip, input->what, {turn});
        Mat4 map = turn;
        const Vec3 from = Vec3::Constant((kSide - 1) / 2.), to = Vec3::Constant((kScreen - 1) / 2.);
        map.block<3, 1>(0, 3) = to - turn.block<3, 3>(0, 0) * from;
        want.views = Placement(map);
        want.screen = {kScreen, kScreen, kScreen};
        const Scene scene = measure_scene(*input, want, nullptr, &memory);
        const Ask ask{want, scene};
        for (const Plan& path : paths_of(edges, ask, input->what, 60, demands)) {
            if (!keeps(path, Law::bijection)) continue;
            std::vector<int> seen(kSide * kSide * kSide + 1);
            for (float value : values_of(*results_of(path, ask, input, 2, memory)[0]))
                ++seen[static_cast<std::size_t>(value)];
            for (std::int64_t z = kHalo; z < kSide - kHalo; ++z)
                for (std::int64_t y = kHalo; y < kSide - kHalo; ++y)
                    for (std::int64_t x = kHalo; x < kSide - kHalo; ++x)
                        EXPECT_EQ(seen[static_cast<std::size_t>(1 + x + kSide * (y + kSide * z))],
                                  1);
            ++paths;
        }
    }
    EXPECT_GE(paths, 3);
}

}  // namespace
}  // namespace edgewise
