// Parts, fewer triangles and smoothing of meshes, and lids, on small meshes that are made here.
#include "surface/finish.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "surface/flying_edges.hpp"
#include "surface/lids.hpp"
#include "surface/mesh_measures.hpp"
#include "tests/surface/mesh_checks.hpp"

namespace edgewise::surface {
namespace {

auto* const kMemory = std::pmr::get_default_resource();

Mesh surface_of(const Data& data, double isovalue) {
    return flying_edges(data, isovalue, Mat4::Identity(), kMemory);
}

Data two_balls(double first, double second) {
    return volume_of<float>({40, 20, 20}, Type::f32, [=](auto x, auto y, auto z) {
        const auto away = [&](double from) {
            return std::hypot(double(x) - from, double(y) - 9.5, double(z) - 9.5);
        };
        return static_cast<float>(std::max(first - away(10), second - away(30)));
    });
}

TEST(FinishedMesh, KeepsTheLargestPart) {
    for (const auto& [first, second] : {std::pair{7.0, 5.0}, {4.0, 8.0}}) {
        const Mesh both = surface_of(two_balls(first, second), 0),
                   one = largest_part(both, kMemory);
        EXPECT_EQ(no_manifold(one), "");
        EXPECT_LT(one.triangles().size(), both.triangles().size());
        const double larger = std::max(first, second), middle = first > second ? 10 : 30;
        for (const Float3& p : one.positions()) EXPECT_NEAR(p[0], middle, larger + 0.01);
    }
    EXPECT_TRUE(largest_part(Mesh(), kMemory).triangles().empty());
}

TEST(FinishedMesh, HasLidsInTheOutermostPlanes) {
    const Data full = volume_of<std::int16_t>({4, 5, 6}, Type::i16,
                                              [](auto, auto, auto) { return std::int16_t{-7}; });
    Mat4 back = Mat4::Identity();
    back.topRightCorner<3, 1>().setConstant(-1);
    const Mesh mesh = flying_edges(with_frame(full, kMemory), -8, back, kMemory);
    EXPECT_EQ(no_manifold(mesh), "");
    EXPECT_NEAR(measures_of(mesh, kMemory).volume.value(), 3 * 4 * 5, 1e-4);
    // What is not finite stays so, and makes no triangle.
    Data hole = volume_of<float>({4, 4, 4}, Type::f32, [](auto x, auto y, auto z) {
        return x == 1 && y == 1 && z == 1 ? NAN : 1.0F;
    });
    EXPECT_FALSE(
        measures_of(flying_edges(with_frame(hole, kMemory), 0, back, kMemory), kMemory).triangles ==
        0);
}

TEST(FinishedMesh, StaysAManifoldWithFewerTriangles) {
    if (!can_decimate()) GTEST_SKIP() << "made without meshoptimizer";
    for (const double isovalue : {0.0, 0.37})
        for (const double share : {0.3, 0.8, 0.95}) {
            // Of whole radii many samples lie on the surface, and vertices in one place.
            const Mesh all = surface_of(two_balls(7, 5), isovalue);
            const Mesh few = decimated(all, share, kMemory);
            EXPECT_EQ(no_manifold(few), "") << isovalue << ' ' << share;
            EXPECT_NEAR(double(few.triangles().size()),
                        (1 - share) * double(all.triangles().size()),
                        0.05 * double(all.triangles().size()));
        }
}

TEST(FinishedMesh, IsSmoothWithoutShrinking) {
    const Data mask = volume_of<std::uint8_t>({24, 24, 24}, Type::u8, [](auto x, auto y, auto z) {
        return std::uint8_t(std::hypot(double(x) - 12, double(y) - 12, double(z) - 12) < 8);
    });
    const Mesh rough = surface_of(mask, 0.5), smooth = smoothed(rough, 1, kMemory);
    EXPECT_EQ(no_manifold(smooth), "");
    const Measures before = measures_of(rough, kMemory), after = measures_of(smooth, kMemory);
    EXPECT_NEAR(after.volume.value() / before.volume.value(), 1, 0.02);
    EXPECT_LT(after.area, 0.97 * before.area);
    for (std::size_t v = 0; v < smooth.normals().size(); ++v) {
        const Float3 &n = smooth.normals()[v], &p = smooth.positions()[v];
        const double out = n[0] * (p[0] - 12) + n[1] * (p[1] - 12) + n[2] * (p[2] - 12);
        EXPECT_GT(out / std::hypot(p[0] - 12, p[1] - 12, p[2] - 12), 0.9);
    }
}

}  // namespace
}  // namespace edgewise::surface
