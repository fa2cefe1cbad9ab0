#include "transitions/spectrum/polar.hpp"

#include <Eigen/Geometry>
#include <atomic>
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>
#include <tbb/global_control.h>

#include "tests/transitions/spectrum/spectrum_scene.hpp"
#include "transitions/spectrum/turntable.hpp"

namespace edgewise {
namespace {

/// Blobs that turn about the screen's y, tilted towards it.
struct Turning {
    Extent extent{20, 18, 16};
    Vec3 spacing{1, 1, 1};
    Counting memory;
    Data data = blobs(extent, 0, &memory);
    Request want = request_of(extent, spacing, Mode::xray, 1);
    Scene scene = scene_of(data);

    explicit Turning(int views, double arc = 1, const Vec3& step = Vec3::Ones(),
                     const Vec3& spaced = Vec3::Ones())
        : spacing(spaced) {
        turn_by(views, arc, step, Vec3::UnitY());
    }
    void turn_by(int views, double arc, const Vec3& step, const Vec3& axis) {
        std::vector<Mat4> maps;
        for (int view = 0; view < views; ++view) {
            Eigen::Affine3d map = Eigen::Affine3d::Identity();
            map.translate(Vec3(static_cast<double>(want.screen.x - 1) / 2,
                               static_cast<double>(want.screen.y - 1) / 2, 0));
            map.scale(step.cwiseInverse());
            map.rotate(Eigen::AngleAxisd(2 * std::numbers::pi * arc * view / views, axis));
            map.rotate(Eigen::AngleAxisd(0.4, Vec3::UnitX()));
            map.rotate(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
            map.scale(spacing);
            map.translate(-0.5 * Vec3(static_cast<double>(extent.x - 1),
                                      static_cast<double>(extent.y - 1),
                                      static_cast<double>(extent.z - 1)));
            maps.push_back(map.matrix());
        }
        want.pixel = {step.x() / step.z(), step.y() / step.z()};
        want.unit = step.z();
        want.frames = views;
        want.views = Placement::each(std::move(maps));
    }
    Ask ask() const { return {want, scene}; }
};

struct PolarPath {
    Transition forward = spectrum_forward(), polar = spectrum_polar(),
               slice = spectrum_polar_slice(), inverse = spectrum_inverse();
    Offer made, fan, cut, seen;

    PolarPath(const Representation& from, const Ask& ask, const char* angle, double planes = 0,
              const char* band = "volume") {
        made = forward.offer(from, ask, {{"width", 6.}, {"padding", 2.}});
        fan = polar.offer(
            made.to, ask,
            {{"angle", std::string(angle)}, {"band", std::string(band)}, {"planes", planes}});
        if (!fan.refused.empty()) return;
        cut = slice.offer(fan.to, ask, {});
        seen = inverse.offer(cut.to, ask, {});
    }
    Data planes(const Data& in, const Ask& ask, std::pmr::memory_resource* memory) const {
        Data spectrum = Data::make(made.to, memory), out = Data::make(fan.to, memory);
        Context context{.memory = memory};
        forward.run(made, ask, in, spectrum, Region::all(made.to.extent), context);
        polar.run(fan, ask, spectrum, out, Region::all(fan.to.extent), context);
        return out;
    }
    Data picture(const Data& planes, const Ask& ask, int view,
                 std::pmr::memory_resource* memory) const {
        Context context{.memory = memory, .view = view};
        Data plane = Data::make(cut.to, memory), out = Data::make(seen.to, memory);
        slice.run(cut, ask, planes, plane, Region::all(cut.to.extent), context);
        inverse.run(seen, ask, plane, out, Region::all(seen.to.extent), context);
        return out;
    }
};

/// Differences from spectrum.slice in all views, over the largest value.
struct Difference {
    double most = 0, rms = 0;

    Difference(Turning& t, const PolarPath& path) {
        const Path slices(t.data.what, t.ask(), {6, 2, "volume"});
        const Data planes = path.planes(t.data, t.ask(), &t.memory);
        const Data spectrum = slices.spectrum(t.data, t.ask(), &t.memory);
        double top = 0, squares = 0;
        for (int view = 0; view < t.want.frames; ++view) {
            const Data a = path.picture(planes, t.ask(), view, &t.memory);
            const Data b = slices.picture(spectrum, t.ask(), view, &t.memory);
            for (std::int64_t i = 0; i < a.what.extent.samples(); ++i) {
                const double away = static_cast<double>(a.as<float>()[i]) - b.as<float>()[i];
                top = std::max(top, std::abs(static_cast<double>(b.as<float>()[i])));
                most = std::max(most, std::abs(away));
                squares += away * away / static_cast<double>(a.what.extent.samples());
            }
        }
        most /= top;
        rms = std::sqrt(squares / t.want.frames) / top;
    }
};

TEST(Turntable, FindsAnglesAndAxis) {
    const Turning t(6);
    const Turntable table(t.want);
    ASSERT_EQ(table.refused, "");
    EXPECT_EQ(table.axis, static_cast<double>(t.want.screen.x - 1) / 2);
    ASSERT_EQ(table.angles.size(), 6u);
    for (int view = 0; view < 6; ++view) EXPECT_NEAR(table.angles[view], view / 6., 1e-12);
    EXPECT_EQ(table.parts(100), 6);
    EXPECT_EQ(Turntable(Turning(7).want).parts(100), 14);
    EXPECT_EQ(Turntable(Turning(8, -0.25).want).parts(100), 32);
    EXPECT_EQ(Turntable(Turning(7).want).parts(12), 0);
    EXPECT_LT(table.radius, Vec3(10, 9, 8).norm());
    EXPECT_GT(table.radius, 10);
    // Any view of the turn, wherever the axis lies.
    for (int view = 0; view < 6; ++view)
        EXPECT_LT((table.view_at(view / 6.) - t.want.views.at(view).matrix())
                      .topRows<2>()
                      .cwiseAbs()
                      .maxCoeff(),
                  1e-12);
}

TEST(SpectrumPolar, RefusesOtherViews) {
    Turning t(5);
    const auto refusal = [&](const char* angle = "linear", double planes = 0) {
        return PolarPath(t.data.what, t.ask(), angle, planes).fan.refused;
    };
    EXPECT_EQ(refusal(), "");
    EXPECT_EQ(refusal("linear", 1), "1 planes given; expected a whole number from 2 on");
    EXPECT_EQ(refusal("linear", 2.5), "2.5 planes given; expected a whole number from 2 on");
    EXPECT_EQ(refusal("window", 3), "a window of 6 planes needs 6 in half a turn");
    t.turn_by(5, 1, Vec3::Ones(), Vec3::UnitX());
    EXPECT_EQ(refusal(), "view 1 is not the first one turned about the screen's y: no turntable");
    t.turn_by(5, std::numbers::sqrt2 / 7, Vec3::Ones(), Vec3::UnitY());
    EXPECT_EQ(refusal().substr(0, 35), "no 16384 planes hold all views, and");
    t.turn_by(5, 1, Vec3::Ones(), Vec3::UnitY());
    std::vector<Mat4> maps;
    for (int view = 0; view < 5; ++view) maps.push_back(t.want.views.at(view).matrix());
    maps[2](1, 3) += 0.01;
    t.want.views = Placement::each(maps);
    EXPECT_EQ(refusal(), "view 2 turns about another axis than the volume's middle");
    for (Mat4& map : maps) map(0, 3) += 0.1;
    t.want.views = Placement::each(maps);
    EXPECT_EQ(refusal().substr(0, 16), "the axis lies at");
}

/// Opposite views share a plane, so that a turn of 6 has 3.
TEST(SpectrumPolar, PlanesThatViewsLieOnAreTheirSlices) {
    for (const int views : {1, 5, 6}) {
        Turning t(views);
        const PolarPath path(t.data.what, t.ask(), "linear");
        ASSERT_EQ(path.fan.refused, "");
        EXPECT_EQ(path.fan.to.extent.z, views % 2 ? views : views / 2);
        EXPECT_TRUE(path.polar.error(path.fan, t.ask()).known);
        EXPECT_LT(Difference(t, path).most, 2e-6) << views;
    }
    // Pixels that are no cubes, samples that are none.
    Turning t(4, 1, Vec3(1.3, 0.8, 0.7), Vec3(0.7, 1, 1.4));
    EXPECT_LT(Difference(t, PolarPath(t.data.what, t.ask(), "linear")).most, 2e-6);
    EXPECT_LT(Difference(t, PolarPath(t.data.what, t.ask(), "linear", 0, "picture")).most, 0.1);
}

TEST(SpectrumPolar, AWindowAlongTheAngle) {
    Turning t(7, 0.83);
    const PolarPath path(t.data.what, t.ask(), "window");
    ASSERT_EQ(path.fan.refused, "");
    const Turntable table(t.want);
    // 2 pi x 3/4 x the radius waves a turn, two planes a wave, a quarter more; even lengths.
    const double needed = 2 * 1.25 * 2 * std::numbers::pi * 0.75 * table.radius;
    EXPECT_GE(2 * static_cast<double>(path.fan.to.extent.z), needed);
    EXPECT_LT(2 * static_cast<double>(path.fan.to.extent.z), 1.2 * needed);
    const Error error = path.polar.error(path.fan, t.ask());
    EXPECT_TRUE(error.known);
    const Difference measured(t, path);
    EXPECT_LT(measured.most, angle_window().bound());
    EXPECT_LT(measured.rms, angle_window().mean_ghost());
    EXPECT_GT(measured.rms, 1e-7);
    // Fewer planes: nothing is promised; linear interpolation of as many is worse.
    const double planes = static_cast<double>(path.fan.to.extent.z);
    const PolarPath few(t.data.what, t.ask(), "window", std::floor(planes / 3)),
        linear(t.data.what, t.ask(), "linear", planes);
    EXPECT_FALSE(few.polar.error(few.fan, t.ask()).known);
    EXPECT_FALSE(linear.polar.error(linear.fan, t.ask()).known);
    EXPECT_GT(Difference(t, linear).rms, 2 * measured.rms);
}

/// What a few samples have at the cutoff, where the spline's response is 0.012, comes and goes
/// between planes.
TEST(SpectrumPolar, TinyVolumes) {
    for (const Extent& extent : {Extent{1, 1, 1}, Extent{9, 1, 1}, Extent{1, 8, 3}})
        for (const char* angle : {"linear", "window"}) {
            Turning t(3);
            t.extent = extent;
            t.data = blobs(extent, 5, &t.memory);
            t.want.input = extent;
            t.scene = scene_of(t.data);
            t.scene.commonest = 0;
            t.turn_by(3, 1, Vec3::Ones(), Vec3::UnitY());
            const PolarPath path(t.data.what, t.ask(), angle);
            ASSERT_EQ(path.fan.refused, "");
            EXPECT_LT(Difference(t, path).most, 0.0125) << extent.x << angle;
        }
}

TEST(SpectrumPolar, BytesAreCountedAndDoNotDependOnThreads) {
    Turning t(5);
    const PolarPath path(t.data.what, t.ask(), "window");
    std::vector<std::vector<float>> pictures;
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Data planes = path.planes(t.data, t.ask(), &t.memory);
        const Data picture = path.picture(planes, t.ask(), 2, &t.memory);
        pictures.emplace_back(picture.as<float>(),
                              picture.as<float>() + picture.what.extent.samples());
    }
    EXPECT_EQ(pictures[0], pictures[1]);

    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    Data spectrum = Data::make(path.made.to, &t.memory), fan = Data::make(path.fan.to, &t.memory),
         plane = Data::make(path.cut.to, &t.memory);
    Context context{.memory = &t.memory, .view = 3};
    path.forward.run(path.made, t.ask(), t.data, spectrum, {}, context);
    const auto expect = [&](const Transition& edge, const Offer& offer, const Data& in, Data& out) {
        const Work work = edge.work(offer, t.ask(), 3);
        const double most = static_cast<double>(t.memory.now()) + 2 * work.scratch + work.workspace;
        t.memory.restart();
        edge.run(offer, t.ask(), in, out, {}, context);
        EXPECT_LE(static_cast<double>(t.memory.peak()), most) << edge.name;
    };
    expect(path.polar, path.fan, spectrum, fan);
    expect(path.slice, path.cut, fan, plane);
    const std::atomic<bool> stop{true};
    Context stopped{.memory = &t.memory, .stop = &stop};
    EXPECT_THROW(path.polar.run(path.fan, t.ask(), spectrum, fan, {}, stopped), Cancelled);
    EXPECT_THROW(path.slice.run(path.cut, t.ask(), fan, plane, {}, stopped), Cancelled);
}

/// Half as many slices for a turn of an even number of views; a window's planes pay only for more
/// views than it needs.
TEST(SpectrumPolar, PaysForMirroredViewsAndForVeryMany) {
    const auto taps = [](const Turning& t, const char* angle) {
        const PolarPath path(t.data.what, t.ask(), angle);
        return path.polar.work(path.fan, t.ask(), 0).gathers;
    };
    const auto slices = [](const Turning& t) {
        const Path path(t.data.what, t.ask(), {6, 2, "volume"});
        double sum = 0;
        for (int view = 0; view < t.want.frames; ++view)
            sum += path.slice.work(path.cut, t.ask(), view).gathers;
        return sum;
    };
    const Turning few(12), odd(11), many(720);
    EXPECT_NEAR(taps(few, "linear") / slices(few), 0.5, 0.05);
    EXPECT_NEAR(taps(odd, "linear") / slices(odd), 1, 0.1);
    EXPECT_GT(taps(few, "window"), slices(few));
    EXPECT_LT(taps(many, "window"), 0.3 * slices(many));
}

}  // namespace
}  // namespace edgewise
