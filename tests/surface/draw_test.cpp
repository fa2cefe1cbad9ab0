// Drawn triangles against rays that meet each of them, one by one.
#include "surface/draw.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <tbb/task_arena.h>

namespace edgewise::surface {
namespace {

constexpr std::int64_t kSide = 70;  // of a picture: more than two tiles

Mesh soup(int triangles, unsigned seed, double size, float most = 40) {
    std::mt19937 bits(seed);
    std::uniform_real_distribution<float> place(40 - most, most), away(-1, 1);
    Mesh mesh(3 * triangles, triangles, false, std::pmr::get_default_resource());
    for (int i = 0; i < triangles; ++i) {
        const Float3 middle{place(bits), place(bits), place(bits)};
        for (int c = 0; c < 3; ++c) {
            const auto at = static_cast<std::size_t>(3 * i + c);
            Float3& p = mesh.positions()[at];
            for (std::size_t axis = 0; axis < 3; ++axis)
                p[axis] = middle[axis] + static_cast<float>(size) * away(bits);
            Eigen::Vector3f normal(away(bits), away(bits), away(bits));
            normal.normalize();
            mesh.normals()[at] = {normal.x(), normal.y(), normal.z()};
            mesh.triangles()[static_cast<std::size_t>(i)][static_cast<std::size_t>(c)] =
                static_cast<std::uint32_t>(at);
        }
    }
    return mesh;
}

Request request_of(bool eye) {
    Request want;
    want.mode = mode_named("surface");
    want.input = {41, 41, 41};
    want.screen = {kSide, kSide, 60};
    want.shading.by = Shade::phong;
    want.shading.lights = {{Vec3(0, 0, -1), 0.6}, {Vec3(0.6, 0.48, -0.64), 0.5}};
    want.pixel = {0.8, 1.25};
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()).toRotationMatrix() *
        Vec3(1.3, 1.1, 0.9).asDiagonal();
    map.topRightCorner<3, 1>() = Vec3(35, 35, 30) - map.topLeftCorner<3, 3>() * Vec3(20, 20, 20);
    want.views = Placement(map);
    if (eye) want.eye = Eye{Vec3(33, 36, 12), 30, 0.8, 1.25};  // among the triangles
    return want;
}

/// Red and opacity of a pixel, and how far the nearest edge of a triangle is, as a share.
struct Seen {
    double light = 0, hit = 0, margin = 1;
};
Seen by_rays(const Mesh& mesh, const Request& want, double x, double y) {
    const Mat4& map = want.views.at(0).matrix();
    const Eigen::Matrix3d linear = map.topLeftCorner<3, 3>();
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    const Vec3 origin = want.eye ? want.eye->at : Vec3(x, y, -1000);
    const Vec3 along = want.eye ? Vec3(Vec3(x, y, want.eye->plane) - origin) : Vec3(0, 0, 1);
    const Vec3 to_eye = want.eye ? Vec3((-along).cwiseProduct(steps).normalized()) : Vec3(0, 0, -1);
    Seen seen;
    double nearest = HUGE_VAL;
    for (const Triangle& triangle : mesh.triangles()) {
        Vec3 p[3], normal = Vec3::Zero();
        for (int c = 0; c < 3; ++c) {
            const Float3& q = mesh.positions()[triangle[static_cast<std::size_t>(c)]];
            p[c] = linear * Vec3(q[0], q[1], q[2]) + map.topRightCorner<3, 1>();
        }
        Eigen::Matrix3d corners;
        corners << p[1] - p[0], p[2] - p[0], -along;
        const Vec3 solved = corners.inverse() * (origin - p[0]);
        const double u = solved[0], v = solved[1], t = solved[2];
        if (!std::isfinite(t) || (want.eye && t * along.z() < 1e-3)) continue;
        const double inside = std::min({u, v, 1 - u - v});
        if (std::abs(inside) < 1e-6) seen.margin = 0;
        if (inside < 0 || !(t < nearest)) continue;
        nearest = t;
        const double shares[3] = {1 - u - v, u, v};
        for (int c = 0; c < 3; ++c) {
            const Float3& n = mesh.normals()[triangle[static_cast<std::size_t>(c)]];
            normal += shares[c] * Vec3(n[0], n[1], n[2]);
        }
        const Lit lit = want.shading.at(
            steps.cwiseInverse().asDiagonal() * linear.inverse().transpose() * normal, to_eye);
        seen.light = lit.diffuse + lit.specular;
        seen.hit = 1;
        if (want.cue)
            seen.light *=
                want.cue->left((origin.z() + t * along.z() - nearest_corner(want, 0)) * want.unit);
    }
    return seen;
}

std::vector<float> drawn(const Mesh& mesh, const Request& want, int threads = 2) {
    std::vector<float> pixels(4 * kSide * kSide, -1);
    tbb::task_arena arena(threads);
    arena.execute([&] {
        draw({&mesh, &want, 0, false}, {{0, 0, 0}, {kSide, kSide, 1}}, pixels.data(), 4 * kSide,
             std::pmr::get_default_resource(), [] {});
    });
    return pixels;
}

void expect_as_rays(const Mesh& mesh, const Request& want) {
    const std::vector<float> pixels = drawn(mesh, want);
    int hits = 0, compared = 0;
    for (std::int64_t y = 0; y < kSide; ++y)
        for (std::int64_t x = 0; x < kSide; ++x) {
            const Seen seen = by_rays(mesh, want, static_cast<double>(x), static_cast<double>(y));
            if (seen.margin == 0) continue;
            const float* got = pixels.data() + 4 * (y * kSide + x);
            ASSERT_EQ(got[3], seen.hit) << x << ' ' << y;
            // Shares are kept in f32; normals of length 0.1 turn ten times as fast.
            ASSERT_NEAR(got[0], seen.light, 2e-4) << x << ' ' << y;
            EXPECT_EQ(got[0], got[2]);
            hits += seen.hit > 0;
            ++compared;
        }
    EXPECT_GT(hits, kSide * kSide / 10);
    EXPECT_GT(compared, kSide * kSide * 9 / 10);
}

TEST(Draw, ShowsTheNearestTriangleOfEachPixel) {
    for (const double size : {2.0, 15.0}) expect_as_rays(soup(400, 1, size), request_of(false));
}

TEST(Draw, FromAnEyeAmongTheTriangles) {
    for (const double size : {3.0, 15.0}) expect_as_rays(soup(300, 2, size), request_of(true));
}

TEST(Draw, LetsLightFallOff) {
    Request want = request_of(false);
    want.cue = DepthCue{0.02, false};
    want.unit = 1.5;
    expect_as_rays(soup(300, 3, 8), want);
    want = request_of(true);
    want.cue = DepthCue{0.01, true};
    expect_as_rays(soup(300, 3, 8), want);
}

TEST(Draw, LooksThroughWhatIsClipped) {
    const Mesh mesh = soup(300, 4, 10, 28);  // all of it in the volume
    Request want = request_of(false);
    const std::vector<float> whole = drawn(mesh, want);
    // Half of the volume: only what lies there is left, and more of it is seen.
    const std::vector<HalfSpace> upper = {{Vec3(0, 0, 1), -20}}, lower = {{Vec3(0, 0, -1), 20}};
    want.clips = {clip_of(want.input, upper)};
    const std::vector<float> half = drawn(mesh, want);
    want.clips = {clip_of(want.input, lower)};
    const std::vector<float> other = drawn(mesh, want);
    int changed = 0;
    for (std::size_t i = 0; i < whole.size(); i += 4) {
        EXPECT_EQ(whole[i + 3], std::max(half[i + 3], other[i + 3]));
        EXPECT_TRUE(whole[i] == half[i] || whole[i] == other[i]) << i;
        changed += half[i] != whole[i];
    }
    EXPECT_GT(changed, 100);
}

TEST(Draw, ABallLooksThroughWhatIsOutsideOfIt) {
    const Mesh mesh = soup(300, 4, 10, 28);
    Request want = request_of(false);
    const std::vector<float> whole = drawn(mesh, want);
    const auto shown = [&](double radius) {
        const std::vector<Ball> one = {{Vec3(19, 19, 19), Eigen::Matrix3d::Identity() / radius}};
        want.clips = {clip_of(want.input, {}, one)};
        const std::vector<float> pixels = drawn(mesh, want);
        int count = 0;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            EXPECT_LE(pixels[i + 3], whole[i + 3]);
            count += pixels[i + 3] > 0;
        }
        return count;
    };
    int all = 0;
    for (std::size_t i = 0; i < whole.size(); i += 4) all += whole[i + 3] > 0;
    const int few = shown(6), more = shown(12);
    EXPECT_GT(few, 0);
    EXPECT_LT(few, more);
    EXPECT_LT(more, all);
    EXPECT_EQ(shown(100), all);
}

TEST(Draw, BytesDoNotDependOnThreads) {
    const Mesh mesh = soup(9000, 5, 4);
    const Request want = request_of(true);
    const std::vector<float> one = drawn(mesh, want, 1);
    for (const int threads : {2, 7}) {
        const std::vector<float> more = drawn(mesh, want, threads);
        EXPECT_EQ(0, std::memcmp(one.data(), more.data(), one.size() * sizeof(float)));
    }
}

/// A closed surface has no pixel where the background shows through.
TEST(Draw, NeighboursLeaveNoGap) {
    // A bent sheet of small triangles over more than the picture.
    constexpr int kCells = 120;
    Mesh mesh((kCells + 1) * (kCells + 1), 2 * kCells * kCells, false,
              std::pmr::get_default_resource());
    for (int j = 0; j <= kCells; ++j)
        for (int i = 0; i <= kCells; ++i) {
            const auto at = static_cast<std::size_t>(j * (kCells + 1) + i);
            const float x = static_cast<float>(i) * 0.9F - 10,
                        y = static_cast<float>(j) * 0.9F - 10;
            mesh.positions()[at] = {x, y, 3 * std::sin(0.3F * x) * std::cos(0.2F * y)};
            mesh.normals()[at] = {0, 0, -1};
        }
    for (int j = 0; j < kCells; ++j)
        for (int i = 0; i < kCells; ++i) {
            const auto a = static_cast<std::uint32_t>(j * (kCells + 1) + i), b = a + 1,
                       c = a + kCells + 1, d = c + 1;
            const auto t = static_cast<std::size_t>(2 * (j * kCells + i));
            mesh.triangles()[t] = {a, b, c};
            mesh.triangles()[t + 1] = {b, d, c};
        }
    Request want = request_of(false);
    want.views = Placement(Mat4(Mat4::Identity()));
    const std::vector<float> pixels = drawn(mesh, want);
    for (std::size_t i = 3; i < pixels.size(); i += 4) EXPECT_EQ(pixels[i], 1) << i;
}

}  // namespace
}  // namespace edgewise::surface
