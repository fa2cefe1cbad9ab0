#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <numbers>
#include <set>
#include <string_view>

#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp.hpp"
#include "transitions/warp/axis_permutation.hpp"
#include "transitions/warp/backward.hpp"

namespace edgewise {
namespace {

// What edges count without running is compared with what their samples say one by one.

/// A request that turns a volume about its centre, on a screen that shows all of it.
struct Turned {
    Request want;
    Scene scene;
    Representation from;

    Turned(Job job, Extent extent, std::array<double, 3> degrees, double zoom, Extent screen) {
        from.extent = extent;
        from.type = Type::u8;
        want.job = job;
        want.input = extent;
        want.screen = screen;
        Mat4 view = Mat4::Identity();
        for (int axis = 0; axis < 3; ++axis) {
            Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            const double angle = degrees[static_cast<std::size_t>(axis)] * std::numbers::pi / 180;
            turn(b, b) = turn(c, c) = std::cos(angle);
            turn(c, b) = std::sin(angle);
            turn(b, c) = -turn(c, b);
            view.topLeftCorner<3, 3>() = (turn * view.topLeftCorner<3, 3>()).eval();
        }
        view.topLeftCorner<3, 3>() *= zoom;
        for (int row = 0; row < 3; ++row) {
            view(row, 3) = double(screen[row] - 1) / 2;
            for (int k = 0; k < 3; ++k) view(row, 3) -= view(row, k) * double(extent[k] - 1) / 2;
        }
        want.views = Placement(view);
    }
};

TEST(CountedWork, AShadowHasThePixelsWhoseRaysHit) {
    for (const auto& degrees : {std::array<double, 3>{0, 0, 0}, {20, 30, 0}, {0, 80, 5}}) {
        const Turned of(Job::render, {60, 40, 50}, degrees, 1.5, {160, 160, 160});
        kernels::RayCast cast;
        cast.volume.extent = of.from.extent;
        cast.rays = rays_of(of.from, of.want, 0);
        int hits = 0;
        for (int y = 0; y < 160; ++y)
            for (int x = 0; x < 160; ++x) hits += kernels::ray_path(cast, x, y).length > 0;
        EXPECT_NEAR(rays_met(of.from, of.want, 0, 4).rays, hits, 0.02 * hits) << degrees[1];
    }
}

TEST(CountedWork, AScreenSmallerThanTheShadowIsAllHit) {
    const Turned of(Job::render, {60, 40, 50}, {20, 30, 0}, 1.5, {30, 20, 160});
    const RaysMet all = rays_met(of.from, of.want, 0, 4);
    EXPECT_EQ(all.rays, 600);
    EXPECT_EQ(all.packets, 600);
}

/// Output samples in blocks of columns of which one at least sees the input.
double blocked_samples(const Turned& of) {
    const Mat4 map = of.want.views.at(0).inverse().matrix();
    const Extent& screen = of.want.screen;
    double blocked = 0;
    for (std::int64_t z = 0; z < screen.z; ++z)
        for (std::int64_t y = 0; y < screen.y; ++y)
            for (std::int64_t x = 0; x < screen.x; x += kernels::kBackwardBlock) {
                const std::int64_t end = std::min(x + kernels::kBackwardBlock, screen.x);
                bool seen = false;
                for (std::int64_t i = x; i < end; ++i) {
                    const Eigen::Vector4d p =
                        map * Eigen::Vector4d(double(i), double(y), double(z), 1);
                    bool inside = true;
                    for (int axis = 0; axis < 3; ++axis)
                        inside = inside && p[axis] >= -0.5 &&
                                 p[axis] <= double(of.from.extent[axis]) - 0.5;
                    seen = seen || inside;
                }
                if (seen) blocked += double(end - x);
            }
    return blocked;
}

TEST(CountedWork, ABackwardWarpCountsTheBlocksThatItWorksOut) {
    const Transition edge = backward_warp();
    const Parameters with{{"filter", "foh"}};
    for (const auto& degrees : {std::array<double, 3>{0, 0, 0}, {20, 30, 0}, {10, 70, -25}}) {
        const Turned of(Job::warp, {40, 48, 44}, degrees, 1, {90, 84, 88});
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, with);
        ASSERT_EQ(offer.refused, "");
        const double counted = edge.work(offer, ask, 0).gathers / 8, truth = blocked_samples(of);
        // Rows of a lattice stand for all.
        EXPECT_NEAR(counted, truth, 0.06 * truth) << degrees[1];
    }
}

/// Lines of the input that nearest samples of a turned grid touch, were there as many in it as in
/// the blocks that are worked out.
double touched_lines(const Turned& of) {
    const Mat4 map = of.want.views.at(0).inverse().matrix();
    const Extent &screen = of.want.screen, &n = of.from.extent;
    std::set<std::int64_t> lines;
    double seen = 0;
    for (std::int64_t z = 0; z < screen.z; ++z)
        for (std::int64_t y = 0; y < screen.y; ++y)
            for (std::int64_t x = 0; x < screen.x; ++x) {
                const Eigen::Vector4d p = map * Eigen::Vector4d(double(x), double(y), double(z), 1);
                std::int64_t at[3];
                bool inside = true;
                for (int axis = 0; axis < 3; ++axis) {
                    at[axis] = std::lround(p[axis]);
                    inside = inside && at[axis] >= 0 && at[axis] < n[axis];
                }
                if (!inside) continue;
                ++seen;
                lines.insert(((at[2] * n.y + at[1]) * n.x + at[0]) / 64);
            }
    return static_cast<double>(lines.size()) * blocked_samples(of) / seen;
}

TEST(CountedWork, ABackwardWarpCountsTheLinesThatItsSamplesTouch) {
    const Transition edge = backward_warp();
    const Parameters with{{"filter", "zoh"}};
    for (const double zoom : {1.0, 2.0})  // finer grids touch no more
        for (const auto& degrees : {std::array<double, 3>{0, 0, 0}, {20, 30, 0}, {10, 70, -25}}) {
            const std::int64_t side = zoom > 1 ? 290 : 150;
            const Turned of(Job::warp, {128, 48, 44}, degrees, zoom, {side, side, side});
            const Ask ask{of.want, of.scene};
            const Offer offer = edge.offer(of.from, ask, with);
            ASSERT_EQ(offer.refused, "");
            const Work work = edge.work(offer, ask, 0);
            const double truth = touched_lines(of);
            EXPECT_NEAR(work.lines.count, truth, 0.08 * truth) << zoom << ' ' << degrees[1];
        }
}

TEST(CountedWork, AShearWarpReadsEveryLineOfTheVolume) {
    const Transition edge = shear_warp();
    const Parameters with{{"filter", "foh"}};
    Turned of(Job::render, {128, 48, 44}, {10, 20, 0}, 1, {150, 150, 150});
    for (const Type type : {Type::u8, Type::f32}) {
        of.from.type = type;
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, with);
        ASSERT_EQ(offer.refused, "");
        const Work work = edge.work(offer, ask, 0);
        EXPECT_EQ(work.lines.count, double(bytes_of(type)) * 128 * 48 * 44 / 64);
        EXPECT_EQ(work.lines.span, 64 * work.lines.count);
    }
}

TEST(CountedWork, CastsOfSparseSamplesOfLargeVolumesAreTimedByThemselves) {
    const Transition edge = ray_cast();
    for (const std::int64_t slices : {48, 400}) {  // 1.5 and 12.5 MiB
        Turned of(Job::render, {256, 128, slices}, {10, 20, 0}, 0.3, {128, 128, 128});
        of.want.mode = Mode::xray;  // without bricks
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", 1.0}});
        ASSERT_EQ(offer.refused, "");
        EXPECT_EQ(edge.work(offer, ask, 0).variant, slices > 48 ? "sparse" : "");
    }
}

TEST(CountedWork, CastsAlongRowsTouchFewerLinesThanCastsAcross) {
    const Transition edge = ray_cast();
    const auto lines_a_sample = [&](std::array<double, 3> degrees, bool eye) {
        Turned of(Job::render, {128, 128, 128}, degrees, 0.4, {60, 60, 60});
        of.want.mode = Mode::xray;
        // So far that rays are as good as parallel, and as dense at the volume's middle.
        if (eye) of.want.eye = Eye{{29.5, 29.5, -1e5}, 29.5};
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", 2.0}});
        EXPECT_EQ(offer.refused, "");
        return edge.work(offer, ask, 0).lines.count /
               (60 * 60 * mean_length(of.from, of.want, 0) / 2);
    };
    EXPECT_LT(lines_a_sample({0, 88, 1}, false), 0.5 * lines_a_sample({20, 40, 10}, false));
    // Rays from the eye are as much farther apart at the volume's ends as these are from its
    // middle, over the distance of the eye: 64 of 1e5.
    EXPECT_NEAR(lines_a_sample({0, 88, 1}, true) / lines_a_sample({0, 88, 1}, false), 1, 1e-3);
}

TEST(CountedWork, PacketsComeBackToFewerLinesAlongRows) {
    const Transition edge = ray_cast();
    const auto work = [&](std::array<double, 3> degrees) {
        Turned of(Job::render, {128, 128, 128}, degrees, 0.4, {90, 90, 90});
        of.want.mode = Mode::xray;
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", 1.0}});
        EXPECT_EQ(offer.refused, "");
        return edge.work(offer, ask, 0);
    };
    const Work across = work({20, 10, 0}), along = work({0, 85, 0});
    EXPECT_LT(along.other_lines.count / along.gathers,
              0.5 * across.other_lines.count / across.gathers);
    // A tile sees no more than all.
    EXPECT_LT(across.other_lines.span, 64 * across.lines.count);
    EXPECT_GT(across.other_lines.span, 0);
}

/// What packets of 4 x 4 rays walk, worked out ray by ray.
struct Walked {
    double rays = 0;     // that hit
    double packets = 0;  // rays of packets of which one hits
    double cells = 0;    // from the first that some ray of a packet has to the last, times its rays
    double ends = 0;     // of these, cells that not all rays that hit have whole

    Walked(const Turned& of, std::int64_t side) {
        kernels::RayCast cast;
        cast.volume.extent = of.from.extent;
        cast.rays = rays_of(of.from, of.want, 0);
        // Means over where packets begin.
        for (std::int64_t shift = 0; shift < 16; ++shift)
            for (std::int64_t y = -(shift / 4); y < side; y += 4)
                for (std::int64_t x = -(shift % 4); x < side; x += 4) add_packet(cast, x, y);
        for (double* all : {&rays, &packets, &cells, &ends}) *all /= 16;
    }

 private:
    void add_packet(const kernels::RayCast& cast, std::int64_t x, std::int64_t y) {
        double first = HUGE_VAL, last = -HUGE_VAL, inner_first = -HUGE_VAL, inner_last = HUGE_VAL;
        int hits = 0;
        for (std::int64_t k = 0; k < 16; ++k) {
            const auto path = ray_path(cast, double(x + k % 4), double(y + k / 4));
            if (!path.hit()) continue;
            ++hits;
            first = std::min(first, double(path.first));
            last = std::max(last, double(path.last));
            inner_first = std::max(inner_first, double(path.first) + 1);
            inner_last = std::min(inner_last, double(path.last) - 1);
        }
        if (hits == 0) return;
        rays += hits;
        packets += 16;
        cells += 16 * (last - first + 1);
        ends += 16 * (last - first + 1 - std::max(0.0, inner_last - inner_first + 1));
    }
};

TEST(CountedWork, PacketsWalkUntilTheLastOfTheirRaysEnds) {
    constexpr std::int64_t kSide = 315;
    for (const Extent& extent :
         {Extent{64, 64, 64}, {157, 393, 34}, {128, 128, 44}, {34, 157, 157}})
        for (const auto& degrees : {std::array<double, 3>{20, 30, 0}, {0, 80, 5}, {45, 45, 45}})
            for (const double zoom : {0.7, 0.31}) {
                const Turned of(Job::render, extent, degrees, zoom, {kSide, kSide, kSide});
                const RaysMet shadow = rays_met(of.from, of.want, 0, 4);
                const Walked walked(of, kSide);
                const double length = mean_length(of.from, of.want, 0) * kSide * kSide;
                const double cells = length + shadow.beyond + shadow.packets;
                const double ends = 2 * (shadow.ragged + shadow.packets);
                // Areas and the points of a lattice in them.
                EXPECT_NEAR(shadow.rays, walked.rays, 0.025 * walked.rays);
                EXPECT_NEAR(shadow.packets, walked.packets, 0.025 * walked.packets);
                EXPECT_NEAR(cells, walked.cells, 0.02 * walked.cells);
                EXPECT_NEAR(ends, walked.ends, 0.2 * walked.ends);
            }
}

TEST(CountedWork, PacketsAcrossAFaceSeenFromItsSideWalkForRaysThatMiss) {
    constexpr std::int64_t kSide = 120;
    for (const auto& degrees : {std::array<double, 3>{0, 0, 0}, {0, 90, 0}, {3, 0, 0}})
        for (const double zoom : {0.7, 0.31}) {
            const Turned of(Job::render, {64, 64, 64}, degrees, zoom, {kSide, kSide, kSide});
            const RaysMet shadow = rays_met(of.from, of.want, 0, 4);
            const Walked walked(of, kSide);
            const double length = mean_length(of.from, of.want, 0) * kSide * kSide;
            const double cells = length + shadow.beyond + shadow.packets;
            // Edges along the pixels are a pixel off, of 20 to 45.
            EXPECT_NEAR(shadow.packets, walked.packets, 0.1 * walked.packets);
            EXPECT_NEAR(cells, walked.cells, 0.15 * walked.cells);
        }
}

TEST(CountedWork, CastsCountThePacketsThatMeetTheData) {
    const Transition edge = ray_cast();
    for (const auto& degrees : {std::array<double, 3>{0, 0, 0}, {20, 30, 0}}) {
        const auto work = [&](std::int64_t side) {
            Turned of(Job::render, {64, 64, 64}, degrees, 0.7, {side, side, side});
            of.want.mode = Mode::xray;
            const Ask ask{of.want, of.scene};
            const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", 0.5}});
            EXPECT_EQ(offer.refused, "");
            return std::pair(edge.work(offer, ask, 0), rays_met(of.from, of.want, 0, 4));
        };
        const auto [near, shadow] = work(90);
        const double samples = std::pow(64 * 0.7, 3) / 0.5;
        // Each of its rays: 20 numbers, and a cell more, as both ends are parts of cells.
        const double cells = samples + 2 * shadow.beyond + shadow.packets;
        EXPECT_NEAR(near.gathers, cells + 20 * shadow.packets, 1e-9 * cells);
        // The screen around the data takes no more than its bytes.
        const Work far = work(180).first;
        EXPECT_NEAR(far.gathers, near.gathers, 1e-9 * cells);
        EXPECT_NEAR(far.operations, near.operations, 1e-9 * near.operations);
        EXPECT_EQ(far.streamed - near.streamed, 4 * (180 * 180 - 90 * 90));
    }
}

TEST(CountedWork, FewRaysComeBackToTheirOwnLines) {
    const Transition edge = ray_cast();
    for (const std::int64_t side : {8, 400}) {
        const Turned of(Job::render, {128, 128, 128}, {20, 40, 10}, 4.0 / 128 * side / 8,
                        {side, side, side});
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", 1.0}});
        ASSERT_EQ(offer.refused, "");
        const Work work = edge.work(offer, ask, 0);
        EXPECT_EQ(work.lines.span, side == 8 ? 64 * work.lines.count : of.from.bytes());
    }
}

TEST(CountedWork, CompositesCorrectTheOpacitiesThatPacketsNeed) {
    // Half of the volume is clear, and so are the ends of all rays.
    const Extent n{32, 32, 32};
    Turned of(Job::render, n, {0, 0, 0}, 1, {32, 32, 32});
    of.want.mode = Mode::composite;
    of.want.transfer.points = {{0, 0, {0, 0, 0}}, {255, 0.01, {1, 1, 1}}};
    Data data = Data::make(of.from, std::pmr::get_default_resource());
    std::uint8_t* const voxels = data.as<std::uint8_t>();
    for (std::int64_t i = 0; i < n.samples(); ++i) {
        const std::int64_t z = i / (n.x * n.y);
        voxels[i] = z >= 8 && z < 24 ? 255 : 0;
    }
    measure_casting(data, of.want, of.scene.facts, std::pmr::get_default_resource());
    EXPECT_EQ(of.scene.fact(FactName("cast/corrected/ends")), 0);
    EXPECT_NEAR(of.scene.fact(FactName("cast/corrected")).value(), 0.5, 1e-6);
    const Ask ask{of.want, of.scene};
    const auto operations = [&](double step) {
        const Transition edge = ray_cast();
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}, {"step", step}});
        EXPECT_EQ(offer.refused, "");
        return edge.work(offer, ask, 0).operations;
    };
    // Half of the samples take a correction more at a step that is not the opacities' length.
    const double rays = 32 * 32, samples = 32 * rays;
    of.want.transfer.unit = 1;
    const double plain = operations(1);
    of.want.transfer.unit = 1.5;
    EXPECT_NEAR(operations(1) - plain, kCorrectionOperations * 0.5 * samples, 1e-3 * samples);
    // Powers of two take less.
    of.want.transfer.unit = 2;
    EXPECT_NEAR(operations(1) - plain, 20 * 0.5 * samples, 1e-3 * samples);
    of.want.transfer.unit = 0.25;
    EXPECT_NEAR(operations(1) - plain, 2 * 2 * 0.5 * samples, 1e-3 * samples);
}

TEST(CountedWork, AWarpFetchesTheLinesThatItWritesAndDrivesThemOut) {
    const Transition edge = backward_warp();
    for (const std::int64_t side : {150, 170}) {  // 13 and 19 MB
        const Turned of(Job::warp, {128, 48, 44}, {20, 30, 0}, 1, {side, side, side});
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, {{"filter", "zoh"}});
        ASSERT_EQ(offer.refused, "");
        const Work work = edge.work(offer, ask, 0);
        EXPECT_EQ(work.other_lines.span, of.from.bytes() + offer.to.bytes());
        EXPECT_EQ(work.lines.span, work.other_lines.span);
        // Those of the larger output are asked for, which leaves a third of the wait.
        const double each = side == 150 ? 2 : 1.35;
        EXPECT_DOUBLE_EQ(work.other_lines.count, each * offer.to.bytes() / 64);
    }
}

TEST(CountedWork, APermutationHasItsVariantFromWhatBecomesOfRows) {
    const Transition edge = axis_permutation_warp();
    const Parameters with{{"to", "aligned"}};
    const auto work = [&](const std::array<double, 3>& degrees) {
        const Turned of(Job::render, {40, 48, 44}, degrees, 1, {90, 84, 88});
        const Ask ask{of.want, of.scene};
        const Offer offer = edge.offer(of.from, ask, with);
        EXPECT_EQ(offer.refused, "");
        return edge.work(offer, ask, 0);
    };
    // Rays along z, y and x.
    EXPECT_EQ(work({5, 5, 0}).variant, "");
    EXPECT_EQ(work({85, 5, 0}).variant, "exchanged");
    EXPECT_EQ(work({5, 85, 0}).variant, "transposed");
    EXPECT_EQ(work({85, 5, 0}).gathers, 0) << "rows are copied";
    EXPECT_EQ(work({5, 85, 0}).gathers, 40 * 48 * 44);
}

}  // namespace
}  // namespace edgewise
