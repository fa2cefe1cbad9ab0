#include "surface/flying_edges.hpp"

#include <bit>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <tbb/task_arena.h>

#include "graph/errors.hpp"
#include "surface/cell_cases.hpp"
#include "surface/level.hpp"
#include "surface/mesh_measures.hpp"
#include "tests/surface/mesh_checks.hpp"

namespace edgewise::surface {
namespace {

std::pmr::memory_resource* const kMemory = std::pmr::get_default_resource();

Mesh surface_at(const Data& data, double isovalue, const Mat4& place = Mat4::Identity()) {
    return flying_edges(data, isovalue, place, kMemory);
}

/// Integers 0 to 3 with a border of zeros.
template <class T>
Data random_integers(std::mt19937& random, Type type, const Extent& n) {
    return volume_of<T>(n, type, [&](auto x, auto y, auto z) {
        const bool border =
            x == 0 || y == 0 || z == 0 || x == n.x - 1 || y == n.y - 1 || z == n.z - 1;
        const int value = static_cast<int>(random() % 4);
        return border ? 0 : value;
    });
}

/// Distance from a centre, falling from it.
Data ball(std::int64_t n, double radius) {
    const double centre = static_cast<double>(n - 1) / 2;
    return volume_of<float>({n, n, n}, Type::f32, [&](auto x, auto y, auto z) {
        return radius - std::hypot(double(x) - centre, double(y) - centre, double(z) - centre);
    });
}

TEST(CellCases, CutEachEdgeBetweenInsideAndOutsideOnce) {
    for (int set = 0; set < 256; ++set) {
        const CellCase& cell = cell_cases()[set];
        int cut = 0;
        for (int edge = 0; edge < 12; ++edge) {
            const auto ends = ends_of(edge);
            const bool is_cut = ((set >> ends[0] ^ set >> ends[1]) & 1) != 0;
            cut += is_cut;
            EXPECT_EQ(cell.loop_of[edge] != CellCase::kNone, is_cut) << set << " " << edge;
        }
        EXPECT_EQ(cell.triangles, cut - 2 * cell.loops) << set;
    }
}

TEST(CellCases, JoinedLoopsPassNoFaceTwice) {
    int joined = 0;
    for (int set = 0; set < 256; ++set) {
        const CellCase &apart = cell_cases()[set], &other = joined_cell_cases()[set];
        if (apart.passed_twice == CellCase::kNone) {
            EXPECT_EQ(apart.loop_of, other.loop_of);
            continue;
        }
        ++joined;
        EXPECT_EQ(other.loops, apart.loops + 1) << set;
    }
    EXPECT_EQ(joined, 36);
}

TEST(Level, TellsInsideAsValuesDo) {
    for (const ValueMap map : {ValueMap{1, 0}, ValueMap{0.1, -1024}, ValueMap{-0.37, 55.5}})
        for (const double isovalue : {-1024.0, -3.3, 0.0, 0.1, 17.0, 55.5})
            for (const Type type : {Type::u8, Type::i8, Type::u16, Type::i16}) {
                const Level level = level_of(isovalue, type, map);
                const auto limits = limits_of(type);
                for (double stored = limits[0]; stored <= limits[1]; ++stored) {
                    const bool inside = !level.none && (level.falls ? stored <= level.bound
                                                                    : stored >= level.bound);
                    ASSERT_EQ(inside, map(stored) >= isovalue) << stored;
                }
            }
    const Level level = level_of(0.1, Type::f32, {});
    EXPECT_GE(level.bound, 0.1);
    EXPECT_LT(std::nextafter(static_cast<float>(level.bound), 0.0f), 0.1);
    EXPECT_TRUE(level_of(300, Type::u8, {}).none);
    EXPECT_FALSE(level_of(-1, Type::u8, {}).none);
}

TEST(FlyingEdges, IsAClosedManifoldWhereSamplesHaveTheIsovalue) {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        const auto side = [&] { return static_cast<std::int64_t>(3 + random() % 7); };
        const Extent n{side(), side(), side()};
        const Data volumes[] = {random_integers<std::uint8_t>(random, Type::u8, n),
                                random_integers<std::int16_t>(random, Type::i16, n),
                                random_integers<float>(random, Type::f32, n)};
        for (const Data& data : volumes)
            for (const double isovalue : {1.0, 1.5, 2.0, 3.0}) {
                const Mesh mesh = surface_at(data, isovalue);
                ASSERT_EQ(no_manifold(mesh), "") << round << " at " << isovalue;
                ASSERT_TRUE(measures_of(mesh, kMemory).closed);
            }
    }
}

TEST(FlyingEdges, IsAClosedManifoldAcrossWordsOfBits) {
    std::mt19937 random(2);
    for (const std::int64_t nx : {63, 64, 65, 66, 127, 128, 129, 130, 200}) {
        const Data data = random_integers<std::uint8_t>(random, Type::u8, {nx, 5, 6});
        EXPECT_EQ(no_manifold(surface_at(data, 2)), "") << nx;
    }
}

TEST(FlyingEdges, EnclosesABall) {
    // The field along an edge is a distance, whose second derivative across it is 1/r: vertices lie
    // within h^2/(8 r) of the sphere, and so do chords of length up to sqrt(3) h, within
    // 3 h^2/(8 r). With r = 20 h that is 0.001 r; area and volume follow twice and three times.
    const double radius = 20;
    const Mesh mesh = surface_at(ball(48, radius), 0);
    const Measures measures = measures_of(mesh, kMemory);
    EXPECT_TRUE(measures.closed);
    EXPECT_EQ(euler_number(mesh), 2);
    const double pi = std::numbers::pi;
    EXPECT_NEAR(measures.area, 4 * pi * radius * radius, 0.003 * 4 * pi * radius * radius);
    EXPECT_NEAR(measures.volume.value(), 4 * pi / 3 * std::pow(radius, 3),
                0.004 * 4 * pi / 3 * std::pow(radius, 3));
    const Eigen::Vector3d centre = Eigen::Vector3d::Constant(23.5);
    for (std::size_t v = 0; v < mesh.positions().size(); ++v) {
        const auto& p = mesh.positions()[v];
        const auto& n = mesh.normals()[v];
        const Eigen::Vector3d out = Eigen::Vector3d(p[0], p[1], p[2]) - centre;
        ASSERT_NEAR(out.norm(), radius, 1 / (8 * radius) + 1e-5);
        // Central differences of a distance are right to h^2/r^2 or so.
        ASSERT_GT(out.normalized().dot(Eigen::Vector3d(n[0], n[1], n[2])), 0.999);
    }
}

TEST(FlyingEdges, HasTheEulerNumberOfATorusAndOfTwoBalls) {
    const Data torus = volume_of<float>({50, 50, 24}, Type::f32, [](auto x, auto y, auto z) {
        const double ring = std::hypot(double(x) - 24.3, double(y) - 24.6) - 15;
        return 6 - std::hypot(ring, double(z) - 11.4);
    });
    const Mesh ring = surface_at(torus, 0);
    EXPECT_EQ(no_manifold(ring), "");
    EXPECT_EQ(euler_number(ring), 0);
    const Data two = volume_of<float>({50, 24, 24}, Type::f32, [](auto x, auto y, auto z) {
        const auto to = [&](double cx) {
            return std::hypot(double(x) - cx, double(y) - 11.4, double(z) - 11.7);
        };
        return 8 - std::min(to(11.1), to(37.3));
    });
    EXPECT_EQ(euler_number(surface_at(two, 0)), 4);
}

TEST(FlyingEdges, MakesAPlaneWhereItLies) {
    // x = 3.25, whatever the type; inside is x >= 3.25.
    for (const double isovalue : {3.25, 3.0}) {
        const Data data =
            volume_of<std::uint16_t>({8, 6, 5}, Type::u16, [](auto x, auto, auto) { return x; });
        const Mesh mesh = surface_at(data, isovalue);
        EXPECT_EQ(mesh.positions().size(), 30u);
        EXPECT_EQ(mesh.triangles().size(), 2u * 5 * 4);
        for (const Float3& p : mesh.positions()) EXPECT_EQ(p[0], static_cast<float>(isovalue));
        for (const Float3& n : mesh.normals()) EXPECT_EQ(n, (Float3{-1, 0, 0}));
        const Measures measures = measures_of(mesh, kMemory);
        EXPECT_FALSE(measures.closed);  // it ends at the volume's faces
        EXPECT_FALSE(measures.volume);
        EXPECT_NEAR(measures.area, 20, 1e-12);
    }
}

TEST(FlyingEdges, LiesWhereTheFileSaysAndTurnsOutwards) {
    Mat4 place = Mat4::Identity();
    place.topLeftCorner<3, 3>() << 0, -2, 0, 0.5, 0, 0, 0, 0, -3;  // determinant -3
    place.col(3).head<3>() = Vec3(100, -50, 7);
    const Data data = ball(24, 9);
    const Measures here = measures_of(surface_at(data, 0), kMemory);
    const Mesh mesh = surface_at(data, 0, place);
    const Measures there = measures_of(mesh, kMemory);
    // f32 keeps positions of 100 to 4e-6.
    EXPECT_NEAR(there.volume.value(), 3 * here.volume.value(), 1e-5 * there.volume.value());
    const Eigen::Vector3d centre =
        place.topLeftCorner<3, 3>() * Vec3(11.5, 11.5, 11.5) + Vec3(100, -50, 7);
    for (std::size_t v = 0; v < mesh.positions().size(); ++v) {
        const auto& p = mesh.positions()[v];
        const auto& n = mesh.normals()[v];
        const Vec3 out = Vec3(p[0], p[1], p[2]) - centre;
        ASSERT_GT(out.dot(Vec3(n[0], n[1], n[2])), 0);
    }
}

TEST(FlyingEdges, HasTheSameBytesForAnyNumberOfThreads) {
    std::mt19937 random(3);
    const Data data = random_integers<std::uint8_t>(random, Type::u8, {70, 31, 29});
    const Mesh expected = surface_at(data, 2);
    for (const int threads : {1, 2, 7}) {
        tbb::task_arena arena(threads);
        arena.execute([&] { EXPECT_TRUE(same_bytes(surface_at(data, 2), expected)) << threads; });
    }
}

TEST(FlyingEdges, IsTheSameForAllTypes) {
    const auto value = [](auto x, auto y, auto z) { return (x * 7 + y * 5 + z * z) % 100; };
    const Extent n{40, 9, 8};
    const Mesh expected = surface_at(volume_of<std::uint8_t>(n, Type::u8, value), 40.5);
    EXPECT_GT(expected.triangles().size(), 0u);
    EXPECT_TRUE(same_bytes(surface_at(volume_of<std::int8_t>(n, Type::i8, value), 40.5), expected));
    EXPECT_TRUE(
        same_bytes(surface_at(volume_of<std::uint16_t>(n, Type::u16, value), 40.5), expected));
    EXPECT_TRUE(
        same_bytes(surface_at(volume_of<std::int16_t>(n, Type::i16, value), 40.5), expected));
    EXPECT_TRUE(same_bytes(surface_at(volume_of<float>(n, Type::f32, value), 40.5), expected));
}

TEST(FlyingEdges, ValuesMayFallAsStoredNumbersGrow) {
    Data data = volume_of<std::uint8_t>({20, 20, 20}, Type::u8, [](auto x, auto y, auto z) {
        return 20 * std::hypot(double(x) - 9.5, double(y) - 9.5, double(z) - 9.5) / 2;
    });
    data.what.values = {-1, 100};  // 30 where 70 is stored
    const Mesh mesh = surface_at(data, 30);
    EXPECT_EQ(no_manifold(mesh), "");
    EXPECT_GT(measures_of(mesh, kMemory).volume.value(), 0);
    const auto& p = mesh.positions()[0];
    const auto& n = mesh.normals()[0];
    EXPECT_GT(Vec3(p[0] - 9.5, p[1] - 9.5, p[2] - 9.5).dot(Vec3(n[0], n[1], n[2])), 0);
}

TEST(FlyingEdges, LeavesOutCellsWithACornerThatIsNotFinite) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
          -std::numeric_limits<float>::infinity()}) {
        Data data = ball(24, 9);
        *data.at<float>(11, 11, 3) = bad;  // near the surface
        *data.at<float>(0, 0, 0) = bad;
        const Mesh mesh = surface_at(data, 0), whole = surface_at(ball(24, 9), 0);
        EXPECT_FALSE(measures_of(mesh, kMemory).closed);
        EXPECT_LT(mesh.triangles().size(), whole.triangles().size());
        EXPECT_GT(mesh.triangles().size(), whole.triangles().size() - 60);
        std::set<std::uint32_t> used;
        for (const Triangle& t : mesh.triangles()) used.insert(t.begin(), t.end());
        EXPECT_EQ(used.size(), mesh.positions().size());  // none is left over
        for (const Float3& p : mesh.positions())
            for (const float part : p) ASSERT_TRUE(std::isfinite(part));
        for (const Float3& n : mesh.normals()) ASSERT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-5);
        for (const Triangle& t : mesh.triangles()) {
            // No triangle within a cell of the bad sample.
            Vec3 middle = Vec3::Zero();
            for (const std::uint32_t v : t)
                middle +=
                    Vec3(mesh.positions()[v][0], mesh.positions()[v][1], mesh.positions()[v][2]) /
                    3;
            ASSERT_GT((middle - Vec3(11, 11, 3)).cwiseAbs().maxCoeff(), 1);
        }
    }
}

TEST(FlyingEdges, IsEmptyWhereThereAreNoCellsOrNoSurface) {
    for (const Extent n : {Extent{1, 1, 1}, Extent{5, 5, 1}, Extent{5, 1, 5}, Extent{1, 5, 5}}) {
        const Data data =
            volume_of<float>(n, Type::f32, [](auto x, auto y, auto z) { return x + y + z; });
        EXPECT_TRUE(surface_at(data, 2).positions().empty());
    }
    const Data data =
        volume_of<std::uint8_t>({5, 5, 5}, Type::u8, [](auto, auto, auto) { return 7; });
    for (const double isovalue : {-1.0, 7.0, 7.5, 1e300}) {
        const Mesh mesh = surface_at(data, isovalue);
        EXPECT_TRUE(mesh.triangles().empty());
        EXPECT_TRUE(measures_of(mesh, kMemory).closed);
        EXPECT_EQ(measures_of(mesh, kMemory).volume, 0.0);
    }
}

TEST(FlyingEdges, SaysHowManyVerticesToExpect) {
    const Data data = ball(48, 20);
    const auto made = static_cast<double>(surface_at(data, 0).positions().size());
    // A quarter of the slices, of a smooth surface.
    EXPECT_NEAR(expected_vertices(data, 0, kMemory), made, 0.1 * made);
}

TEST(FlyingEdges, StopsWhereItIsTold) {
    const Data data = ball(24, 9);
    EXPECT_THROW(
        flying_edges(data, 0, Mat4::Identity(), kMemory, [] { throw std::runtime_error("stop"); }),
        std::runtime_error);
}

TEST(FlyingEdges, RefusesOtherTypesAndChannels) {
    const Data wide = volume_of<double>({3, 3, 3}, Type::f64, [](auto, auto, auto) { return 0; });
    EXPECT_THROW(surface_at(wide, 0), RequestError);
}

}  // namespace
}  // namespace edgewise::surface
