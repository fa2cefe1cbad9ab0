#include "transitions/project/octree_cast.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/stretches.hpp"
#include "transitions/store/octree.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;
using looking::seen;
using looking::turn;

template <class T>
constexpr Type kTypeOf = std::is_same_v<T, std::uint8_t>   ? Type::u8
                         : std::is_same_v<T, std::int16_t> ? Type::i16
                         : std::is_same_v<T, double>       ? Type::f64
                                                           : Type::f32;

/// Flat blocks of several values, a ball of waves, single bright samples.
template <class T>
Data blocks(const Extent& n, ValueMap values = {}) {
    Representation what;
    what.extent = n;
    what.type = kTypeOf<T>;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    const Vec3 middle = Vec3(double(n.x), double(n.y), double(n.z)) / 2;
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                double value = 3;
                if (z > n.z / 2 && y < n.y / 2) value = 20;
                if ((Vec3(double(x), double(y), double(z)) - middle).norm() < 11)
                    value = 30 + 60 * looking::wave(2 * double(x), double(y), double(z));
                *data.at<T>(x, y, z) = static_cast<T>(value);
            }
    std::mt19937 bits(5);
    for (int spot = 0; spot < 9; ++spot)
        *data.at<T>(std::int64_t(bits() % std::uint64_t(n.x)),
                    std::int64_t(bits() % std::uint64_t(n.y)),
                    std::int64_t(bits() % std::uint64_t(n.z))) = static_cast<T>(60 + 6 * spot);
    return data;
}

Data with_octree(const Data& in, const Ask& ask, double tolerance) {
    const Transition edge = octree();
    const Offer offer = edge.offer(in.what, ask, {{"tolerance", tolerance}});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::sharing(in, offer.to);
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(in.what.extent), context);
    return out;
}

Data through_octree(const Data& in, const Ask& ask, double tolerance, double step = 1) {
    return looking::made(octree_cast(), with_octree(in, ask, tolerance), ask, {{"step", step}});
}

Parameters foh(double step) { return {{"filter", "foh"}, {"step", step}}; }

Data by_rays(const Data& in, const Ask& ask, double step = 1) {
    return looking::made(ray_cast(), in, ask, foh(step));
}

void expect_same(const Data& got, const Data& expected) {
    ASSERT_EQ(got.what.extent, expected.what.extent);
    for (std::int64_t i = 0; i < got.what.samples() * got.what.channels; ++i)
        ASSERT_EQ(std::memcmp(got.as<float>() + i, expected.as<float>() + i, sizeof(float)), 0)
            << "number " << i << ": " << got.as<float>()[i] << " for " << expected.as<float>()[i];
}

void expect_near(const Data& got, const Data& expected, double tolerance) {
    ASSERT_EQ(got.what.extent, expected.what.extent);
    for (std::int64_t i = 0; i < got.what.samples() * got.what.channels; ++i)
        ASSERT_NEAR(got.as<float>()[i], expected.as<float>()[i], tolerance) << "number " << i;
}

void add_transfer(Request& want, double scale, double offset, bool grey = false) {
    const auto point = [&](double stored, double opacity, std::array<double, 3> color) {
        if (grey) color[1] = color[2] = color[0];
        want.transfer.points.push_back({scale * stored + offset, opacity, color});
    };
    point(3, 0, {0.2, 0.1, 0});
    point(19, 0.05, {0.2, 0.4, 0.9});
    point(45, 0.1, {1, 0.6, 0.3});
    point(95, 0.8, {1, 1, 0.9});
    if (scale < 0) std::reverse(want.transfer.points.begin(), want.transfer.points.end());
}

std::vector<Request> looks(Mode mode, const Extent& n) {
    std::vector<Request> all;
    all.push_back(seen(mode, n, {60, 50, 90}, Matrix3d::Identity()));
    all.push_back(seen(mode, n, {75, 50, 90}, turn(33, {3, -2, 1})));
    all.push_back(seen(mode, n, {55, 64, 90}, turn(157, {1, 2, -1}), Vec3(1, 1.7, 1.3), 0.7));
    all.push_back(seen(mode, n, {60, 60, 90}, turn(40, {1, 0, 0})));
    const std::vector<HalfSpace> planes{{Vec3(1, 2, -1).normalized(), -9}, {Vec3::UnitY(), -6.3}};
    all.back().clips = {clip_of(n, planes)};
    all.push_back(seen(mode, n, {50, 50, 90}, turn(25, {1, 1, 0})));
    all.back().eye = Eye{.at = Vec3(24.5, 24.5, -30), .plane = 40};
    all.push_back(all.back());
    all.back().eye = Eye{.at = Vec3(24.5, 24.5, 40), .plane = 60};  // inside the data
    for (Request& want : all) want.miss = mode->negated ? 1e4 : -1e4;
    return all;
}

template <class T>
void sweep_extremes(const ValueMap& values) {
    const Scene scene;
    for (const char* name : {"mip", "minip"})
        for (const Extent& n : {Extent{37, 29, 41}, Extent{1, 1, 1}, Extent{9, 1, 8},
                                Extent{1, 30, 1}, Extent{70, 3, 17}}) {
            const Data in = blocks<T>(n, values);
            for (const Request& want : looks(mode_named(name), n))
                for (const double step : {1.0, 0.4, 2.7}) {
                    SCOPED_TRACE(std::string(name) + " " + std::string(name_of(in.what.type)) +
                                 " " + std::to_string(n.x) + " " + std::to_string(step));
                    const Ask ask{want, scene};
                    expect_same(through_octree(in, ask, 0, step), by_rays(in, ask, step));
                }
        }
}

TEST(OctreeCast, ExtremesAreTheCastersBitForBit) {
    sweep_extremes<std::uint8_t>({});
    sweep_extremes<std::int16_t>({-0.5, 7});
    sweep_extremes<float>({2, -1});
    sweep_extremes<double>({});
}

/// Both add up the same samples. The caster's sums of f32 round once a cell, below 2^-24 of the
/// sum of their sizes each; those here once in eight.
TEST(OctreeCast, SumsAreTheCastersButForTheirRounding) {
    const Scene scene;
    const Extent n{37, 29, 41};
    for (const char* name : {"xray", "mean"})
        for (const double step : {1.0, 0.4, 2.7})
            for (Request want : looks(mode_named(name), n)) {
                SCOPED_TRACE(name + std::to_string(step));
                want.zero = mode_named(name)->takes_zero ? 2 : 0;
                const Ask ask{want, scene};
                const double cells = 75 / step, largest = 2 * 110;
                const double size = *name == 'm' ? largest : 75 * largest;
                for (const Data& in : {blocks<std::uint8_t>(n), blocks<float>(n, {-2, 1})})
                    expect_near(through_octree(in, ask, 0, step), by_rays(in, ask, step),
                                (cells + 8) * 0x1p-24 * size);
            }
}

/// What a leaf lets through is worked out once: the caster multiplies once a cell, and rounds by
/// a few 2^-24 of what is left. Where rays end differs by kTerminated.
TEST(OctreeCast, CompositesAreTheCastersButForTheirRounding) {
    const Scene scene;
    const Extent n{37, 29, 41};
    for (const bool grey : {false, true})
        for (const double step : {1.0, 0.4, 2.7})
            for (Request want : looks(Mode::composite, n)) {
                add_transfer(want, 1, 0, grey);
                const Ask ask{want, scene};
                const double tolerance = kTerminated + 75 / step * 8 * 0x1p-24;
                expect_near(through_octree(blocks<std::uint8_t>(n), ask, 0, step),
                            by_rays(blocks<std::uint8_t>(n), ask, step), tolerance);
                Request falls = want;
                falls.transfer.points.clear();
                add_transfer(falls, -2, 1, grey);
                const Ask turned{falls, scene};
                const Data in = blocks<float>(n, {-2, 1});
                expect_near(through_octree(in, turned, 0, step), by_rays(in, turned, step),
                            tolerance);
            }
}

/// Ray by ray in f64, by a reference that knows no stretches.
TEST(OctreeCast, IsTheSumOverEachRayInF64) {
    const Scene scene;
    const Extent n{37, 29, 41};
    const Data in = blocks<float>(n);
    for (const char* name : {"mip", "xray", "mean", "composite"}) {
        const Mode mode = mode_named(name);
        for (Request want : looks(mode, n)) {
            SCOPED_TRACE(name);
            if (mode->takes_transfer) add_transfer(want, 1, 0);
            const Ask ask{want, scene};
            const Data got = through_octree(in, ask, 0, 0.7);
            const std::optional<kernels::Kept> kept = kept_of(in.what, want, 0);
            const kernels::RayCast cast{.volume = kernels::grid_of(in),
                                        .rule = mode->combine,
                                        .rays = rays_of(in.what, want, 0, -0.5),
                                        .kept = kept ? &*kept : nullptr,
                                        .step = 0.7,
                                        .miss = want.miss};
            std::vector<kernels::OpticsPoint> points;
            for (const Transfer::Point& point : want.transfer.points)
                points.push_back({point.value, point.opacity, point.color});
            // f32 places are off by 2^-23 of up to 80 samples, on slopes of up to 110 a sample:
            // 1e-3 a sample. Of steps of the transfer function that is 1e-3 / 4 of an opacity.
            const double one = 1.2e-3, cells = 75 / 0.7;
            const double tolerance = mode->takes_transfer            ? kTerminated + 2e-3
                                     : mode->combine == Combine::sum ? one * cells * 0.7
                                                                     : one;
            for (std::int64_t y = 0; y < want.screen.y; y += 3)
                for (std::int64_t x = 0; x < want.screen.x; x += 3) {
                    const auto exact = kernels::reference(cast, points, 1, double(x), double(y));
                    for (int c = 0; c < got.what.channels; ++c)
                        ASSERT_NEAR(got.at<float>(x, y, 0)[c], exact[std::size_t(c)], tolerance)
                            << x << ' ' << y << ' ' << c;
                }
        }
    }
}

/// All of it is one leaf: 1 - (1 - a)^L of any length, the value, and its integral.
TEST(OctreeCast, ASlabIsCrossedInOneStep) {
    const Extent n{40, 40, 25};
    const Data in = looking::volume(n, [](auto, auto, auto) { return 5; });
    const Scene scene;
    Request want = seen(Mode::composite, n, {30, 30, 41}, Matrix3d::Identity());
    want.transfer.points = {{0, 0, {0, 0, 0}}, {10, 0.06, {1, 0.5, 0.25}}};
    const double opacity = 1 - std::pow(1 - 0.03, 25);
    for (const double step : {1.0, 0.3, 4.0}) {
        const Data got = through_octree(in, {want, scene}, 0, step);
        for (int c = 0; c < 4; ++c) {
            const double color = c == 3 ? 1 : std::array{0.5, 0.25, 0.125}[std::size_t(c)];
            // f32 opacity, its power and a product.
            EXPECT_NEAR(got.at<float>(15, 15, 0)[c], color * opacity, 8 * 25 * 0x1p-24);
        }
    }
    want.mode = Mode::xray;
    EXPECT_NEAR(*through_octree(in, {want, scene}, 0).at<float>(9, 3, 0), 125, 125 * 0x1p-22);
    want.mode = Mode::mean;
    EXPECT_EQ(*through_octree(in, {want, scene}, 0).at<float>(9, 3, 0), 5);

    // Counted: one look a ray, no sample.
    const Ask ask{want, scene};
    const Data beside = with_octree(in, ask, 0);
    const auto tree = octree_of(beside);
    const Offer offer = octree_cast().offer(beside.what, ask, {{"step", 1.0}});
    const StretchRays rays(offer, ask, beside, 0);
    kernels::OctreeStops stops{.tree = &tree->tree, .stops = {}};
    stops.stops.resize(tree->tree.nodes.size());
    kernels::see_nodes(rays.cast().rule, false, nullptr, 0, std::int64_t(tree->tree.nodes.size()),
                       stops);
    kernels::StretchesTaken taken;
    std::array<float, 100> out;
    kernels::stretch_cast({.cast = rays.cast(), .octree = &stops, .taken = &taken}, 5, 5, 10, 10,
                          out.data(), 10);
    EXPECT_EQ(taken.looks, 100);
    EXPECT_EQ(taken.crossed, 100);
    EXPECT_EQ(taken.samples, 0);
    EXPECT_EQ(taken.unsampled, 2500);
}

struct Off {
    double most = 0, rms = 0;  // over rays that meet the data

    Off(const Data& got, const Data& exact, const Request& want, const Data& in) {
        kernels::RayCast cast;
        cast.volume.extent = in.what.extent;
        cast.rays = rays_of(in.what, want, 0, -0.5);
        double squares = 0, count = 0;
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                if (!kernels::ray_path(cast, double(x), double(y)).hit()) continue;
                for (int c = 0; c < got.what.channels; ++c) {
                    const double off =
                        double(got.at<float>(x, y, 0)[c]) - double(exact.at<float>(x, y, 0)[c]);
                    most = std::max(most, std::abs(off));
                    squares += off * off;
                    ++count;
                }
            }
        rms = std::sqrt(squares / count);
    }
};

/// The bundled head, or nothing.
std::optional<Data> head() {
    const char* folder = std::getenv("EDGEWISE_DATA");
    if (!folder) return {};
    Representation what;
    what.type = Type::i16;
    what.extent = {64, 64, 93};
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (int slice = 1; slice <= 93; ++slice) {
        std::ifstream file(std::string(folder) + "/ct_head/quarter." + std::to_string(slice),
                           std::ios::binary);
        file.read(reinterpret_cast<char*>(data.at<std::int16_t>(0, 0, slice - 1)), 64 * 64 * 2);
        if (!file) return {};
    }
    return data;
}

/// No pixel of an extreme or a mean is off by more than the farthest sample of a leaf, and what is
/// predicted holds for all modes. A sum's bound is proved: its square is no more than the length
/// times the integral of squares, which over all rays is the variance of the leaves.
void expect_predicted(const Data& in, const Scene& bare, const Vec3& spacing, double opacity) {
    for (const double tolerance : {0.002, 0.01, 0.04})
        for (const char* name : {"mip", "minip", "xray", "mean", "composite"})
            for (const double degrees : {0.0, 33.0, 110.0}) {
                SCOPED_TRACE(name + std::to_string(degrees) + " " + std::to_string(tolerance));
                const Mode mode = mode_named(name);
                Request want =
                    seen(mode, in.what.extent, {110, 120, 200}, turn(degrees, {3, -2, 1}), spacing);
                Scene scene = bare;
                const double low = scene.low, high = scene.high;
                want.transfer.points = {{low, 0, {0.1, 0, 0}},
                                        {0.7 * low + 0.3 * high, 0, {0.4, 0.2, 0.1}},
                                        {high, opacity, {1, 0.9, 0.8}}};
                octree().count(in, want, scene.facts, std::pmr::new_delete_resource());
                const Ask ask{want, scene};
                const Data beside = with_octree(in, ask, tolerance);
                const Transition cast = octree_cast();
                const Offer offer = cast.offer(beside.what, ask, {{"step", 1.0}});
                const Offer before = octree().offer(in.what, ask, {{"tolerance", tolerance}});
                const double gain = cast.error(offer, ask).gain;
                const double predicted = gain * octree().error(before, ask).bias;
                EXPECT_LE(predicted, gain * octree().error(before, {want, bare}).bias);
                const Off off(looking::made(cast, beside, ask, {{"step", 1.0}}), by_rays(in, ask),
                              want, in);
                EXPECT_LE(off.rms, predicted);
                EXPECT_TRUE(off.rms > 0 || tolerance < 0.03);
                const double range = high - low;
                if (mode->combine == Combine::max || mode->combine == Combine::mean) {
                    EXPECT_LE(off.most, 4 * tolerance * range + 1e-3);
                } else if (mode->combine == Combine::sum) {
                    // What the leaves are, not what they may be.
                    EXPECT_LE(off.rms, gain * std::sqrt(octree_of(beside)->tree.variance) + 1e-3);
                }
            }
}

TEST(OctreeCast, ErrsByWhatIsPredictedOfAHead) {
    const std::optional<Data> in = head();
    if (!in) GTEST_SKIP() << "EDGEWISE_DATA is not set";
    Scene scene;
    const auto [low, high] =
        std::minmax_element(in->as<std::int16_t>(), in->as<std::int16_t>() + in->what.samples());
    scene.low = *low;
    scene.high = *high;
    expect_predicted(*in, scene, Vec3(3.2, 3.2, 1.5) / 1.5, 0.3);
}

/// A slope that is the same along all rays: errors of leaves behind one another do not cancel.
TEST(OctreeCast, ErrsByWhatIsPredictedOfASlopeAndNoise) {
    std::mt19937 bits(3);
    std::normal_distribution<double> noise(0, 0.004);
    const Data in = looking::volume({60, 50, 70}, [&](auto x, auto y, auto z) {
        if (z % 70 < 2 && y < 2) return double(x % 2);  // the ends of the range
        return 0.2 + 0.005 * double(x) + 0.0005 * double(y) + noise(bits);
    });
    Scene scene;
    scene.low = 0;
    scene.high = 1;
    expect_predicted(in, scene, Vec3::Ones(), 0.2);
}

/// A leaf whose samples lie on both sides of a steep rise is sampled: what a mean on one side would
/// be off by.
TEST(OctreeCast, SteepOpacitiesAreSampled) {
    std::mt19937 bits(3);
    const Extent n{40, 40, 40};
    const Data in = looking::volume(n, [&](auto x, auto y, auto) {
        return x + y == 0 ? 1000.0 : 100 + 0.1 * double(bits() % 100);
    });
    Scene scene;
    scene.low = 100;
    scene.high = 1000;
    Request want = seen(Mode::composite, n, {60, 60, 60}, turn(33, {3, -2, 1}));
    want.transfer.points = {{104, 0, {1, 1, 1}}, {106, 0.05, {1, 1, 1}}};
    const Ask ask{want, scene};
    const double tolerance = kTerminated + 75 * 8 * 0x1p-24;
    expect_near(through_octree(in, ask, 0.01), by_rays(in, ask), tolerance);
    // A gentle one is not.
    want.transfer.points = {{100, 0, {1, 1, 1}}, {900, 0.05, {1, 1, 1}}};
    const Off off(through_octree(in, ask, 0.01), by_rays(in, ask), want, in);
    EXPECT_GT(off.most, 1e-6);
    EXPECT_LT(off.most, 0.01);
}

TEST(OctreeCast, PassesOverWhatIsNotFinite) {
    const Extent n{33, 30, 27};
    Data in = blocks<float>(n);
    std::mt19937 bits(11);
    for (int i = 0; i < 60; ++i) {
        const float odd[] = {std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity()};
        in.as<float>()[bits() % std::uint32_t(n.samples())] = odd[i % 3];
    }
    for (std::int64_t z = 0; z < 20; ++z)
        for (std::int64_t y = 0; y < 20; ++y)
            std::fill_n(in.at<float>(0, y, z), 20, std::numeric_limits<float>::quiet_NaN());
    Scene scene;
    scene.non_finite = 8060;
    const Data none = looking::volume(n, [](auto, auto, auto) { return std::nan(""); });
    for (const char* name : {"mip", "minip", "mean", "xray", "composite"})
        for (Request& want : looks(mode_named(name), n)) {
            SCOPED_TRACE(name);
            add_transfer(want, 1, 0);
            const Ask ask{want, scene};
            const bool extreme = want.mode->combine == Combine::max;
            const double tolerance = want.mode->takes_transfer ? kTerminated + 1e-4 : 75e-6 * 110;
            for (const Data* data : {&std::as_const(in), &none})
                if (extreme)
                    expect_same(through_octree(*data, ask, 0), by_rays(*data, ask));
                else
                    expect_near(through_octree(*data, ask, 0), by_rays(*data, ask), tolerance);
        }
}

TEST(OctreeCast, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{70, 60, 50};
    const Data in = blocks<std::int16_t>(n);
    const Scene scene;
    for (const char* name : {"mip", "xray", "mean", "composite"}) {
        Request want = seen(mode_named(name), n, {131, 99, 110}, turn(52, {3, -2, 1}));
        add_transfer(want, 1, 0);
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return through_octree(in, ask, 0.02);
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u}) expect_same(with(threads), one);
        const Data beside = with_octree(in, ask, 0.02);
        const Offer offer = octree_cast().offer(beside.what, ask, {{"step", 1.0}});
        const Region box{{41, 13, 0}, {102, 66, 1}};
        Data part = Data::make(offer.to, box, std::pmr::new_delete_resource());
        Context context{.memory = std::pmr::new_delete_resource()};
        octree_cast().run(offer, ask, beside, part, box, context);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(41, y, 0), one.at<float>(41, y, 0),
                                     61 * sizeof(float) * std::size_t(one.what.channels)))
                << name << ' ' << y;
    }
}

TEST(OctreeCast, Refuses) {
    Representation what;
    what.extent = {30, 30, 30};
    Request want = seen(Mode::mip, what.extent, {40, 40, 40}, Matrix3d::Identity());
    const Scene scene;
    const auto refused = [&] {
        return octree_cast().offer(what, {want, scene}, {{"step", 1.0}}).refused;
    };
    EXPECT_EQ(refused(), "");
    want.mode = mode_named("stddev");
    EXPECT_NE(refused().find("stddev"), std::string::npos);
    want.mode = Mode::composite;
    EXPECT_EQ(refused(), "");
    want.transfer.edges = {{0, 0}, {1, 1}};
    EXPECT_NE(refused().find("gradients"), std::string::npos);
    want.transfer.edges.clear();
    want.cue = DepthCue{};
    EXPECT_NE(refused().find("falls off"), std::string::npos);
    want.cue.reset();
    want.field = Field::nearest;
    EXPECT_NE(refused().find("labels"), std::string::npos);
    want.field = Field::spline;
    want.job = Job::warp;
    EXPECT_NE(refused().find("not a picture"), std::string::npos);
}

}  // namespace
}  // namespace edgewise
