#include "graph/lines_touched.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <set>
#include <vector>

namespace edgewise {
namespace {

/// Columns: right, down and behind of a screen that is turned about x, y and z, in this order.
Eigen::Matrix3d turned(const Eigen::Vector3d& degrees, const Eigen::Vector3d& apart) {
    const Eigen::Vector3d angle = degrees * std::numbers::pi / 180;
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
    return turn.transpose() * apart.asDiagonal();
}

/// Lines that all samples of a lattice within a volume touch, one by one, for each sample.
double counted(const Eigen::Matrix3d& lattice, int bytes, int taps) {
    const Eigen::Vector3i n(256, 96, 80);
    const int line = 64 / bytes;
    std::vector<char> touched(std::size_t(n.x() / line) * n.y() * n.z());
    double samples = 0;
    const Eigen::Vector3d middle = n.cast<double>() / 2;
    const Eigen::Vector3d reach =
        lattice.inverse().cwiseAbs() * middle + Eigen::Vector3d::Constant(1);
    const Eigen::Vector3i last = reach.cast<int>();
    for (int k = -last.z(); k <= last.z(); ++k)
        for (int j = -last.y(); j <= last.y(); ++j)
            for (int i = -last.x(); i <= last.x(); ++i) {
                const Eigen::Vector3d place = middle + lattice * Eigen::Vector3d(i, j, k);
                const Eigen::Vector3d from = place - Eigen::Vector3d::Constant(0.5 * (taps - 2));
                const Eigen::Vector3i low = from.array().floor().cast<int>();
                if (low.minCoeff() < 0 || (low.array() + taps > n.array()).any()) continue;
                ++samples;
                for (int z = low.z(); z < low.z() + taps; ++z)
                    for (int y = low.y(); y < low.y() + taps; ++y)
                        for (int x = low.x(); x < low.x() + taps; ++x)
                            touched[(std::size_t(z) * n.y() + y) * (n.x() / line) + x / line] = 1;
            }
    return double(std::count(touched.begin(), touched.end(), 1)) / samples;
}

double estimated(const Eigen::Matrix3d& lattice, int bytes, int taps) {
    return lines_touched(lattice, bytes, Eigen::Vector3d::Constant(taps));
}

TEST(LinesTouched, OfTurnedLatticesAreThoseCountedOneByOne) {
    double squares = 0;
    int cases = 0;
    for (const auto& degrees : {Eigen::Vector3d{20, 30, 0},
                                {5, 60, 10},
                                {-3, 84, 4},
                                {0, 80, 5},
                                {0, 90, 0},
                                {70, 10, 5}})
        for (const double pixel : {1.0, 2.5})
            for (const int bytes : {1, 4})
                for (const int taps : {1, 2}) {
                    const Eigen::Matrix3d lattice = turned(degrees, {pixel, pixel, 2});
                    const double truth = counted(lattice, bytes, taps);
                    const double log = std::log(estimated(lattice, bytes, taps) / truth);
                    // Samples at random places, as many as lines, touch 1 - 1/e of them; those of
                    // lattices lie more evenly, and so do less harm to the least of the estimates.
                    EXPECT_LT(std::abs(log), -std::log(1 - std::exp(-1.0)))
                        << degrees.transpose() << ' ' << pixel << ' ' << bytes << ' ' << taps;
                    squares += log * log;
                    ++cases;
                }
    EXPECT_LT(std::sqrt(squares / cases), 0.12);
}

TEST(LinesTouched, DenseSamplesShareAllLinesAndLoneOnesNone) {
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    EXPECT_DOUBLE_EQ(estimated(unit, 1, 1), 1.0 / 64);
    EXPECT_DOUBLE_EQ(estimated(unit, 4, 2), 1.0 / 16);
    EXPECT_DOUBLE_EQ(estimated(1000 * unit, 4, 1), 1);
    EXPECT_DOUBLE_EQ(estimated(1000 * unit, 4, 4), 16 * 19.0 / 16);
}

TEST(LinesTouched, RaysAlongRowsReadTheseInOrder) {
    const Eigen::Matrix3d along = turned({0, 90, 0}, {5, 5, 2});
    EXPECT_NEAR(estimated(along, 4, 1), 2.0 / 16, 1e-12);
    EXPECT_NEAR(estimated(along, 4, 2), 4 * 2.0 / 16, 1e-12);
}

/// Lines that a packet of rays reads anew from step to step, one by one, for each sample.
double swept(const Eigen::Matrix3d& lattice, int side, int bytes, int taps) {
    constexpr int kPackets = 200, kSteps = 40;
    const int line = 64 / bytes;
    const auto packed = [](int x, int y, int z) {
        return (std::int64_t(z + 4096) << 32) + (std::int64_t(y + 4096) << 16) + (x + 4096);
    };
    double lines = 0;
    for (int packet = 0; packet < kPackets; ++packet) {
        // Places all over a line's box (Roberts 2018).
        const Eigen::Vector3d begin(line * std::fmod(0.8191725134 * packet, 1.0),
                                    std::fmod(0.6710436067 * packet, 1.0),
                                    std::fmod(0.5497004779 * packet, 1.0));
        std::set<std::int64_t> read;
        for (int k = 0; k <= kSteps; ++k) {
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i) {
                    const Eigen::Vector3d place = begin + lattice * Eigen::Vector3d(i, j, k);
                    const Eigen::Vector3i low = place.array().floor().cast<int>();
                    for (int z = 0; z < taps; ++z)
                        for (int y = 0; y < taps; ++y)
                            for (int x = 0; x < taps; ++x)
                                read.insert(packed(int(std::floor(double(low.x() + x) / line)),
                                                   low.y() + y, low.z() + z));
                }
            if (k == 0) lines -= double(read.size());  // of the front alone
        }
        lines += double(read.size());
    }
    return lines / (double(kPackets) * kSteps * side * side);
}

TEST(LinesTouched, APacketOfRaysSweepsThoseThatAreCountedOneByOne) {
    for (const auto& degrees :
         {Eigen::Vector3d{20, 30, 0}, {5, 60, 10}, {-3, 84, 4}, {0, 80, 5}, {70, 10, 5}})
        for (const double pixel : {0.5, 1.0})
            for (const int bytes : {1, 4})
                for (const int taps : {1, 2}) {
                    const Eigen::Matrix3d lattice = turned(degrees, {pixel, pixel, 0.5});
                    const double truth = swept(lattice, 4, bytes, taps);
                    // Rays between which lines fit leave some out, and a front of 3 x 3 gaps is
                    // counted as one of 4 x 4.
                    const double ratio =
                        lines_swept(lattice, 4, bytes, Eigen::Vector3d::Constant(taps)) / truth;
                    EXPECT_GT(ratio, 0.95) << degrees.transpose() << ' ' << pixel << ' ' << bytes;
                    EXPECT_LT(ratio, 1.5) << degrees.transpose() << ' ' << pixel << ' ' << bytes;
                }
}

TEST(LinesTouched, AnImageHasOneSlice) {
    Eigen::Matrix3d lattice = Eigen::Matrix3d::Identity();
    lattice.topLeftCorner<2, 2>() *= 0.5;
    EXPECT_DOUBLE_EQ(lines_touched(lattice, 4, {2, 2, 1}), 0.25 / 16);
}

}  // namespace
}  // namespace edgewise
