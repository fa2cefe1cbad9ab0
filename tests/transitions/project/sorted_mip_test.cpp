#include "transitions/project/sorted_mip.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/sorted_bricks.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;

Vec3 middle_of(const Extent& n) {
    return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2;
}

/// A volume turned about its middle, in steps of screen z that are `spacing` samples long.
Request turned(Mode mode, const Extent& input, double degrees, const Extent& screen,
               const Vec3& spacing = Vec3::Ones(), double zoom = 1) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    want.input = input;
    want.screen = screen;
    want.spacing = spacing;
    want.miss = mode->negated ? 1e4 : -1e4;
    const Matrix3d turn =
        Eigen::AngleAxisd(degrees * EIGEN_PI / 180, Vec3(3, -2, 1).normalized()).matrix();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() =
        Vec3(zoom, zoom, 1).asDiagonal() * turn * Matrix3d(spacing.asDiagonal());
    map.topRightCorner<3, 1>() = middle_of(screen) - map.topLeftCorner<3, 3>() * middle_of(input);
    want.views = Placement(map);
    return want;
}

template <class T>
constexpr Type kType = std::is_same_v<T, std::uint8_t>   ? Type::u8
                       : std::is_same_v<T, std::int16_t> ? Type::i16
                       : std::is_same_v<T, double>       ? Type::f64
                                                         : Type::f32;

/// Faint noise with bright spots and a bright rod.
template <class T>
Data spotted(const Extent& n, ValueMap values = {}) {
    Representation what;
    what.extent = n;
    what.type = kType<T>;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 bits(5);
    for (std::int64_t i = 0; i < n.samples(); ++i) data.as<T>()[i] = static_cast<T>(3 + bits() % 8);
    for (int spot = 0; spot < 25; ++spot)
        *data.at<T>(static_cast<std::int64_t>(bits() % n.x),
                    static_cast<std::int64_t>(bits() % n.y),
                    static_cast<std::int64_t>(bits() % n.z)) = static_cast<T>(40 + 3 * spot);
    for (std::int64_t x = 0; x < n.x; ++x) *data.at<T>(x, n.y / 2, n.z / 3) = static_cast<T>(100);
    return data;
}

Data with_facet(const Data& in, const Ask& ask) {
    const Transition edge = sorted_bricks();
    const Offer offer = edge.offer(in.what, ask, {});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::sharing(in, offer.to);
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(in.what.extent), context);
    return out;
}

Parameters by(const std::string& filter, double step) {
    return {{"filter", filter}, {"step", step}};
}

Data made(const Transition& edge, const Data& in, const Ask& ask, const Parameters& with) {
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "");
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    return out;
}

void expect_same(const Data& got, const Data& expected) {
    ASSERT_EQ(got.what.extent, expected.what.extent);
    for (std::int64_t i = 0; i < got.what.samples(); ++i)
        ASSERT_EQ(std::memcmp(got.as<float>() + i, expected.as<float>() + i, sizeof(float)), 0)
            << "pixel " << i << ": " << got.as<float>()[i] << " for " << expected.as<float>()[i];
}

void expect_same_as_cast(const Data& in, const Request& want, const std::string& filter,
                         double step, const Scene& scene = {}) {
    const Ask ask{want, scene};
    SCOPED_TRACE(std::string(want.mode->name) + " " + filter + " " + std::to_string(step) + " " +
                 std::string(name_of(in.what.type)));
    expect_same(made(sorted_mip(), with_facet(in, ask), ask, by(filter, step)),
                made(ray_cast(), in, ask, by(filter, step)));
}

template <class T>
void sweep(const ValueMap& values) {
    for (const char* name : {"mip", "minip"})
        for (const Extent& n :
             {Extent{37, 29, 41}, Extent{1, 1, 1}, Extent{9, 1, 8}, Extent{70, 3, 17}}) {
            const Data in = spotted<T>(n, values);
            for (const double degrees : {0.0, 33.0, 90.0, 157.0})
                for (const double step : {1.0, 0.4, 2.7})
                    for (const char* filter : {"zoh", "foh"})
                        expect_same_as_cast(in, turned(mode_named(name), n, degrees, {75, 50, 80}),
                                            filter, step);
        }
}

TEST(SortedMip, IsTheCasterBitForBit) {
    sweep<std::uint8_t>({});
    sweep<std::int16_t>({-0.5, 7});
    sweep<float>({2, -1});
}

TEST(SortedMip, IsTheCasterOfAnyShapeAndView) {
    const Extent n{45, 38, 51};
    const Data in = spotted<float>(n), bytes = spotted<std::uint8_t>(n), wide = spotted<double>(n);
    // Anisotropic samples; pixels far smaller than samples, and far larger.
    for (const double zoom : {0.2, 1.0, 4.3}) {
        const Request want = turned(Mode::mip, n, 61, {133, 101, 90}, Vec3(1, 1.7, 3), zoom);
        expect_same_as_cast(in, want, "foh", 1);
        expect_same_as_cast(bytes, want, "foh", 0.5);
        expect_same_as_cast(wide, want, "zoh", 1);
    }
    Request clipped = turned(Mode::mip, n, 25, {90, 90, 90});
    const std::vector<HalfSpace> planes{{Vec3(1, 2, -1).normalized(), -20}, {Vec3::UnitY(), -9.3}};
    clipped.clips = {clip_of(n, planes)};
    expect_same_as_cast(in, clipped, "foh", 1);
    expect_same_as_cast(bytes, clipped, "zoh", 0.7);
}

TEST(SortedMip, IsTheCasterOfSplines) {
    const Extent n{26, 31, 22};
    Data in = spotted<float>(n);
    in.what.content = "coefficients";
    for (const double degrees : {0.0, 47.0})
        for (const double step : {1.0, 0.3})
            expect_same_as_cast(in, turned(Mode::mip, n, degrees, {50, 50, 50}), "bspline3", step);
}

TEST(SortedMip, PassesOverWhatIsNotFinite) {
    const Extent n{33, 30, 27};
    Data in = spotted<float>(n);
    std::mt19937 bits(11);
    for (int i = 0; i < 300; ++i) {
        const float odd[] = {std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity()};
        in.as<float>()[bits() % static_cast<std::uint32_t>(n.samples())] = odd[i % 3];
    }
    // A box of bricks without a single number.
    for (std::int64_t z = 0; z < 20; ++z)
        for (std::int64_t y = 0; y < 20; ++y)
            std::fill_n(in.at<float>(0, y, z), 20, std::numeric_limits<float>::quiet_NaN());
    Scene scene;
    scene.non_finite = 8300;
    for (const double degrees : {0.0, 40.0})
        for (const char* filter : {"zoh", "foh"})
            expect_same_as_cast(in, turned(Mode::mip, n, degrees, {60, 60, 60}), filter, 1, scene);
    std::fill_n(in.as<float>(), n.samples(), std::numeric_limits<float>::quiet_NaN());
    expect_same_as_cast(in, turned(Mode::mip, n, 40, {60, 60, 60}), "foh", 1, scene);
}

/// Ray by ray in f64. Weights of narrow types have 14 bits: 3e-5 of what two samples differ by.
TEST(SortedMip, IsTheLargestSampleOfEachRay) {
    const Extent n{37, 29, 41};
    const Request want = turned(Mode::mip, n, 33, {60, 50, 80});
    const Scene scene;
    const Ask ask{want, scene};
    for (const Data& in : {spotted<float>(n), spotted<std::uint8_t>(n)}) {
        const Data got = made(sorted_mip(), with_facet(in, ask), ask, by("foh", 0.7));
        kernels::RayCast cast{.volume = kernels::grid_of(in),
                              .rays = rays_of(in.what, want, 0, -0.5),
                              .step = 0.7,
                              .miss = want.miss};
        for (std::int64_t y = 0; y < 50; ++y)
            for (std::int64_t x = 0; x < 60; ++x)
                ASSERT_NEAR(*got.at<float>(x, y, 0),
                            kernels::reference(cast, {}, 1, double(x), double(y))[0], 120 * 1e-4)
                    << x << ' ' << y;
    }
}

TEST(SortedMip, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{130, 70, 90};
    const Data in = spotted<std::int16_t>(n);
    const Request want = turned(Mode::mip, n, 52, {171, 99, 150});
    const Scene scene;
    const Ask ask{want, scene};
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return made(sorted_mip(), with_facet(in, ask), ask, by("foh", 1));
    };
    const Data one = with(1);
    for (const std::size_t threads : {2u, 7u}) expect_same(with(threads), one);

    const Data beside = with_facet(in, ask);
    const Offer offer = sorted_mip().offer(beside.what, ask, by("foh", 1));
    const Region box{{50, 13, 0}, {111, 66, 1}};
    Data part = Data::make(offer.to, box, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    sorted_mip().run(offer, ask, beside, part, box, context);
    for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
        ASSERT_EQ(
            0, std::memcmp(part.at<float>(50, y, 0), one.at<float>(50, y, 0), 61 * sizeof(float)))
            << y;
}

TEST(SortedMip, BricksAreSortedByWhatTheyHold) {
    const Extent n{21, 17, 30};
    const Data in = spotted<std::uint8_t>(n, {-1, 0});
    const Request want = turned(Mode::mip, n, 0, {40, 40, 40});
    const Scene scene;
    const Ask ask{want, scene};
    EXPECT_EQ(sorted_facet_of(want, in.what.values), "least-first");
    const Data beside = with_facet(in, ask);
    const kernels::SortedBricks sorted = sorted_bricks_of(beside, "least-first")->sorted;
    ASSERT_EQ(sorted.bricks.size(), 3u * 3 * 4);
    EXPECT_EQ(sorted.floor, -float(*std::max_element(in.as<std::uint8_t>(),
                                                     in.as<std::uint8_t>() + n.samples())));
    std::vector<bool> seen(sorted.bricks.size());
    float before = std::numeric_limits<float>::infinity();
    for (const kernels::SortedBrick& brick : sorted.bricks) {
        EXPECT_LE(brick.bound, before);
        before = brick.bound;
        EXPECT_FALSE(seen[static_cast<std::size_t>(brick.place)]);
        seen[static_cast<std::size_t>(brick.place)] = true;
        const std::int64_t i = brick.place % 3, j = brick.place / 3 % 3, k = brick.place / 9;
        // The samples that places of the brick read; along x whole groups of four.
        const auto least = [&](std::int64_t more) {
            float found = std::numeric_limits<float>::infinity();
            for (std::int64_t z = 8 * k; z < std::min(n.z, 8 * k + 9); ++z)
                for (std::int64_t y = 8 * j; y < std::min(n.y, 8 * j + 9); ++y)
                    for (std::int64_t x = 8 * i; x < std::min(n.x, 8 * i + 8 + more); ++x)
                        found = std::min(found, float(*in.at<std::uint8_t>(x, y, z)));
            return found;
        };
        EXPECT_GE(brick.bound, -least(1));
        EXPECT_LE(brick.bound, -least(4));
    }
}

/// Few bright spots on nothing: rays that see none of them need no cell at all.
TEST(SortedMip, SamplesFewCellsWhereLittleIsBright) {
    const Extent n{96, 96, 96};
    Data in = spotted<std::uint8_t>(n);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        if (in.as<std::uint8_t>()[i] < 20) in.as<std::uint8_t>()[i] = 0;
    const Request want = turned(Mode::mip, n, 20, {96, 96, 96});
    const Scene scene;
    const Ask ask{want, scene};
    const Data beside = with_facet(in, ask);
    const kernels::SortedBricks sorted = sorted_bricks_of(beside, "largest-first")->sorted;
    EXPECT_EQ(sorted.floor, 0);
    EXPECT_LT(sorted.bricks.size(), 200u);  // of 12^3
    kernels::Taken taken;
    kernels::RayCast cast{.volume = kernels::grid_of(in),
                          .rays = rays_of(in.what, want, 0, -0.5),
                          .miss = want.miss,
                          .taken = &taken};
    std::vector<float> plain(32 * 32), picture(32 * 32);
    kernels::ray_cast(cast, 32, 32, 32, 32, plain.data(), 32);
    std::vector<std::int32_t> order(sorted.bricks.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::int32_t>(i);
    // All bricks may matter to all pixels: the boxes along the rays say that they do not.
    const std::vector<std::array<float, 2>> middles(order.size(), {48, 48});
    kernels::Block<std::byte> room(kernels::sorted_room(), std::pmr::new_delete_resource());
    const std::int64_t sampled = kernels::sorted_mip(cast, sorted, {middles, 100, 100}, order, 32,
                                                     32, 32, 32, picture.data(), 32, room.data());
    EXPECT_EQ(plain, picture);
    EXPECT_GT(sampled, 0);
    EXPECT_LT(static_cast<double>(sampled), 0.25 * static_cast<double>(taken.samples));
}

TEST(SortedMip, ErrorIsThatOfTheCaster) {
    const Extent n{30, 30, 30};
    const Request want = turned(Mode::mip, n, 20, {40, 40, 40});
    Scene scene;
    scene.facts = {{"picture/foh/1", 0.3}, {"gain/blur", 2}, {"gain/noise/foh", 0.7}};
    const Ask ask{want, scene};
    const Data in = spotted<float>(n);
    const Data beside = with_facet(in, ask);
    const Offer sorted = sorted_mip().offer(beside.what, ask, by("foh", 1));
    const Offer cast = ray_cast().offer(in.what, ask, by("foh", 1));
    const Error got = sorted_mip().error(sorted, ask), expected = ray_cast().error(cast, ask);
    EXPECT_EQ(got.bias, expected.bias);
    EXPECT_EQ(got.noise, expected.noise);
    EXPECT_EQ(got.gain, expected.gain);
    EXPECT_EQ(got.noise_gain, expected.noise_gain);
    EXPECT_TRUE(got.known);
}

TEST(SortedMip, CountsFollowTheSamplesThatAreLeft) {
    const Extent n{200, 200, 200};
    const Request want = turned(Mode::mip, n, 20, {200, 200, 200});
    Representation what;
    what.extent = n;
    what.facets = {"largest-first"};
    Scene few, many;
    few.facts = {{"cast/all", 150}, {"cast/bricks", 12}};
    many.facts = {{"cast/all", 150}, {"cast/bricks", 45}};
    const auto gathers = [&](const Scene& scene, double step) {
        const Ask ask{want, scene};
        return sorted_mip().work(sorted_mip().offer(what, ask, by("foh", step)), ask, 0).gathers;
    };
    EXPECT_GT(gathers(many, 1), 3 * gathers(few, 1));
    EXPECT_GT(gathers(few, 0.5), 1.5 * gathers(few, 1));
}

TEST(SortedMip, Refuses) {
    const Extent n{30, 30, 30};
    const Scene scene;
    Representation what;
    what.extent = n;
    const auto refused = [&](const Request& want, const Representation& from) {
        const Ask ask{want, scene};
        const std::string first = sorted_bricks().offer(from, ask, {}).refused;
        EXPECT_NE(sorted_mip().offer(from, ask, by("foh", 1)).refused, "");
        return first;
    };
    Request eye = turned(Mode::mip, n, 10, {40, 40, 40});
    eye.eye = Eye{.at = Vec3(15, 15, -90), .plane = 0};
    EXPECT_NE(refused(eye, what).find("eye"), std::string::npos);
    EXPECT_NE(refused(turned(Mode::xray, n, 10, {40, 40, 40}), what).find("xray"),
              std::string::npos);
    Representation channels = what;
    channels.channels = 3;
    EXPECT_NE(refused(turned(Mode::mip, n, 10, {40, 40, 40}), channels).find("3 channels"),
              std::string::npos);
    Representation image = what;
    image.axes = 2;
    EXPECT_NE(refused(turned(Mode::mip, n, 10, {40, 40, 40}), image).find("depth"),
              std::string::npos);
    Request warp = turned(Mode::mip, n, 10, {40, 40, 40});
    warp.job = Job::warp;
    EXPECT_NE(refused(warp, what), "");
    // Most samples are needed anyway.
    Scene dense;
    dense.facts = {{"cast/all", 100}, {"cast/bricks", 60}};
    const Request want = turned(Mode::mip, n, 10, {40, 40, 40});
    EXPECT_NE(sorted_bricks().offer(what, {want, dense}, {}).refused.find("need 54 %"),
              std::string::npos);
    // Bricks of the other end, and filters that read what is not there.
    const Ask ask{want, scene};
    Representation other = what;
    other.facets = {"least-first"};
    EXPECT_NE(sorted_mip().offer(other, ask, by("foh", 1)).refused.find("other way round"),
              std::string::npos);
    other.facets = {"largest-first"};
    EXPECT_EQ(sorted_mip().offer(other, ask, by("foh", 1)).refused, "");
    EXPECT_NE(sorted_mip().offer(other, ask, by("bspline3", 1)).refused, "");
}

}  // namespace
}  // namespace edgewise
