#include "surface/nets.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <tbb/task_arena.h>

#include "surface/mesh_measures.hpp"
#include "tests/surface/mesh_checks.hpp"

namespace edgewise::surface {
namespace {

std::pmr::memory_resource* const kMemory = std::pmr::get_default_resource();

Mesh net_of(const Data& data, double smooth = 1, const Mat4& place = Mat4::Identity()) {
    return surface_nets(data, 0, smooth, place, kMemory);
}

template <class T>
Data random_labels(std::mt19937& random, Type type, const Extent& n, int labels) {
    return volume_of<T>(n, type, [&](auto, auto, auto) {
        return static_cast<int>(random() % static_cast<unsigned>(labels + 1));
    });
}

TEST(SurfaceNets, AreClosedManifoldsOfAnyLabels) {
    std::mt19937 random(1);
    for (int round = 0; round < 80; ++round) {
        const auto side = [&] { return static_cast<std::int64_t>(1 + random() % 7); };
        const Extent n{side(), side(), side()};
        const int labels = 1 + round % 4;
        const Mesh bytes = net_of(random_labels<std::uint8_t>(random, Type::u8, n, labels));
        ASSERT_EQ(no_manifold(bytes), "") << round;
        ASSERT_TRUE(measures_of(bytes, kMemory).closed);
        const Mesh floats = net_of(random_labels<float>(random, Type::f32, n, labels));
        ASSERT_EQ(no_manifold(floats), "") << round;
    }
}

TEST(SurfaceNets, GiveEachLabelASurfaceOfItsOwn) {
    // Two halves of a box.
    const Data data = volume_of<std::int16_t>({14, 10, 10}, Type::i16, [](auto x, auto y, auto z) {
        const bool inside = x >= 2 && x < 12 && y >= 2 && y < 8 && z >= 2 && z < 8;
        return !inside ? 0 : x < 7 ? 300 : -5;
    });
    const Mesh mesh = net_of(data, 0);
    EXPECT_EQ(mesh.labels, (std::vector<double>{-5, 300}));
    EXPECT_EQ(no_manifold(mesh), "");
    EXPECT_EQ(euler_number(mesh), 4);
    EXPECT_NEAR(measures_of(mesh, kMemory).volume.value(), 360, 1e-9);
    // No vertex is of both.
    std::map<std::uint32_t, std::uint32_t> group_of;
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t)
        for (const std::uint32_t v : mesh.triangles()[t])
            EXPECT_EQ(group_of.emplace(v, mesh.groups()[t]).first->second, mesh.groups()[t]);
}

TEST(SurfaceNets, AreSmoothAndStayInTheirCells) {
    const double radius = 15;
    const Data data = volume_of<std::uint8_t>({40, 40, 40}, Type::u8, [&](auto x, auto y, auto z) {
        return std::hypot(double(x) - 19.5, double(y) - 19.5, double(z) - 19.5) <= radius ? 9 : 0;
    });
    const double pi = std::numbers::pi;
    const Measures rough = measures_of(net_of(data, 0), kMemory);
    const Mesh mesh = net_of(data);
    const Measures smooth = measures_of(mesh, kMemory);
    EXPECT_EQ(euler_number(mesh), 2);
    EXPECT_LT(smooth.area, rough.area);
    // Which samples are inside says where the surface is to half a sample at best; averaged over
    // the ball to 1 % and 3 %.
    EXPECT_NEAR(smooth.area, 4 * pi * radius * radius, 0.03 * 4 * pi * radius * radius);
    EXPECT_NEAR(smooth.volume.value(), 4 * pi / 3 * std::pow(radius, 3),
                0.03 * 4 * pi / 3 * std::pow(radius, 3));
    for (std::size_t v = 0; v < mesh.positions().size(); ++v) {
        const auto& p = mesh.positions()[v];
        const auto& n = mesh.normals()[v];
        const Vec3 out = Vec3(p[0], p[1], p[2]) - Vec3::Constant(19.5);
        // From the corner of voxels that are inside or not, half a step along each axis.
        ASSERT_NEAR(out.norm(), radius, std::sqrt(3.0));
        ASSERT_GT(out.normalized().dot(Vec3(n[0], n[1], n[2])), 0.9);
    }
}

TEST(SurfaceNets, HaveTheSameBytesForAnyNumberOfThreads) {
    std::mt19937 random(3);
    const Data data = random_labels<std::uint8_t>(random, Type::u8, {40, 31, 19}, 5);
    const Mesh expected = net_of(data);
    for (const int threads : {1, 2, 7}) {
        tbb::task_arena arena(threads);
        arena.execute([&] { EXPECT_TRUE(same_bytes(net_of(data), expected)) << threads; });
    }
}

TEST(SurfaceNets, TurnOutwardsInMirroredFrames) {
    Mat4 place = Mat4::Identity();
    place.topLeftCorner<3, 3>() << -1, 0, 0, 0, 1, 0, 0, 0, 1;
    std::mt19937 random(4);
    const Data data = random_labels<std::uint8_t>(random, Type::u8, {9, 9, 9}, 2);
    const double here = measures_of(net_of(data), kMemory).volume.value();
    // Positions are rounded to f32: 1e-7 of each volume.
    EXPECT_NEAR(measures_of(net_of(data, 1, place), kMemory).volume.value(), here, 1e-6 * here);
}

TEST(SurfaceNets, AreClosedAtTheScansEndsAndAroundSamplesThatAreNotFinite) {
    const Data half =
        volume_of<float>({6, 6, 6}, Type::f32, [](auto x, auto, auto) { return x < 3 ? 1 : 0; });
    for (const double smooth : {0.0, 1.0}) {
        const Mesh block = net_of(half, smooth);
        // Nothing bends but at the ends, which stay flat.
        EXPECT_NEAR(measures_of(block, kMemory).volume.value(), 3 * 6 * 6, 1e-9);
        EXPECT_NEAR(measures_of(block, kMemory).area, 2 * 36 + 4 * 18, 1e-9);
        EXPECT_EQ(no_manifold(block), "");
    }
    Data data = volume_of<float>({9, 9, 9}, Type::f32, [](auto x, auto y, auto z) {
        return std::max({std::abs(x - 4), std::abs(y - 4), std::abs(z - 4)}) <= 2 ? 1 : 0;
    });
    *data.at<float>(4, 4, 4) = std::numeric_limits<float>::quiet_NaN();
    *data.at<float>(2, 4, 4) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(net_of(data).labels, std::vector<double>{1});
    EXPECT_NEAR(measures_of(net_of(data, 0), kMemory).volume.value(), 123, 1e-9);
    EXPECT_EQ(no_manifold(net_of(data)), "");
}

TEST(SurfaceNets, AreEmptyWhereThereAreNoLabels) {
    for (const Extent n : {Extent{1, 1, 1}, Extent{5, 5, 1}, Extent{5, 1, 5}, Extent{5, 5, 5}}) {
        const Data data = volume_of<std::uint8_t>(n, Type::u8, [](auto, auto, auto) { return 0; });
        EXPECT_TRUE(net_of(data).triangles().empty());
    }
}

TEST(SurfaceNets, KnowTheBackgroundByItsValue) {
    Data data = volume_of<std::uint8_t>({6, 6, 6}, Type::u8, [](auto x, auto y, auto z) {
        return x == 3 && y == 3 && z == 3 ? 20 : 10;
    });
    data.what.values = {-0.5, 5};  // 10 is 0, 20 is -5
    const Mesh mesh = net_of(data);
    EXPECT_EQ(mesh.labels, std::vector<double>{-5});
    EXPECT_EQ(euler_number(mesh), 2);
    // No sample means 0.3: all are labels.
    EXPECT_EQ(surface_nets(data, 0.3, 1, Mat4::Identity(), kMemory).labels,
              (std::vector<double>{-5, 0}));
}

}  // namespace
}  // namespace edgewise::surface
