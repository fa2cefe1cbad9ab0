#include "transitions/store/reduce.hpp"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>

#include "graph/with_type.hpp"

namespace edgewise {
namespace {

Request pictures_of(const Extent& input, const Vec3& spacing) {
    Request want;
    want.job = Job::render;
    want.input = input;
    want.spacing = spacing;
    want.screen = {8, 8, 8};
    return want;
}

Representation volume(const Extent& extent, Type type = Type::f32) {
    Representation what;
    what.extent = extent;
    what.type = type;
    return what;
}

template <class Value>
Data filled(const Representation& what, Value&& value) {
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::int64_t i = 0;
    with_type(what.type, [&](auto sample) {
        using T = decltype(sample);
        for (; i < what.samples() * what.channels; ++i) data.as<T>()[i] = static_cast<T>(value(i));
    });
    return data;
}

Data made(const Transition& edge, const Data& in, const Request& want, int level) {
    const Scene scene;
    const Offer offer = edge.offer(in.what, {want, scene}, {{"level", std::to_string(level)}});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    const Partition parts = edge.parts(offer, {want, scene});
    for (const Region& region : regions_of(parts, offer))
        edge.run(offer, {want, scene}, in, out, region, context);
    return out;
}

std::string refused(const Representation& from, const Request& want, const Scene& scene = {},
                    int level = 1) {
    return reduce().offer(from, {want, scene}, {{"level", std::to_string(level)}}).refused;
}

/// The mean over [low, high) of samples that are voxels of width 1, along one axis after another.
double mean_of_box(const Data& in, const std::array<double, 3>& low,
                   const std::array<double, 3>& high) {
    const auto share = [&](int axis, std::int64_t i) {
        const auto a = static_cast<std::size_t>(axis);
        return std::max(0.0, std::min(high[a], double(i) + 1) - std::max(low[a], double(i)));
    };
    const Extent& n = in.what.extent;
    double sum = 0, weight = 0;
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const double w = share(0, x) * share(1, y) * share(2, z);
                if (w <= 0) continue;
                sum += w * double(in.at<float>(x, y, z)[0]);
                weight += w;
            }
    return sum / weight;
}

TEST(Reduce, CellsAreMeansOfTheVoxelsThatTheyCover) {
    // Even, odd and prime extents, and slices that lie further apart than pixels.
    for (const auto& [n, spacing] : {std::pair{Extent{16, 8, 12}, Vec3(1, 1, 1)},
                                     {Extent{13, 7, 5}, Vec3(1, 1, 1)},
                                     {Extent{17, 19, 9}, Vec3(0.9, 0.9, 2.5)},
                                     {Extent{31, 1, 6}, Vec3(2, 1, 1)}})
        for (const int level : {1, 2, 3}) {
            std::mt19937 random(7);
            std::uniform_real_distribution<double> any(-100, 900);
            const Data in = filled(volume(n), [&](std::int64_t) { return any(random); });
            const Request want = pictures_of(n, spacing);
            const Data out = made(reduce(), in, want, level);
            const Extent& m = out.what.extent;
            double total_in = 0, total_out = 0;
            for (std::int64_t z = 0; z < m.z; ++z)
                for (std::int64_t y = 0; y < m.y; ++y)
                    for (std::int64_t x = 0; x < m.x; ++x) {
                        const std::array<std::int64_t, 3> cell = {x, y, z};
                        std::array<double, 3> low, high;
                        for (std::size_t a = 0; a < 3; ++a) {
                            const int axis = static_cast<int>(a);
                            const double width = double(n[axis]) / double(m[axis]);
                            low[a] = double(cell[a]) * width;
                            high[a] = low[a] + width;
                        }
                        const double expected = mean_of_box(in, low, high);
                        // Three weights and two sums of at most 9 x 9 x 9 numbers below 1000.
                        EXPECT_NEAR(out.at<float>(x, y, z)[0], expected, 1000 * 0x1p-20)
                            << level << " " << x << " " << y << " " << z;
                        total_out += double(out.at<float>(x, y, z)[0]);
                    }
            for (std::int64_t i = 0; i < n.samples(); ++i) total_in += double(in.as<float>()[i]);
            EXPECT_NEAR(total_out / double(m.samples()), total_in / double(n.samples()), 1e-3);
        }
}

TEST(Reduce, CellsLieWhereTheirVoxelsAre) {
    const Extent n{12, 10, 7};
    const Request want = pictures_of(n, Vec3(1, 1, 3));
    const Scene scene;
    const Offer offer = reduce().offer(volume(n), {want, scene}, {{"level", "1"}});
    ASSERT_EQ(offer.refused, "");
    EXPECT_EQ(offer.to.space, "level1");
    // Slices lie 3 apart already.
    EXPECT_EQ(offer.to.extent, (Extent{6, 5, 7}));
    const Mat4 map = offer.to.placed.at(0).matrix();
    // The faces of the volume stay where they are.
    const Eigen::Vector4d near = map * Eigen::Vector4d(-0.5, -0.5, -0.5, 1),
                          far = map * Eigen::Vector4d(11.5, 9.5, 6.5, 1);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(near[axis], -0.5, 1e-12);
        EXPECT_NEAR(far[axis], double(offer.to.extent[axis]) - 0.5, 1e-12);
    }
}

TEST(Reduce, ReadsEveryTypeThroughItsValueMap) {
    const Extent n{9, 6, 4};
    const Request want = pictures_of(n, Vec3::Ones());
    for (const Type type :
         {Type::u8, Type::i8, Type::u16, Type::i16, Type::u32, Type::i32, Type::f32, Type::f64}) {
        Representation what = volume(n, type);
        what.values = {2, -5};
        const Data in = filled(what, [](std::int64_t) { return 100; });
        const Data out = made(reduce(), in, want, 1);
        for (std::int64_t i = 0; i < out.what.samples(); ++i)
            EXPECT_NEAR(out.as<float>()[i], 195, 195 * 0x1p-21) << name_of(type);
    }
}

TEST(Reduce, NumberOfThreadsChangesNothing) {
    const Extent n{37, 22, 41};
    const Request want = pictures_of(n, Vec3(1, 1, 1.7));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(0, 1);
    const Data in = filled(volume(n), [&](std::int64_t) { return any(random); });
    const Data one = [&] {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        return made(reduce(), in, want, 2);
    }();
    for (const std::size_t threads : {2, 7}) {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Data again = made(reduce(), in, want, 2);
        EXPECT_EQ(std::memcmp(one.samples.data(), again.samples.data(),
                              static_cast<std::size_t>(one.what.samples()) * sizeof(float)),
                  0);
    }
}

TEST(Reduce, RefusesWhatHasNoMeans) {
    const Extent n{8, 8, 8};
    const Request want = pictures_of(n, Vec3::Ones());
    EXPECT_EQ(refused(volume(n), want), "");
    Scene scene;
    scene.non_finite = 3;
    EXPECT_NE(refused(volume(n), want, scene).find("3 samples are not finite"), std::string::npos);
    Request labels = want;
    labels.field = Field::nearest;
    EXPECT_NE(refused(volume(n), labels).find("labels"), std::string::npos);
    Request warp = want;
    warp.job = Job::warp;
    EXPECT_NE(refused(volume(n), warp).find("values at points"), std::string::npos);
    Representation two = volume(n);
    two.channels = 2;
    EXPECT_NE(refused(two, want).find("2 channels"), std::string::npos);
    Representation cropped = volume({4, 8, 8});
    EXPECT_NE(refused(cropped, want).find("no longer lie"), std::string::npos);
    const Extent flat{1, 1, 1};
    EXPECT_NE(refused(volume(flat), pictures_of(flat, Vec3::Ones())).find("no axis"),
              std::string::npos);
}

/// Premultiplied colour and opacity of a medium that emits `light` for each bit of its depth.
std::array<float, 4> medium(double depth, double light) {
    const double opacity = -std::expm1(-depth);
    return {float(light * opacity), float(light * opacity / 2), 0, float(opacity)};
}

TEST(ReduceColored, DepthsAndEmittedLightAreAveraged) {
    const Extent n{8, 4, 4};
    Request want = pictures_of(n, Vec3::Ones());
    Representation what = volume(n);
    what.content = "colored";
    what.channels = 4;
    Data in = Data::make(what, std::pmr::new_delete_resource());
    // A shell one voxel thick, dense and bright, in a medium that is nearly clear.
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const auto here = x == 3 ? medium(6, 0.9) : medium(0.01, 0.3);
                std::copy(here.begin(), here.end(), in.at<float>(x, y, z));
            }
    const Data out = made(reduce_colored(), in, want, 1);
    ASSERT_EQ(out.what.extent, (Extent{4, 2, 2}));
    const float* shell = out.at<float>(1, 0, 0);
    const double depth = (6 + 0.01) / 2, light = (6 * 0.9 + 0.01 * 0.3) / 6.01;
    EXPECT_NEAR(shell[3], -std::expm1(-depth), 1e-6);
    EXPECT_NEAR(shell[0], -std::expm1(-depth) * light, 1e-6);
    EXPECT_NEAR(shell[1], shell[0] / 2, 1e-6);
    // What opacities themselves would average to is far more transparent.
    EXPECT_GT(shell[3], (-std::expm1(-6.0) - std::expm1(-0.01)) / 2 + 0.4);
    EXPECT_NEAR(out.at<float>(3, 1, 1)[3], -std::expm1(-0.01), 1e-7);
}

}  // namespace
}  // namespace edgewise
