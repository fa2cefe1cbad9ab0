// The laws that edges declare, on paths of random shapes down to one sample and as long as thin.
// Nothing here names an edge: a new one is swept over what its line of the catalogue declares.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <string>

#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// Down to one sample, planes, rods, and extents drawn at random; the same in every run.
std::vector<Extent> shapes() {
    std::vector<Extent> all = {{1, 1, 1}, {5, 1, 3}, {1, 7, 2},   {2, 2, 2},   {6, 5, 4},
                               {3, 1, 1}, {1, 1, 9}, {301, 1, 1}, {1, 150, 2}, {2, 1, 130}};
    std::mt19937 bits(29);
    for (int i = 0; i < 6; ++i) {
        const auto side = [&] { return static_cast<std::int64_t>(1 + bits() % 12); };
        const std::int64_t x = side(), y = side();
        all.push_back({x, y, side()});
    }
    return all;
}

/// As wide as high, so that a quarter turn about z leads to the same screen.
constexpr std::array<Extent, 6> kSquares = {
    {{1, 1, 1}, {1, 1, 40}, {2, 2, 2}, {5, 5, 1}, {6, 6, 3}, {33, 33, 2}}};

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

/// Values of 1 to 2 that no arithmetic would give by chance.
std::shared_ptr<const Data> noise(const Extent& shape, MemoryBudget& memory) {
    std::mt19937 bits(11);
    return volume_of(shape, memory,
                     [&](std::int64_t) { return 1 + static_cast<double>(bits() % 4096) / 4096; });
}

std::string text_of(const Extent& shape, const Plan& path) {
    return fmt::format("{}x{}x{}: {}", shape.x, shape.y, shape.z, fmt::join(path.texts(), " "));
}

/// A turn about the centre, then a shift by whole samples.
Request moved(Job job, Mode mode, const Representation& input, const Mat4& turn,
              const Vec3& shift = Vec3::Zero()) {
    Request want = request_of(job, mode, input, {turn});
    Mat4 map = want.views.at(0).matrix();
    map.block<3, 1>(0, 3) += shift;
    want.views = Placement(map);
    return want;
}

/// A picture of a volume whose slices lie 1.6 samples apart, turned about its centre.
Request stretched(Mode mode, const Representation& input, const Mat4& turn) {
    constexpr double kApart = 1.6;
    Request want = request_of(Job::render, mode, input, {turn});
    want.spacing = {1, 1, kApart};
    const Extent& n = input.extent;
    const auto longest =
        static_cast<std::int64_t>(std::hypot(double(n.x), double(n.y), kApart * double(n.z))) + 1;
    want.screen = {longest, longest, longest};
    Mat4 from_middle = Mat4::Identity(), to_middle = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) {
        from_middle(axis, axis) = want.spacing[axis];
        from_middle(axis, 3) = -want.spacing[axis] * double(input.extent[axis] - 1) / 2;
        to_middle(axis, 3) = double(want.screen[axis] - 1) / 2;
    }
    want.views = Placement(Mat4(to_middle * turn * from_middle));
    return want;
}

/// Calls check(path, ask, shape, memory) for every path of a request that keeps a law.
/// @return how many there were
template <class Check>
int sweep_paths(const Request& want, const std::shared_ptr<const Data>& input, Law law,
                MemoryBudget& memory, Check&& check) {
    const Catalogue edges = catalogue();
    Scene scene = scene_of(*input, want, memory);
    // A constant that is taken out before a transform and put back afterwards is no linear part.
    if (law == Law::linear) scene.commonest = 0;
    const Ask ask{want, scene};
    int kept = 0;
    for (const Plan& path : paths_of(edges, ask, input->what, 60)) {
        if (!keeps(path, law)) continue;
        SCOPED_TRACE(text_of(input->what.extent, path));
        check(path, ask, input->what.extent, memory);
        ++kept;
    }
    return kept;
}

/// The same for turns of all shapes.
template <class Check>
void sweep(Job job, Mode mode, Law law, Check&& check) {
    MemoryBudget memory(std::size_t{1} << 30);
    int kept = 0;
    for (const Extent& shape : shapes())
        for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50)}) {
            const auto input = noise(shape, memory);
            kept += sweep_paths(moved(job, mode, input->what, turn), input, law, memory, check);
            if (job != Job::render) continue;
            kept += sweep_paths(stretched(mode, input->what, turn), input, law, memory, check);
        }
    EXPECT_GT(kept, 10);
}

/// Through f32 coefficients nothing comes back exactly: three recursions and 64 taps of values up
/// to 2, whose coefficients reach 2 * 3^1.5 in noise.
void expect_copied(const Plan& path, const std::vector<float>& got,
                   const std::vector<float>& expected) {
    const std::string text = fmt::format("{}", fmt::join(path.texts(), " "));
    const double most = text.find("spline") == std::string::npos ? 0 : 6e-6;
    ASSERT_EQ(got.size(), expected.size());
    for (std::size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], expected[i], most);
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
            ASSERT_NEAR(value, kValue, 1e-6);
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
            for (std::size_t i = 0; i < both.size(); ++i) ASSERT_NEAR(both[i], a[i] + b[i], 2e-6);
        });
}

TEST(Laws, SumsOfVolumesGiveSumsOfIntegrals) {
    sweep(
        Job::render, Mode::xray, Law::linear,
        [](const Plan& path, const Ask& ask, const Extent& shape, MemoryBudget& memory) {
            const auto one = [](std::int64_t i) { return 1 + std::sin(static_cast<double>(i)); };
            const auto two = [](std::int64_t i) {
                return 2 + std::cos(3. * static_cast<double>(i));
            };
            const auto run = [&](auto&& value) {
                return values_of(
                    *results_of(path, ask, volume_of(shape, memory, value), 2, memory)[0]);
            };
            const auto a = run(one), b = run(two);
            const auto both = run([&](std::int64_t i) { return one(i) + two(i); });
            // Rounding of f32 is that of the largest integral, some log2 n times over.
            const double longest = 5. * static_cast<double>(std::max({shape.x, shape.y, shape.z}));
            for (std::size_t i = 0; i < both.size(); ++i)
                ASSERT_NEAR(both[i], a[i] + b[i], 4e-6 * longest);
        });
}

TEST(Laws, WithoutGeometrySamplesStayThemselves) {
    MemoryBudget memory(std::size_t{1} << 30);
    int kept = 0;
    for (const Extent& shape : shapes()) {
        const auto input = noise(shape, memory);
        const Request want = moved(Job::warp, Mode::mip, input->what, rotation(0, 0, 0));
        kept += sweep_paths(want, input, Law::identity, memory,
                            [&](const Plan& path, const Ask& ask, const Extent&, MemoryBudget&) {
                                expect_copied(
                                    path, values_of(*results_of(path, ask, input, 2, memory)[0]),
                                    values_of(*input));
                            });
    }
    EXPECT_GT(kept, 50);
}

TEST(Laws, WholeShiftsAreCopies) {
    MemoryBudget memory(std::size_t{1} << 30);
    int kept = 0;
    for (const Extent& shape : shapes())
        for (const Vec3& by : {Vec3(1, 0, 0), Vec3(-2, 1, 0), Vec3(0, -1, 3), Vec3(400, 0, 0)}) {
            const auto input = noise(shape, memory);
            const std::vector<float> values = values_of(*input);
            std::vector<float> expected;
            for (std::int64_t z = 0; z < shape.z; ++z)
                for (std::int64_t y = 0; y < shape.y; ++y)
                    for (std::int64_t x = 0; x < shape.x; ++x) {
                        const std::int64_t i = x - std::int64_t(by.x()),
                                           j = y - std::int64_t(by.y()),
                                           k = z - std::int64_t(by.z());
                        const bool inside =
                            i >= 0 && j >= 0 && k >= 0 && i < shape.x && j < shape.y && k < shape.z;
                        expected.push_back(
                            inside
                                ? values[static_cast<std::size_t>(i + shape.x * (j + shape.y * k))]
                                : 0.f);
                    }
            const Request want = moved(Job::warp, Mode::mip, input->what, rotation(0, 0, 0), by);
            kept += sweep_paths(
                want, input, Law::whole_shift, memory,
                [&](const Plan& path, const Ask& ask, const Extent&, MemoryBudget&) {
                    expect_copied(path, values_of(*results_of(path, ask, input, 2, memory)[0]),
                                  expected);
                });
        }
    EXPECT_GT(kept, 100);
}

TEST(Laws, FourQuarterTurnsGiveTheInputBack) {
    MemoryBudget memory(std::size_t{1} << 30);
    int kept = 0;
    for (const Extent& shape : kSquares) {
        const auto input = noise(shape, memory);
        const Request want = moved(Job::warp, Mode::mip, input->what, rotation(0, 0, 90));
        kept += sweep_paths(
            want, input, Law::quarter_turn, memory,
            [&](const Plan& path, const Ask& ask, const Extent&, MemoryBudget&) {
                std::vector<float> now = values_of(*input);
                for (int turn = 0; turn < 4; ++turn)
                    now = values_of(*results_of(
                        path, ask,
                        volume_of(shape, memory,
                                  [&](auto i) { return now[static_cast<std::size_t>(i)]; }),
                        2, memory)[0]);
                expect_copied(path, now, values_of(*input));
            });
    }
    EXPECT_GT(kept, 20);
}

TEST(Laws, EveryPathIsDeterministicOnEveryShape) {
    MemoryBudget memory(std::size_t{1} << 30);
    const Catalogue edges = catalogue();
    for (const Extent& shape : shapes())
        for (const Job job : {Job::warp, Job::render}) {
            const auto input = noise(shape, memory);
            const Request want = moved(job, job == Job::warp ? Mode::mip : Mode::xray, input->what,
                                       rotation(20, 35, -50));
            const Scene scene = scene_of(*input, want, memory);
            const Ask ask{want, scene};
            for (const Plan& path : paths_of(edges, ask, input->what, 60)) {
                const auto first = results_of(path, ask, input, 1, memory)[0];
                const auto again = results_of(path, ask, input, 3, memory)[0];
                EXPECT_EQ(0, std::memcmp(first->samples.data(), again->samples.data(),
                                         static_cast<std::size_t>(first->what.bytes())))
                    << text_of(shape, path);
            }
        }
}

/// A law that no path of the sweeps needs would be a word only.
TEST(Laws, EveryDeclaredLawIsSweptForItsEdge) {
    MemoryBudget memory(std::size_t{1} << 30);
    const Catalogue edges = catalogue();
    std::set<std::pair<std::string, Law>> swept;
    const auto note = [&](const Request& want, const std::shared_ptr<const Data>& input,
                          std::initializer_list<Law> laws) {
        const Scene scene = scene_of(*input, want, memory);
        for (const Plan& path : paths_of(edges, {want, scene}, input->what, 200))
            for (const Law law : laws)
                if (keeps(path, law))
                    for (const Step& step : path.steps) swept.insert({step.by->name, law});
    };
    const auto input = noise({6, 6, 4}, memory);
    const auto want = [&](Job job, Mode mode, const Mat4& turn) {
        return moved(job, mode, input->what, turn);
    };
    for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50)})
        note(want(Job::warp, Mode::mip, turn), input,
             {Law::identity, Law::constant, Law::linear, Law::whole_shift, Law::bijection});
    note(want(Job::warp, Mode::mip, rotation(0, 0, 90)), input, {Law::quarter_turn});
    for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50), rotation(0, 90, 0)}) {
        note(want(Job::render, Mode::mip, turn), input, {Law::constant});
        note(stretched(Mode::mip, input->what, turn), input, {Law::constant});
        note(want(Job::render, Mode::mean, turn), input, {Law::constant});
        note(want(Job::render, Mode::xray, turn), input, {Law::linear});
    }
    for (const Transition& edge : edges)
        for (const Law law : edge.laws)
            EXPECT_TRUE(swept.contains({edge.name, law}))
                << edge.name << " declares law " << static_cast<int>(law)
                << ", which no sweep tries";
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
        const Scene scene = scene_of(*input, want, memory);
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
