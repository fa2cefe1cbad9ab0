#include "scene/measured_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "reference/verify.hpp"
#include "scene/scene.hpp"
#include "scene/statistics.hpp"
#include "tests/transitions/project/looking.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/project/shear_warp_perspective.hpp"
#include "transitions/project/shear_warp_perspective_runs.hpp"
#include "transitions/project/splat_ewa_sheets.hpp"
#include "transitions/project/trapezoid_cast.hpp"
#include "transitions/spectrum/gradients.hpp"
#include "transitions/store/crop.hpp"

namespace edgewise {
namespace {

using namespace looking;

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

/// Rough lumps in empty space, nearer to one side.
Data lumps(const Extent& n) {
    return volume(n, [](double x, double y, double z) {
        const double value = wave(1.7 * x, y, z) - 0.004 * x;
        return value > 0.6 ? value : 0;
    });
}

/// Seen by an eye so near that the first slice lies far before what most rays meet.
Request seen_from(Mode mode, const Extent& n, const std::vector<Matrix3d>& ways, double distance,
                  const Extent& screen) {
    std::vector<Transform> views;
    for (const Matrix3d& way : ways)
        views.push_back(seen(mode, n, screen, way, Vec3::Ones(), 1.2).views.at(0));
    Request want = seen(mode, n, screen, ways[0], Vec3::Ones(), 1.2);
    want.frames = static_cast<int>(ways.size());
    want.views = Placement::each(std::move(views));
    want.transfer.points = {{0.5, 0, {0.2, 0.4, 1}}, {1, 0.3, {1, 0.6, 0.1}}};
    Eye eye;
    eye.plane = double(screen.z - 1) / 2;
    eye.at = Vec3(double(screen.x - 1) / 2, double(screen.y - 1) / 2, eye.plane - distance);
    eye.width = eye.height = 1 / 1.2;
    want.eye = eye;
    return want;
}

Scene scene_of(const Data& data, const Request& want, const std::vector<std::string>& via) {
    Demands asked;
    for (const std::string& name : via) asked.via.push_back({.name = name});
    return measure_scene(catalogue(), data, statistics_of(data, heap()), want, nullptr, heap(), 1,
                         asked);
}

Parameters by(const char* filter) { return {{"filter", filter}, {"density", 1.0}}; }

/// The error of an edge, on pixels of all frames. @param read  what it reads in place of the data
Verified error_of(const Transition& edge, const Data& data, const Request& want,
                  const Parameters& with, std::int64_t samples, const Data* read = nullptr) {
    const Scene scene;
    const Ask ask{want, scene};
    const ReferenceField field(data, want.field);
    const Data& in = read ? *read : data;
    Verifier verifier(want, field, samples, 1, heap());
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "");
    for (int view = 0; view < want.frames; ++view) {
        Data out = Data::make(offer.to, heap());
        Context context{.memory = heap(), .view = view};
        edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
        verifier.frame(view, out);
    }
    return verifier.finish();
}

TEST(MeasuredRuns, PromiseWhatPicturesFromAnEyeKeep) {
    const Extent n{40, 34, 37}, screen{76, 70, 60};
    const Data in = lumps(n);
    const Transition edge = shear_warp_perspective();
    for (const double degrees : {0.0, 28.0, 46.0})
        for (const Mode mode : {Mode::mip, Mode::composite}) {
            const Request want = seen_from(mode, n, {turn(degrees, {1, 2, 0.3})}, 38, screen);
            const Scene scene = scene_of(in, want, {edge.name});
            for (const char* filter : {"foh", "zoh"}) {
                const FactName fact = fact_of_runs(edge, by(filter));
                ASSERT_TRUE(scene.fact(fact)) << fact.text();
                const double promise = *scene.fact(fact) / scene.range;
                const Verified error = error_of(edge, in, want, by(filter), 1024);
                EXPECT_LE(error.low, promise) << mode->name << ' ' << filter << ' ' << degrees;
                // Three standard errors of 500 drawn pixels are less than a third.
                EXPECT_GE(error.high, promise / 1.4) << mode->name << ' ' << filter;
                EXPECT_LE(scene.likely.at(fact), *scene.fact(fact));
            }
        }
}

TEST(MeasuredRuns, ArePixelsOfAllWhereThereAreFew) {
    const Extent n{20, 17, 18}, screen{36, 34, 30};
    const Data in = lumps(n);
    const Transition edge = shear_warp_perspective();
    const Request want =
        seen_from(Mode::xray, n, {turn(20, {1, 2, 0}), turn(60, {0, 1, 0})}, 30, screen);
    const Scene scene = scene_of(in, want, {edge.name});
    const Verified error = error_of(edge, in, want, by("foh"), 0);
    // Two views, of which 256 pixels are asked for each and all of so few are taken; the weights of
    // views are those of a lattice of rays, and one view's range may be less than that of both.
    EXPECT_NEAR(*scene.fact(fact_of_runs(edge, by("foh"))) / scene.range / error.nrmse, 1, 0.1);
}

TEST(MeasuredRuns, DrawViewsWhereThereAreMany) {
    const Extent n{24, 22, 20}, screen{50, 46, 40};
    const Data in = lumps(n);
    const Transition edge = shear_warp_perspective();
    std::vector<Matrix3d> ways;
    for (int view = 0; view < 15; ++view) ways.push_back(turn(24 * view, {0.1, 1, 0.2}));
    const Request want = seen_from(Mode::composite, n, ways, 30, screen);
    const Scene scene = scene_of(in, want, {edge.name});
    const Verified error = error_of(edge, in, want, by("foh"), 1024);
    const double promise = *scene.fact(fact_of_runs(edge, by("foh"))) / scene.range;
    EXPECT_LE(error.low, promise);
    EXPECT_GE(3 * error.high, promise);
}

/// RMS of how a picture changes where each sample is moved by up to half a step, over the RMS of
/// these moves; by numbers of a generator, not by rounding.
double change_by_noise(const Transition& edge, const Data& data, const Request& want,
                       const Parameters& with, double step) {
    const Scene scene;
    const Ask ask{want, scene};
    Data moved = Data::make(data.what, heap());
    std::minstd_rand drawn(7);
    std::uniform_real_distribution<float> by(static_cast<float>(-step / 2),
                                             static_cast<float>(step / 2));
    for (std::int64_t i = 0; i < data.what.samples(); ++i)
        moved.as<float>()[i] = data.as<float>()[i] + by(drawn);
    const Offer offer = edge.offer(data.what, ask, with);
    std::array<Data, 2> pictures = {Data::make(offer.to, heap()), Data::make(offer.to, heap())};
    for (std::size_t i = 0; i < 2; ++i) {
        Context context{.memory = heap()};
        edge.run(offer, ask, i ? moved : data, pictures[i], Region::all(offer.to.extent), context);
    }
    double squares = 0;
    const std::int64_t count = offer.to.samples() * offer.to.channels;
    for (std::int64_t i = 0; i < count; ++i)
        squares += std::pow(pictures[0].as<float>()[i] - pictures[1].as<float>()[i], 2);
    return std::sqrt(squares / static_cast<double>(count)) / (step / std::sqrt(12.0));
}

TEST(MeasuredRuns, TellHowAnEdgePassesTheRoundingOfSamples) {
    const Extent n{40, 34, 37}, screen{60, 54, 50};
    const Data in = volume(n, [](double x, double y, double z) { return wave(x, y, z); });
    const Statistics statistics = statistics_of(in, heap());
    const double step = (statistics.high - statistics.low) / 254;
    Request want = seen(Mode::composite, n, screen, turn(25, {1, 2, 0.3}), Vec3::Ones(), 1.2);
    want.transfer.points = {{0.1, 0, {0.2, 0.4, 1}}, {1, 0.3, {1, 0.6, 0.1}}};
    const std::vector<std::pair<Transition, Parameters>> measured = {
        {splat_ewa_sheets(), {{"sigma", 0.6}, {"lowpass", 0.6}}},
        {trapezoid_cast(), {{"filter", "foh"}, {"step", 1.0}}}};
    for (const auto& [edge, with] : measured) {
        const Scene scene = scene_of(in, want, {edge.name});
        const FactName fact = fact_of_runs(edge, with);
        ASSERT_TRUE(scene.fact(gain_of_runs(fact))) << edge.name;
        // 3,000 pixels that share samples: some hundred independent ones, 5 % a standard error.
        EXPECT_NEAR(*scene.fact(gain_of_runs(fact)) / change_by_noise(edge, in, want, with, step),
                    1, 0.2)
            << edge.name;
        const Ask ask{want, scene};
        EXPECT_EQ(edge.error_of(edge.offer(in.what, ask, with), ask).noise_gain,
                  *scene.fact(gain_of_runs(fact)));
    }
}

TEST(MeasuredRuns, PassWhatPreparationsLayBesideTheSamples) {
    // The same picture by runs as by all samples: so the same error.
    const Extent n{30, 26, 28}, screen{56, 52, 46};
    const Data in = lumps(n);
    const Transition all = shear_warp_perspective(), runs = shear_warp_perspective_runs();
    const Request want = seen_from(Mode::composite, n, {turn(30, {1, 2, 0.3})}, 38, screen);
    const Scene asked = scene_of(in, want, {all.name}), plain = scene_of(in, want, {runs.name});
    for (const char* filter : {"foh", "zoh"}) {
        ASSERT_TRUE(plain.fact(fact_of_runs(runs, by(filter))));
        const double by_runs = *plain.fact(fact_of_runs(runs, by(filter))) / plain.range;
        EXPECT_NEAR(by_runs, *asked.fact(fact_of_runs(all, by(filter))) / asked.range,
                    1e-12 * by_runs);
    }
    EXPECT_FALSE(plain.fact(fact_of_runs(all, by("foh"))));
}

TEST(MeasuredRuns, CountTheWorseOfAWholeAndACroppedInput) {
    // A ball far behind the face that the eye sees first: cropped, slices begin at the ball.
    const Extent n{48, 46, 60}, screen{70, 66, 70};
    const Data in = volume(n, [](double x, double y, double z) {
        const double r = Vec3(x - 24, y - 22, z - 48).norm();
        return r < 9 ? 1 + 0.5 * std::sin(2 * r) * std::cos(1.9 * x) : 0;
    });
    const Transition edge = shear_warp_perspective();
    const Request want = seen_from(Mode::mip, n, {turn(3, {1, 2, 0})}, 45, screen);
    const Scene scene = scene_of(in, want, {edge.name});
    const double promise = *scene.fact(fact_of_runs(edge, by("foh"))) / scene.range;
    const Ask ask{want, scene};
    const Offer cut = crop().offer(in.what, ask, {});
    ASSERT_EQ(cut.refused, "");
    Data part = Data::make(cut.to, heap());
    Context context{.memory = heap()};
    crop().run(cut, ask, in, part, Region::all(cut.to.extent), context);
    const Verified whole = error_of(edge, in, want, by("foh"), 1024);
    const Verified cropped = error_of(edge, in, want, by("foh"), 1024, &part);
    EXPECT_GT(std::abs(cropped.nrmse - whole.nrmse), 0.02 * whole.nrmse);
    EXPECT_LE(std::max(cropped.low, whole.low), promise);
}

TEST(MeasuredRuns, MakeOnceWhatAllViewsShare) {
    const Extent n{24, 22, 20}, screen{32, 30, 28};
    const Data in = lumps(n);
    std::vector<Transform> views;
    for (int view = 0; view < 3; ++view)
        views.push_back(seen(Mode::xray, n, screen, turn(40 * view, {0.1, 1, 0.2}), Vec3::Ones(), 1)
                            .views.at(0));
    Request want = seen(Mode::xray, n, screen, turn(0, {0, 1, 0}), Vec3::Ones(), 1);
    want.frames = 3;
    want.views = Placement::each(std::move(views));
    want.shading.by = Shade::hemisphere;
    Catalogue counted;
    int spectra = 0, slices = 0;
    for (Transition edge : catalogue()) {
        int* const count = edge.name == "spectrum.gradients"   ? &spectra
                           : edge.name == "spectrum.lit_slice" ? &slices
                                                               : nullptr;
        if (count)
            edge.run = [run = edge.run, count](auto&&... what) {
                ++*count;
                run(what...);
            };
        counted.push_back(std::move(edge));
    }
    const Parameters with{{"degree", 1.0}, {"padding", 1.25}, {"width", 4.0}};
    Demands asked;
    asked.via.push_back({.name = "spectrum.gradients", .with = with});
    asked.without.push_back({.name = "store"});
    const Scene scene =
        measure_scene(counted, in, statistics_of(in, heap()), want, nullptr, heap(), 1, asked);
    EXPECT_EQ(spectra, 1);
    EXPECT_EQ(slices, 3);
    // What one view after the other has, each with spectra of its own.
    double square = 0;
    for (int view = 0; view < 3; ++view) {
        Request one = want;
        one.frames = 1;
        one.views = Placement(want.views.at(view));
        const Scene of_one =
            measure_scene(counted, in, statistics_of(in, heap()), one, nullptr, heap(), 1, asked);
        square += std::pow(of_one.likely.at(fact_of_runs(spectrum_gradients(), with)), 2) / 3;
    }
    const double likely = scene.likely.at(fact_of_runs(spectrum_gradients(), with));
    EXPECT_NEAR(likely / std::sqrt(square), 1, 0.2);
}

TEST(MeasuredRuns, SayNothingWhereMemoryIsTooSmall) {
    const Extent n{20, 17, 18}, screen{36, 34, 30};
    const Data in = lumps(n);
    const Transition edge = shear_warp_perspective();
    Request want = seen_from(Mode::mip, n, {turn(20, {1, 2, 0})}, 30, screen);
    want.budget.bytes = 1e9;
    EXPECT_TRUE(scene_of(in, want, {edge.name}).fact(fact_of_runs(edge, by("foh"))));
    want.budget.bytes = in.what.bytes();
    EXPECT_FALSE(scene_of(in, want, {edge.name}).fact(fact_of_runs(edge, by("foh"))));
}

}  // namespace
}  // namespace edgewise
