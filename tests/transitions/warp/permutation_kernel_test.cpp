#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/permutation.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise::kernels {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Samples of any type with the slack that kernels ask for.
struct Volume {
    Extent extent;
    Type type;
    int channels = 1;
    ValueMap values = {};
    std::vector<std::byte> bytes = {};

    Grid grid() const { return {bytes.data(), type, extent, channels, values}; }
};

template <class T>
void put(Volume& volume, std::mt19937& random, double low, double high) {
    std::uniform_real_distribution<double> value(low, high);
    T* samples = reinterpret_cast<T*>(volume.bytes.data());
    for (std::int64_t i = 0; i < volume.extent.samples() * volume.channels; ++i)
        samples[i] = T(value(random));
}

Volume random_volume(const Extent& extent, Type type, int channels = 1) {
    std::mt19937 random(11);
    Volume volume{extent, type, channels};
    volume.bytes.resize(extent.samples() * channels * bytes_of(type) + kSlack);
    switch (type) {
        case Type::u8:
            put<std::uint8_t>(volume, random, 0, 255);
            break;
        case Type::i8:
            put<std::int8_t>(volume, random, -128, 127);
            break;
        case Type::u16:
            put<std::uint16_t>(volume, random, 0, 65535);
            break;
        case Type::i16:
            put<std::int16_t>(volume, random, -32768, 32767);
            break;
        case Type::i32:
            put<std::int32_t>(volume, random, -1e6, 1e6);
            break;
        case Type::f64:
            put<double>(volume, random, -1, 1);
            break;
        default:
            put<float>(volume, random, -1, 1);
    }
    return volume;
}

/// Turn about the centres of both boxes.
Affine turned(const Matrix3d& a, const Extent& from, const Extent& to) {
    const Vector3d r((from.x - 1) / 2.0, (from.y - 1) / 2.0, (from.z - 1) / 2.0);
    const Vector3d c((to.x - 1) / 2.0, (to.y - 1) / 2.0, (to.z - 1) / 2.0);
    const Vector3d translation = c - a * r;
    Affine t;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) t[4 * row + column] = a(row, column);
        t[4 * row + 3] = translation[row];
    }
    return t;
}

Affine inverse(const Affine& t) {
    Matrix3d a;
    a << t[0], t[1], t[2], t[4], t[5], t[6], t[8], t[9], t[10];
    const Matrix3d b = a.inverse();
    const Vector3d shift = -b * Vector3d(t[3], t[7], t[11]);
    return {b(0, 0), b(0, 1),  b(0, 2), shift[0], b(1, 0), b(1, 1),
            b(1, 2), shift[1], b(2, 0), b(2, 1),  b(2, 2), shift[2]};
}

Matrix3d random_rotation(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized()
        .matrix();
}

Matrix3d in_plane(double degrees) {
    return Eigen::AngleAxisd(degrees * M_PI / 180, Vector3d::UnitZ()).matrix();
}

/// The whole warp, in regions of a size that divides nothing.
std::vector<float> permuted_warp(const Volume& volume, const Affine& t, Send send,
                                 const Extent& screen, float outside) {
    const auto chain = shear_chain(t);
    EXPECT_TRUE(chain);
    const PermutationWarp warp(volume.grid(), *chain, send, screen);
    std::vector<float> out(screen.samples() * volume.channels, outside);
    const Region all = warp.sites();
    for (std::int64_t z = all.begin[2]; z < all.end[2]; z += 7)
        for (std::int64_t y = all.begin[1]; y < all.end[1]; y += 13)
            for (std::int64_t x = all.begin[0]; x < all.end[0]; x += 150)
                warp({{x, y, z},
                      {std::min(x + 150, all.end[0]), std::min(y + 13, all.end[1]),
                       std::min(z + 7, all.end[2])}},
                     out.data());
    return out;
}

std::vector<float> backward_warp(const Volume& volume, const Affine& t, Hold hold,
                                 const Extent& screen, float outside) {
    std::vector<float> out(screen.samples() * volume.channels);
    BackwardWarp(volume.grid(), inverse(t), hold, outside)({out.data(), Region::all(screen)},
                                                           Region::all(screen));
    return out;
}

void expect_close(const std::vector<float>& a, const std::vector<float>& b, double tolerance) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], tolerance) << i;
}

/// Positions of the two warps agree to 2^-22 of a sample on each axis, and neighbours differ by at
/// most the range of the values; single precision adds a few units in the last place of the range.
double foh_tolerance(double range) { return range * (3 * 0x1p-21 + 8 * 0x1p-23); }

TEST(PermutationWarp, FohGivesTheBackwardWarpOfImages) {
    for (const Type type :
         {Type::u8, Type::i8, Type::u16, Type::i16, Type::f32, Type::i32, Type::f64})
        for (const double degrees :
             {0.0, 1e-11, 3.0, 30.0, 45.0, 89.9, 90.0, 133.7, 180.0, 271.3}) {
            const Volume image = random_volume({301, 170, 1}, type);
            const Extent screen{190, 311, 1};
            const Affine t = turned(in_plane(degrees), image.extent, screen);
            const double range = type == Type::i32  ? 2e6
                                 : is_integer(type) ? limits_of(type)[1] * 2
                                                    : 2;
            expect_close(permuted_warp(image, t, Send::foh, screen, -7),
                         backward_warp(image, t, Hold::foh, screen, -7), foh_tolerance(range));
        }
}

TEST(PermutationWarp, FohGivesTheBackwardWarpOfVolumes) {
    std::mt19937 random(5);
    for (int i = 0; i < 60; ++i) {
        const Type type = std::array{Type::u8, Type::u16, Type::f32, Type::f64}[i % 4];
        Volume volume = random_volume({41 + i, 37, 29}, type);
        if (i % 8 == 1) volume.values = {0.5, -3};
        const Extent screen{45, 47, 40 + i / 2};
        const Affine t = turned(random_rotation(random), volume.extent, screen);
        const double range = is_integer(type) ? limits_of(type)[1] : 2;
        expect_close(permuted_warp(volume, t, Send::foh, screen, 3),
                     backward_warp(volume, t, Hold::foh, screen, 3), foh_tolerance(range));
    }
}

TEST(PermutationWarp, ZohGivesTheNearestSampleOfThePoint) {
    std::mt19937 random(6);
    for (int i = 0; i < 20; ++i) {
        const Volume volume = random_volume({33, 31, 27}, i % 2 ? Type::f32 : Type::u8);
        const Extent screen{40, 41, 42};
        const Affine t = turned(random_rotation(random), volume.extent, screen), back = inverse(t);
        const auto forward = permuted_warp(volume, t, Send::zoh, screen, -1);
        const auto backward = backward_warp(volume, t, Hold::zoh, screen, -1);
        for (std::int64_t k = 0; k < screen.samples(); ++k) {
            if (forward[k] == backward[k]) continue;
            // Only a point on the face between two samples may fall to either.
            const auto p = apply(back, double(k % screen.x), double(k / screen.x % screen.y),
                                 double(k / screen.x / screen.y));
            double face = 1;
            for (double c : p) face = std::min(face, std::abs(c - std::floor(c) - 0.5));
            ASSERT_LT(face, 1e-6);
        }
    }
}

TEST(PermutationWarp, MeSendsEverySampleOnceAndAllOfThemIfTheScreenIsLarge) {
    std::mt19937 random(7);
    for (int i = 0; i < 20; ++i) {
        // Samples that are all different: what arrives tells where it came from.
        Volume volume{{23, 21, 19}, Type::f32};
        volume.bytes.resize(volume.extent.samples() * 4 + kSlack);
        auto* samples = reinterpret_cast<float*>(volume.bytes.data());
        for (std::int64_t k = 0; k < volume.extent.samples(); ++k) samples[k] = float(k);
        const Extent screen{46, 46, 46};
        const Affine t = turned(random_rotation(random), volume.extent, screen);
        const auto out = permuted_warp(volume, t, Send::me, screen, -1);
        const auto chain = *shear_chain(t);
        std::vector<int> arrivals(volume.extent.samples());
        for (std::int64_t z = 0; z < volume.extent.z; ++z)
            for (std::int64_t y = 0; y < volume.extent.y; ++y)
                for (std::int64_t x = 0; x < volume.extent.x; ++x) {
                    const auto at = screen_site(chain, {double(x), double(y), double(z)});
                    const auto k = std::int64_t((at[2] * screen.y + at[1]) * screen.x + at[0]);
                    const auto p = apply(inverse(t), at[0], at[1], at[2]);
                    bool inside = true;
                    for (int a = 0; a < 3; ++a)
                        inside = inside && p[a] >= -0.5 && p[a] <= double(volume.extent[a]) - 0.5;
                    const float own = samples[(z * volume.extent.y + y) * volume.extent.x + x];
                    ASSERT_EQ(out[k], inside ? own : -1);
                }
    }
}

TEST(PermutationWarp, EveryScreenSiteThatSeesTheInputIsWrittenOnce) {
    std::mt19937 random(8);
    std::normal_distribution<double> normal;
    int tried = 0;
    for (int i = 0; i < 300; ++i) {
        // Rotations and, every second time, some other equiareal map.
        Matrix3d a = random_rotation(random);
        if (i % 2) {
            a = Matrix3d::Identity();
            for (int k = 0; k < 9; ++k) a(k / 3, k % 3) += 0.25 * normal(random);
            if (a.determinant() < 0.1) continue;
            a /= std::cbrt(a.determinant());
        }
        const Extent object{17, 12, 9}, screen{18, 13, 16};
        const Affine t = turned(a, object, screen);
        const auto chain = shear_chain(t);
        if (!chain || chain->bound() > 4) continue;
        ++tried;
        Volume ones{object, Type::u8};
        ones.bytes.resize(object.samples() + kSlack, std::byte(1));
        const PermutationWarp warp(ones.grid(), *chain, Send::me, screen);
        // Written twice would mean two sites with one image; count sites, then look at the screen.
        std::vector<int> arrivals(screen.samples());
        const Region sites = warp.sites();
        for (auto z = sites.begin[2]; z < sites.end[2]; ++z)
            for (auto y = sites.begin[1]; y < sites.end[1]; ++y)
                for (auto x = sites.begin[0]; x < sites.end[0]; ++x) {
                    const auto at = screen_site(*chain, {double(x), double(y), double(z)});
                    if (at[0] < 0 || at[1] < 0 || at[2] < 0 || at[0] >= screen.x ||
                        at[1] >= screen.y || at[2] >= screen.z)
                        continue;
                    ++arrivals[std::int64_t((at[2] * screen.y + at[1]) * screen.x + at[0])];
                }
        std::vector<float> out(screen.samples(), -5);
        warp(sites, out.data());
        for (std::int64_t k = 0; k < screen.samples(); ++k) {
            const auto p = apply(inverse(t), double(k % screen.x), double(k / screen.x % screen.y),
                                 double(k / screen.x / screen.y));
            bool inside = true;
            for (int c = 0; c < 3; ++c)
                inside = inside && p[c] >= -0.5 - 1e-9 && p[c] <= double(object[c]) - 0.5 + 1e-9;
            ASSERT_LE(arrivals[k], 1);
            ASSERT_TRUE(!inside || arrivals[k] == 1) << i;
            ASSERT_EQ(out[k], inside ? 1.0f : -5.0f) << i;
        }
    }
    EXPECT_GT(tried, 150);
}

TEST(PermutationWarp, ChannelsStayTogether) {
    const Volume color = random_volume({50, 40, 1}, Type::u8, 3);
    const Extent screen{60, 60, 1};
    const Affine t = turned(in_plane(25), color.extent, screen);
    expect_close(permuted_warp(color, t, Send::foh, screen, 0),
                 backward_warp(color, t, Hold::foh, screen, 0), foh_tolerance(255));
}

TEST(PermutationWarp, NotFiniteSamplesStayWithinTheFootprint) {
    Volume image = random_volume({40, 40, 1}, Type::f32);
    auto* samples = reinterpret_cast<float*>(image.bytes.data());
    samples[20 * 40 + 20] = std::numeric_limits<float>::quiet_NaN();
    for (const double degrees : {0.0, 30.0, 90.0}) {
        const Affine t = turned(in_plane(degrees), image.extent, image.extent);
        const auto out = permuted_warp(image, t, Send::foh, image.extent, 0);
        int bad = 0;
        for (const float value : out) bad += !std::isfinite(value);
        EXPECT_GE(bad, 1);
        EXPECT_LE(bad, degrees == 30 ? 6 : 1);
    }
}

TEST(PermutationWarp, AxesOfOneOrTwoSamples) {
    for (const Extent& extent : {Extent{1, 1, 1}, Extent{2, 1, 1}, Extent{1, 7, 2}, Extent{5, 2, 1},
                                 Extent{1, 2, 9}, Extent{2, 2, 2}}) {
        const Volume volume = random_volume(extent, Type::f32);
        const Extent screen{12, 12, extent.z == 1 ? 1 : 12};
        const Matrix3d a = extent.z == 1
                               ? in_plane(20)
                               : Matrix3d(in_plane(20) * Eigen::AngleAxisd(0.4, Vector3d::UnitX()));
        const Affine t = turned(a, extent, screen);
        expect_close(permuted_warp(volume, t, Send::foh, screen, 5),
                     backward_warp(volume, t, Hold::foh, screen, 5), foh_tolerance(2));
    }
}

}  // namespace
}  // namespace edgewise::kernels
