#include "transitions/kernels/ray_path.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <tuple>

#include "tests/transitions/kernels/ray_cast_reference.hpp"

namespace edgewise::kernels {
namespace {

constexpr int kSide = 60;

/// Pixels of a picture that a shadow says may meet the box, row by row or some rows together.
struct Told {
    int hits = 0;    // rays that meet the box
    int hidden = 0;  // of these, outside of the shadow
    int more = 0;    // pixels within the shadow whose rays miss

    Told(const RayCast& cast, int rows) {
        const ParallelRays shared(cast);
        const Shadow shadow(cast, shared, 0, 0, kSide, kSide);
        for (int y = 0; y < kSide; ++y) {
            const double top = y / rows * rows;
            const Shadow::Columns seen = shadow.columns(top, top + rows - 1);
            for (int x = 0; x < kSide; ++x) {
                const bool hit = ray_path(cast, x, y).hit(),
                           told = seen.first <= x && x <= seen.last;
                hits += hit;
                hidden += hit && !told;
                more += told && !hit;
            }
        }
    }
};

RayCast cast_of(const Extent& n, const Rays& rays) {
    RayCast cast;
    cast.rays = rays;
    cast.volume.extent = n;
    return cast;
}

TEST(Shadow, HasAllRaysThatMeetTheBoxAndFewOthers) {
    for (const Extent& n : {Extent{21, 17, 26}, {1, 30, 9}, {40, 1, 1}})
        for (const double tilt : {0.0, 1e-9, 0.4, 1.5707963267948966, -2.5})
            for (const double turn : {0.0, -1e-12, 0.7, 3.1, 4.71238898038469}) {
                const RayCast cast = cast_of(n, turned(n, tilt, turn, kSide));
                const Told exactly(cast, 1);
                EXPECT_EQ(exactly.hidden, 0) << n.x << ' ' << tilt << ' ' << turn;
                // Rays in a face are on either side of it.
                EXPECT_LE(exactly.more, 40) << n.x << ' ' << tilt << ' ' << turn;
                const Told together(cast, 4);
                EXPECT_EQ(together.hidden, 0) << n.x << ' ' << tilt << ' ' << turn;
                EXPECT_EQ(together.hits, exactly.hits);
            }
}

TEST(Shadow, RaysInAFaceAreInside) {
    const Extent n{5, 6, 7};
    for (int axis = 0; axis < 3; ++axis)
        for (const double zero : {0.0, -0.0, 1e-300}) {
            Rays rays;
            rays.direction.base = {zero, zero, zero};
            rays.direction.base[axis] = -1;
            rays.origin.base = {-0.5, -0.5, -0.5};
            rays.origin.x[(axis + 1) % 3] = 0.5;
            rays.origin.y[(axis + 2) % 3] = 0.25;
            const Told told(cast_of(n, rays), 1);
            EXPECT_EQ(told.hidden, 0);
            EXPECT_EQ(told.more, 0);
            EXPECT_EQ(told.hits, (2 * n[(axis + 1) % 3] + 1) * (4 * n[(axis + 2) % 3] + 1));
        }
}

TEST(Shadow, OfAPartIsSmaller) {
    const Extent n{21, 17, 26};
    Kept kept{{4, -0.5, 3.5}, {18.5, 12, 20}, {}};
    for (const int more : {0, 1, 2}) {
        if (more == 1) kept.planes = {{{0.6, 0, 0.8}, -15}, {{-0.36, 0.8, 0.48}, 2}};
        if (more == 2) kept.balls = {{{12, 7, 14}, {0.15, 0, 0, 0, 0.15, 0, 0, 0, 0.15}}};
        for (const double tilt : {0.0, 1e-9, 0.4, 1.5707963267948966, -2.5})
            for (const double turn : {0.0, -1e-12, 0.7, 3.1, 4.71238898038469}) {
                RayCast cast = cast_of(n, turned(n, tilt, turn, kSide));
                const Told all(cast, 1);
                cast.kept = &kept;
                const Told part(cast, 1), together(cast, 4);
                EXPECT_EQ(part.hidden, 0) << tilt << ' ' << turn;
                EXPECT_EQ(together.hidden, 0) << tilt << ' ' << turn;
                // A ball is told by the box around it alone.
                if (more < 2) {
                    EXPECT_LE(part.more, 40) << tilt << ' ' << turn;
                }
                EXPECT_LT(part.hits, 0.9 * all.hits);
                EXPECT_GT(part.hits, 0);
            }
    }
}

TEST(RayPath, RaysInAPlaneAreInside) {
    const Extent n{9, 9, 9};
    Rays rays = turned(n, 0.3, 0.5, 9);
    // A plane that holds the rays of a column of pixels.
    const auto [origin, right, down] = std::tuple(rays.origin.base, rays.origin.x, rays.origin.y);
    Kept kept{{-0.5, -0.5, -0.5}, {8.5, 8.5, 8.5}, {{right, 0}}};
    RayCast cast = cast_of(n, rays);
    for (std::size_t axis = 0; axis < 3; ++axis)
        kept.planes[0].offset -= right[axis] * (origin[axis] + 4 * right[axis]);
    cast.kept = &kept;
    EXPECT_FALSE(ray_path(cast, 3, 4).hit());
    EXPECT_TRUE(ray_path(cast, 4, 4).hit());
    const RayPath part = ray_path(cast, 4, 4);
    cast.kept = nullptr;
    EXPECT_EQ(ray_path(cast, 4, 4).length, part.length);
}

TEST(RayPath, ABallLeavesItsChord) {
    const Extent n{21, 17, 26};
    const Rays rays = turned(n, 0.3, 0.5, kSide);
    Kept kept{{-0.5, -0.5, -0.5}, {20.5, 16.5, 25.5}, {}};
    const double radius = 7.5;
    kept.balls = {{{10, 8, 12.5}, {1 / radius, 0, 0, 0, 1 / radius, 0, 0, 0, 1 / radius}}};
    RayCast cast = cast_of(n, rays);
    cast.kept = &kept;
    // Pixels are samples wide, and the middle of the picture is that of the ball.
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double square = std::pow(x - 29.5, 2) + std::pow(y - 29.5, 2);
            const double chord = 2 * std::sqrt(std::max(0.0, radius * radius - square));
            EXPECT_NEAR(ray_path(cast, x, y).length, chord, 1e-9) << x << ' ' << y;
        }
}

TEST(RayPath, ATangentAndAnEyeInTheBall) {
    const Extent n{21, 21, 21};
    Rays rays;
    rays.origin = {.base = {0, 10, -30}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    Kept kept{{-0.5, -0.5, -0.5}, {20.5, 20.5, 20.5}, {}};
    kept.balls = {{{10, 10, 10}, {0.25, 0, 0, 0, 0.25, 0, 0, 0, 0.25}}};
    RayCast cast = cast_of(n, rays);
    cast.kept = &kept;
    EXPECT_FALSE(ray_path(cast, 6, 0).hit());  // touches it
    EXPECT_TRUE(ray_path(cast, 6.001, 0).hit());
    EXPECT_NEAR(ray_path(cast, 6.001, 0).length, 2 * std::sqrt(16 - 3.999 * 3.999), 1e-9);
    EXPECT_NEAR(ray_path(cast, 10, 0).length, 8, 1e-12);
    // From within, forwards alone; and from behind it nothing.
    cast.rays.start = 0;
    cast.rays.origin.base = {10, 10, 11};
    EXPECT_NEAR(ray_path(cast, 0, 0).length, 3, 1e-12);
    cast.rays.origin.base = {10, 10, 14.5};
    EXPECT_FALSE(ray_path(cast, 0, 0).hit());
    // Two that have nothing in common, and one beside the volume.
    cast.rays.origin.base = {10, 10, -30};
    kept.balls.push_back({{10, 10, 19}, {0.25, 0, 0, 0, 0.25, 0, 0, 0, 0.25}});
    EXPECT_FALSE(ray_path(cast, 0, 0).hit());
    kept.balls = {{{10, 10, 40}, {0.25, 0, 0, 0, 0.25, 0, 0, 0, 0.25}}};
    EXPECT_FALSE(ray_path(cast, 0, 0).hit());
}

TEST(Shadow, OfRaysFromAnEyeIsEverywhere) {
    const Extent n{21, 17, 26};
    const RayCast cast = cast_of(n, from_eye(n, kSide, 45));
    const Told told(cast, 1);
    EXPECT_GT(told.hits, 0);
    EXPECT_EQ(told.hits + told.more, kSide * kSide);
}

/// Of a ray along z from the front face on: whether rounding leaves a piece of the cell before.
TEST(RayPath, PiecesThatOnlyRoundingMakesAreNoCells) {
    for (const double off : {-1e-13, 0.0, 1e-13}) {
        Rays rays;
        rays.direction.base = {0, 0, 1};
        rays.origin.base = {0, 0, -0.5 - off};
        const RayPath path = ray_path(cast_of({2, 2, 2}, rays), 0, 0);
        EXPECT_EQ(path.first, 0) << off;
        EXPECT_EQ(path.last, 1) << off;
        EXPECT_NEAR(path.first_weight + path.last_weight, 2, 1e-12);
    }
    Rays corner;  // a ray that is shorter than that still meets the box
    corner.direction.base = {1, 0, 1};
    corner.origin.base = {1.5 - 1e-12, 0, -0.5};
    const RayPath path = ray_path(cast_of({2, 2, 2}, corner), 0, 0);
    EXPECT_TRUE(path.hit());
    EXPECT_EQ(path.first, path.last);
}

}  // namespace
}  // namespace edgewise::kernels
