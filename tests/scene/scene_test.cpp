#include "scene/scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <tbb/global_control.h>

#include "reference/answer.hpp"
#include "reference/interval.hpp"
#include "reference/stored.hpp"
#include "scene/statistics.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

/// A volume of a commonest value 3 with other numbers in a box, in any type.
Data box_volume(Type type, int channels) {
    Representation what;
    what.extent = {37, 21, 19};
    what.type = type;
    what.channels = channels;
    what.values = {-0.5, 2};
    Data data = Data::make(what, heap());
    std::mt19937 bits(3);
    with_stored_type(type, [&](auto zero) {
        using T = decltype(zero);
        if constexpr (!std::is_same_v<T, StoredHalf>)
            for (std::int64_t i = 0; i < what.samples() * channels; ++i) {
                const std::int64_t s = i / channels, x = s % 37, y = s / 37 % 21, z = s / 777;
                const bool in = x >= 11 && x < 20 && y >= 5 && y < 6 && z >= 2 && z < 18;
                data.as<T>()[i] = static_cast<T>(in ? 4 + bits() % 90 : 3);
            }
    });
    return data;
}

TEST(Statistics, AreThoseOfAPlainCount) {
    for (Type type :
         {Type::u8, Type::i8, Type::u16, Type::i16, Type::u32, Type::i32, Type::f32, Type::f64})
        for (int channels : {1, 3}) {
            const Data data = box_volume(type, channels);
            const Statistics s = statistics_of(data, heap());
            double low = 1e9, high = -1e9, sum = 0;
            std::int64_t differing = 0;
            const std::int64_t values = data.what.samples() * channels;
            for (std::int64_t i = 0; i < values; ++i) {
                const double value = value_at(data, i);
                low = std::min(low, value);
                high = std::max(high, value);
                sum += value;
                differing += value != 0.5;
            }
            EXPECT_EQ(s.low, low);
            EXPECT_EQ(s.high, high);
            EXPECT_NEAR(s.mean, sum / static_cast<double>(values), 1e-12);
            EXPECT_EQ(s.commonest, 0.5);
            EXPECT_EQ(s.occupied, (Region{{11, 5, 2}, {20, 6, 18}}));
            EXPECT_EQ(s.occupied_fraction,
                      static_cast<double>(differing) / static_cast<double>(values));
            const auto found = [&](std::int64_t sample) {
                std::vector<double> all;
                for (int c = 0; c < channels; ++c)
                    all.push_back(value_at(data, sample * channels + c));
                return all;
            };
            EXPECT_TRUE(std::ranges::count(found(s.highest), high));
            EXPECT_TRUE(std::ranges::count(found(s.lowest), low));
        }
}

TEST(Statistics, LeaveOutWhatIsNotFinite) {
    Data data = box_volume(Type::f32, 1);
    data.as<float>()[5] = std::numeric_limits<float>::quiet_NaN();
    data.as<float>()[900] = -std::numeric_limits<float>::infinity();
    const Statistics s = statistics_of(data, heap());
    EXPECT_EQ(s.non_finite, 2);
    EXPECT_EQ(s.high, 0.5);
    EXPECT_TRUE(std::isfinite(s.mean));
    for (std::int64_t i = 0; i < data.what.samples(); ++i)
        data.as<float>()[i] = std::numeric_limits<float>::quiet_NaN();
    const Statistics none = statistics_of(data, heap());
    EXPECT_EQ(none.non_finite, data.what.samples());
    EXPECT_EQ(none.low, 0);
    EXPECT_EQ(none.high, 0);
}

TEST(Statistics, OfAConstantAndOfOneSample) {
    for (const Extent& n : {Extent{9, 8, 7}, Extent{1, 1, 1}}) {
        Representation what;
        what.extent = n;
        Data data = Data::make(what, heap());
        std::fill_n(data.as<float>(), n.samples(), 4.F);
        const Statistics s = statistics_of(data, heap());
        EXPECT_EQ(s.low, 4);
        EXPECT_EQ(s.high, 4);
        EXPECT_EQ(s.commonest, 4);
        EXPECT_TRUE(s.occupied.empty());
        EXPECT_EQ(s.occupied_fraction, 0);
    }
}

/// @param fine  output samples along screen x and y for each of the input
Request request_for(const Data& data, Job job, Mode mode, int frames, int fine = 1) {
    Request want;
    want.job = job;
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.axes = data.what.axes;
    want.input = data.what.extent;
    want.frames = frames;
    want.transfer.points = {{0, 0, {0, 0, 0}}, {1, 0.1, {1, 1, 1}}};
    const Extent& n = data.what.extent;
    const std::int64_t wide = want.axes == 2 ? n.x : n.x * 7 / 4;
    want.screen = {fine * wide, fine * wide, want.axes == 2 ? 1 : wide};
    const Vec3 centre = 0.5 * Vec3(static_cast<double>(n.x - 1), static_cast<double>(n.y - 1),
                                   static_cast<double>(n.z - 1));
    const Vec3 middle = 0.5 * Vec3(static_cast<double>(wide - 1), static_cast<double>(wide - 1),
                                   static_cast<double>(want.screen.z - 1));
    std::vector<Mat4> views;
    for (int view = 0; view < frames; ++view) {
        const Eigen::Affine3d map =
            Eigen::Scaling(Vec3(fine, fine, 1)) * Eigen::Translation3d(middle) *
            Eigen::AngleAxisd(0.3 + view, want.axes == 2 ? Vec3(0, 0, 1) : Vec3(0.2, 1, 0.1)) *
            Eigen::Translation3d(-centre);
        views.push_back(map.matrix());
    }
    want.views = Placement::each(views);
    return want;
}

Scene scene_of(const Data& data, const Request& want, const Phantom* formula = nullptr,
               int times = 1) {
    return measure_scene(catalogue(), data, statistics_of(data, heap()), want, formula, heap(),
                         times);
}

/// The RMS error of one hold and step over random pixels or samples, by the slow f64 fields:
/// between the low end of its 95 % interval and the mean.
Interval measured(const Request& want, const ReferenceField& truth, const ReferenceField& held,
                  double step, double& range, std::size_t count = 3000) {
    const Reference reference(want, truth, heap());
    std::mt19937 bits(11);
    std::vector<OutputSample> samples;
    while (samples.size() < count) {
        const OutputSample at{
            static_cast<int>(bits() % static_cast<unsigned>(want.frames)),
            static_cast<std::int64_t>(bits() % want.screen.x),
            static_cast<std::int64_t>(bits() % want.screen.y),
            want.job == Job::warp ? static_cast<std::int64_t>(bits() % want.screen.z) : 0};
        if (reference.sees_input(at)) samples.push_back(at);
    }
    const std::vector<double> expected = reference.values(samples);
    const auto channels = static_cast<std::size_t>(reference.channels());
    range = *std::ranges::max_element(expected) - *std::ranges::min_element(expected);
    std::vector<double> squares;
    const auto estimate = [&]() -> Interval {
        const double mean = std::accumulate(squares.begin(), squares.end(), 0.0) /
                            static_cast<double>(squares.size());
        std::vector<Part> parts;
        for (const double square : squares)
            parts.push_back({.value = square / static_cast<double>(squares.size())});
        return {root_sum_interval(parts, {.most = HUGE_VAL}, 1).low, std::sqrt(mean)};
    };
    if (want.job == Job::warp) {
        const std::vector<double> got = Reference(want, held, heap()).values(samples);
        for (std::size_t i = 0; i < got.size(); ++i)
            squares.push_back(std::pow(got[i] - expected[i], 2));
        return estimate();
    }
    const FieldPiece piece(held, Region::all(want.input), heap());
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const RaySpan ray = *reference.geometry().ray(samples[i]);
        Stretch stretch = Stretch::empty(want.mode);
        // Cells begin half a unit in front of the screen's first layer, as those of rays cast.
        constexpr double kFront = -0.5;
        for (double k = std::floor((ray.low - kFront) / step); kFront + k * step < ray.high; ++k) {
            const double low = std::max(ray.low, kFront + k * step);
            const double high = std::min(ray.high, kFront + (k + 1) * step);
            double value = 0;
            if (low < high && piece.at(ray.origin + (low + high) / 2 * ray.direction, &value))
                stretch.add(value, high - low, want);
        }
        std::array<double, 4> got{};
        stretch.result(want, got.data());
        double square = 0;
        for (std::size_t c = 0; c < channels; ++c)
            square += std::pow(got[c] - expected[i * channels + c], 2);
        squares.push_back(square / static_cast<double>(channels));
    }
    return estimate();
}

struct Case {
    const char* phantom;
    Job job;
    Mode mode;
    Field field;
};
class Scenes : public testing::TestWithParam<Case> {};

/// A prediction must not be broken, and should be no more than three times what comes true.
TEST_P(Scenes, PredictErrorsFromAbove) {
    const auto [name, job, mode, kind] = GetParam();
    const Phantom phantom = phantom_named(name, 48);
    const Data data = make_phantom(name, 48, heap());
    Request want = request_for(data, job, mode, 3);
    want.field = kind;
    const Scene scene = scene_of(data, want, &phantom);
    const ReferenceField truth(data, kind, &phantom);
    const std::map<std::string, Field> fields = {
        {"zoh", Field::nearest}, {"foh", Field::linear}, {"bspline3", Field::spline}};
    for (const auto& [hold, hold_kind] : fields) {
        if (hold_kind == kind) continue;
        const ReferenceField held(data, hold_kind);
        for (const auto& [text, step] : {std::pair("1", 1.0), std::pair("0.5", 0.5)}) {
            double range = 0;
            const Interval error = measured(want, truth, held, step, range);
            const std::string fact =
                job == Job::warp ? "field/" + hold : "picture/" + hold + "/" + text;
            ASSERT_TRUE(scene.fact(FactName(fact))) << fact;
            // Values: the samples here and there see different parts of the range.
            EXPECT_GE(*scene.fact(FactName(fact)), error.low) << fact;
            EXPECT_LE(*scene.fact(FactName(fact)), 3 * error.high) << fact;
            if (job == Job::warp) break;
        }
    }
}
INSTANTIATE_TEST_SUITE_P(
    Requests, Scenes,
    testing::Values(Case{"marschner-lobb", Job::render, Mode::mip, Field::spline},
                    Case{"noise", Job::render, Mode::mip, Field::formula},
                    Case{"shepp-logan", Job::render, Mode::xray, Field::linear},
                    Case{"gaussians", Job::render, Mode::composite, Field::spline},
                    Case{"noise", Job::render, Mode::mean, Field::spline},
                    Case{"gaussians", Job::warp, Mode::mip, Field::spline},
                    Case{"noise", Job::warp, Mode::mip, Field::formula},
                    Case{"zone-plate", Job::warp, Mode::mip, Field::spline}),
    [](const auto& tested) { return "number_" + std::to_string(tested.index); });

/// How far upper estimates of mean squares are above likely ones with `more` draws, over the same
/// with fewer: the median of all errors. Single ones with heavy tails need not come nearer.
double doubt_left(const Scene& scene, const Scene& more) {
    std::vector<double> left;
    for (const auto& [fact, likely] : scene.likely) {
        const std::string& name = fact;
        const bool is_error = name.starts_with("field/") || name.starts_with("picture/");
        if (!is_error || !(likely > 0) || name == "picture/combined") continue;
        EXPECT_GE(scene.facts.at(name), likely) << name;
        const auto doubt = [&](const Scene& of) {
            return std::pow(of.facts.at(name), 2) - std::pow(of.likely.at(name), 2);
        };
        left.push_back(doubt(more) / doubt(scene));
    }
    std::ranges::sort(left);
    return left.at(left.size() / 2);
}

/// Standard errors shrink as the root of the draws grows, where these are few of all there is, and
/// what they are taken of stays.
TEST_P(Scenes, AreSurerWithMoreDraws) {
    const auto [name, job, mode, kind] = GetParam();
    const Phantom phantom = phantom_named(name, 48);
    const Data data = make_phantom(name, 48, heap());
    Request want = request_for(data, job, mode, 3, 6);
    want.field = kind;
    const Scene once = scene_of(data, want, &phantom), more = scene_of(data, want, &phantom, 4);
    EXPECT_GT(static_cast<double>(more.draws), 2.5 * static_cast<double>(once.draws));
    EXPECT_LT(static_cast<double>(more.draws), 4.5 * static_cast<double>(once.draws));
    EXPECT_NEAR(doubt_left(once, more), 0.5, 0.2);
    const ReferenceField truth(data, kind, &phantom);
    for (const auto& [hold, hold_kind] :
         {std::pair("zoh", Field::nearest), std::pair("foh", Field::linear)}) {
        if (hold_kind == kind) continue;
        const std::string fact = job == Job::warp ? std::string("field/") + hold
                                                  : std::string("picture/") + hold + "/0.5";
        double range = 0;
        const ReferenceField held(data, hold_kind);
        // Squares with heavy tails: 3000 leave more than a tenth of a composite's error open.
        const std::size_t samples = mode == Mode::composite ? 20'000 : 6'000;
        const double error = measured(want, truth, held, 0.5, range, samples).high;
        EXPECT_NEAR(more.likely.at(fact) / error, 1, 0.1) << fact;
        EXPECT_EQ(more.as_likely().fact(FactName(fact)), more.likely.at(fact));
    }
}

/// All there is was drawn: a whole small picture.
TEST(Scene, KnowsWhenNoMoreCanBeDrawn) {
    const Data data = make_phantom("noise", 24, heap());
    Request want = request_for(data, Job::render, Mode::mip, 1);
    const Scene small = scene_of(data, want);
    EXPECT_TRUE(small.exhausted);
    EXPECT_EQ(small.facts, scene_of(data, want, nullptr, 4).facts);
    want.screen = {100, 100, 42};
    EXPECT_FALSE(scene_of(data, want).exhausted);
}

TEST(Scene, OfAWarpThatCopiesIsExact) {
    const Data data = make_phantom("noise", 24, heap());
    Request want;
    want.job = Job::warp;
    want.input = want.screen = data.what.extent;
    const Scene scene = scene_of(data, want);
    for (const char* fact : {"field/zoh", "field/foh", "field/bspline3", "field/me"})
        EXPECT_EQ(scene.fact(FactName(fact)), 0.0);
}

TEST(Scene, OfLabelsCountsThoseThatDiffer) {
    const Data data = make_phantom("checker", 64, heap());
    Request want = request_for(data, Job::warp, Mode::mip, 1);
    want.field = Field::nearest;
    const Scene scene = scene_of(data, want);
    EXPECT_EQ(scene.range, 1);
    EXPECT_EQ(scene.fact(FactName("field/zoh")), 0.0);
    EXPECT_GT(*scene.fact(FactName("field/foh")), 0.2);
    EXPECT_LE(*scene.fact(FactName("field/foh")), 1);
}

TEST(Scene, TakesOneVoxelOnePlaneAndConstants) {
    for (const Extent& n : {Extent{1, 1, 1}, Extent{9, 8, 1}, Extent{6, 6, 6}}) {
        Representation what;
        what.extent = n;
        Data data = Data::make(what, heap());
        std::fill_n(data.as<float>(), n.samples(), 4.F);
        for (Mode mode : modes()) {
            const Request want = request_for(data, Job::render, mode, 1);
            const Scene scene = scene_of(data, want);
            EXPECT_GT(scene.range, 0);
            EXPECT_TRUE(std::isfinite(scene.range));
            for (const auto& [name, value] : scene.facts) EXPECT_TRUE(std::isfinite(value)) << name;
        }
    }
}

TEST(Scene, DoesNotDependOnThreads) {
    const Data data = make_phantom("shepp-logan", 60, heap());
    const Request want = request_for(data, Job::render, Mode::composite, 4);
    for (const int times : {1, 4}) {
        const auto run = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return scene_of(data, want, nullptr, times);
        };
        const Scene one = run(1), seven = run(7);
        EXPECT_EQ(one.facts, seven.facts);
        EXPECT_EQ(one.likely, seven.likely);
        EXPECT_EQ(one.draws, seven.draws);
        EXPECT_EQ(one.range, seven.range);
        EXPECT_EQ(one.mean, seven.mean);
    }
}

}  // namespace
}  // namespace edgewise
