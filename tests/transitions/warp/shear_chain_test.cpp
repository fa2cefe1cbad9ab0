#include "transitions/warp/shear_chain.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <set>

namespace edgewise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using kernels::Affine;
using kernels::ShearChain;

constexpr double kWorstRotation = (3 + std::numbers::sqrt2) / 4;

Affine affine(const Matrix3d& a, const Vector3d& translation = Vector3d::Zero()) {
    Affine t;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) t[4 * row + column] = a(row, column);
        t[4 * row + 3] = translation[row];
    }
    return t;
}

Matrix3d turn(int axis, double degrees) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3d::Unit(axis)).matrix();
}

Matrix3d random_rotation(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized()
        .matrix();
}

Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// The chain gives its map back, at the origin and away from it, and its coefficients are finite.
void expect_product(const ShearChain& chain, const Matrix3d& a, const Vector3d& translation) {
    for (int k = 0; k < chain.count; ++k) {
        for (double by : chain.shears[k].by) ASSERT_TRUE(std::isfinite(by));
        ASSERT_TRUE(std::isfinite(chain.shears[k].offset));
        ASSERT_EQ(chain.shears[k].by[chain.shears[k].axis], 0);
    }
    EXPECT_LT((vector(kernels::sheared(chain, {0, 0, 0})) - translation).norm(), 1e-9);
    for (int axis = 0; axis < 3; ++axis) {
        std::array<double, 3> unit{0, 0, 0};
        unit[axis] = 1;
        // The product within 1e-9 an entry, and as much again for the origin.
        const Vector3d image = vector(kernels::sheared(chain, unit)) - translation;
        EXPECT_LT((image - a.col(axis)).cwiseAbs().maxCoeff(), 2e-9);
    }
}

/// Sends a site by the rule and back, and measures how far T^-1 M x is from x.
void expect_bounded_at(const ShearChain& chain, const Matrix3d& inverse,
                       const Vector3d& translation, const std::array<double, 3>& site) {
    const std::array<double, 3> sent = kernels::screen_site(chain, site);
    ASSERT_EQ(kernels::object_site(chain, sent), site);
    const Vector3d moved = inverse * (vector(sent) - translation) - vector(site);
    // Positions of some thousand samples are off by 1e-9 where the chain's entries are off by
    // 1e-13.
    for (int i = 0; i < 3; ++i) ASSERT_LE(std::abs(moved[i]), chain.displacement[i] + 1e-7);
}

void expect_bounded(const ShearChain& chain, const Matrix3d& a, const Vector3d& translation,
                    int half) {
    const Matrix3d inverse = a.inverse();
    for (int z = -half; z <= half; ++z)
        for (int y = -half; y <= half; ++y)
            for (int x = -half; x <= half; ++x)
                expect_bounded_at(chain, inverse, translation, {double(x), double(y), double(z)});
}

/// The same at sites of a volume of 4096 samples along each axis.
void expect_bounded_far(const ShearChain& chain, const Matrix3d& a, const Vector3d& translation,
                        int sites, std::mt19937& random) {
    const Matrix3d inverse = a.inverse();
    std::uniform_int_distribution<int> index(0, 4095);
    for (int i = 0; i < sites; ++i)
        expect_bounded_at(chain, inverse, translation,
                          {double(index(random)), double(index(random)), double(index(random))});
}

TEST(ShearChain, RandomRotationsStayWithinTheBoundThatHasBeenPublished) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> shift(-100, 100);
    double worst = 0;
    for (int i = 0; i < 10000; ++i) {
        const Matrix3d a = random_rotation(random);
        const Vector3d translation(shift(random), shift(random), shift(random));
        const auto chain = shear_chain(affine(a, translation));
        ASSERT_TRUE(chain);
        expect_product(*chain, a, translation);
        expect_bounded_far(*chain, a, translation, 100, random);
        if (i % 10 == 0) expect_bounded(*chain, a, translation, 4);
        worst = std::max(worst, chain->bound());
    }
    EXPECT_LE(worst, kWorstRotation + 1e-9);
    EXPECT_GT(worst, 1.08);  // the bound is nearly reached, so it is not an overestimate
}

TEST(ShearChain, TurnsAboutOneAxisNeedThreeShears) {
    double worst = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int degrees = -360; degrees <= 360; ++degrees) {
            const Matrix3d a = turn(axis, degrees);
            const Vector3d translation(0.5, -3, 7);
            const auto chain = shear_chain(affine(a, translation));
            ASSERT_TRUE(chain) << axis << ' ' << degrees;
            EXPECT_LE(chain->count, 4);  // three, and the third axis moves
            expect_product(*chain, a, translation);
            expect_bounded(*chain, a, translation, 5);
            for (double bound : chain->displacement) worst = std::max(worst, bound);
        }
    // max over an angle up to 45 degrees of (1 + tan(angle / 2) + cos(angle)) / 2
    EXPECT_LE(worst, 1.0675);
}

/// Each pass interpolates, so what one pass can do takes one.
TEST(ShearChain, OneShearIsOnePass) {
    for (int axis = 0; axis < 3; ++axis)
        for (int from = 0; from < 3; ++from) {
            if (from == axis) continue;
            Matrix3d a = Matrix3d::Identity();
            a(axis, from) = 0.7;
            const Vector3d translation = 0.25 * Vector3d::Unit(axis);
            const auto chain = shear_chain(affine(a, translation));
            ASSERT_TRUE(chain) << axis << ' ' << from;
            EXPECT_EQ(chain->count, 1) << axis << ' ' << from;
            expect_product(*chain, a, translation);
        }
}

TEST(ShearChain, AnglesNextToAQuarterTurnAreNoSpecialCase) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> exponent(-16, -1);
    for (int quarter = -180; quarter <= 180; quarter += 90)
        for (int axis = 0; axis < 3; ++axis)
            for (int i = 0; i < 200; ++i) {
                // From single-axis tilts of a rounding error up to a tenth of a radian.
                const double radians = std::pow(10, exponent(random)) * (i % 2 ? 1 : -1);
                Matrix3d a = turn(axis, quarter + radians * 180 / std::numbers::pi);
                if (i % 4 < 2) a = a * turn((axis + 1) % 3, radians * 100 + 90 * (i % 3));
                const auto chain = shear_chain(affine(a));
                ASSERT_TRUE(chain) << quarter << ' ' << axis << ' ' << radians;
                expect_product(*chain, a, Vector3d::Zero());
                ASSERT_LE(chain->bound(), kWorstRotation + 1e-9);
                if (i < 20) expect_bounded(*chain, a, Vector3d::Zero(), 4);
            }
}

TEST(ShearChain, RoundingErrorsBesideAQuarterTurnKeepTheBound) {
    std::mt19937 random(6);
    for (int quarter = -360; quarter <= 360; quarter += 90)
        for (int axis = 0; axis < 3; ++axis)
            for (const double radians : {0.0, 1e-17, 1e-16, 3e-15, 1e-13, 1e-12})
                for (const double sign : {1.0, -1.0}) {
                    const double degrees = sign * radians * 180 / std::numbers::pi;
                    const Matrix3d a =
                        turn(axis, quarter + degrees) * turn((axis + 1) % 3, degrees);
                    const Vector3d translation(0.5, 2047.5, -1e-12);
                    const auto chain = shear_chain(affine(a, translation));
                    ASSERT_TRUE(chain) << quarter << ' ' << axis << ' ' << radians;
                    expect_product(*chain, a, translation);
                    ASSERT_LE(chain->bound(), kWorstRotation + 1e-9);
                    expect_bounded(*chain, a, translation, 2);
                    expect_bounded_far(*chain, a, translation, 50, random);
                }
}

TEST(ShearChain, SignedPermutationsAreExact) {
    for (int degrees : {0, 90, 180, 270})
        for (int second : {0, 90, 180}) {
            const Matrix3d a = turn(2, degrees) * turn(0, second);
            const Vector3d translation(3, -4, 511);
            const auto chain = shear_chain(affine(a, translation));
            ASSERT_TRUE(chain);
            EXPECT_EQ(chain->bound(), 0);
            const std::array<double, 3> sent = kernels::screen_site(*chain, {5, 6, 7});
            EXPECT_LT((vector(sent) - a * Vector3d(5, 6, 7) - translation).norm(), 1e-9);
        }
}

TEST(ShearChain, RandomEquiarealMapsKeepTheBoundThatTheyAnnounce) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    int found = 0;
    for (int i = 0; i < 2000; ++i) {
        Matrix3d a;
        for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal(random);
        if (i % 2) a = Matrix3d::Identity() + 0.3 * a;
        if (i % 5 == 0) {  // an image
            a.row(2) = a.col(2).transpose() = Vector3d::UnitZ();
        }
        const double det = a.determinant();
        if (std::abs(det) < 0.05) continue;
        if (i % 5 == 0)
            a.topLeftCorner<2, 2>() /= std::sqrt(std::abs(det));
        else
            a /= std::cbrt(std::abs(det));
        const Vector3d translation = i % 5 ? Vector3d(0.25, 1.5, -3) : Vector3d(0.25, 1.5, 0);
        const auto chain = shear_chain(affine(a, translation));
        if (!chain) continue;
        ++found;
        expect_product(*chain, a, translation);
        if (chain->bound() < 50) expect_bounded(*chain, a, translation, 3);
    }
    EXPECT_GT(found, 1800);
}

/// Rotations about all axes, about one axis, and other equiareal maps.
Matrix3d some_equiareal_map(int i, std::mt19937& random) {
    std::normal_distribution<double> normal;
    if (i % 3 == 0) return random_rotation(random);
    if (i % 3 == 1) return turn(i % 9 / 3, 60 * normal(random));
    for (;;) {
        Matrix3d a = Matrix3d::Identity();
        for (int k = 0; k < 9; ++k) a(k / 3, k % 3) += 0.3 * normal(random);
        if (a.determinant() > 0.2) return a / std::cbrt(a.determinant());
    }
}

TEST(ShearChain, NoTwoSitesMeetAndNoneIsLeftOut) {
    std::mt19937 random(4);
    for (int i = 0; i < 300; ++i) {
        const Matrix3d a = some_equiareal_map(i, random);
        const auto chain = shear_chain(affine(a, {0.3, 0.5, 0.7}));
        ASSERT_TRUE(chain);
        std::set<std::array<double, 3>> sent;
        for (int z = -5; z <= 5; ++z)
            for (int y = -5; y <= 5; ++y)
                for (int x = -5; x <= 5; ++x) {
                    const std::array<double, 3> site = {double(x), double(y), double(z)};
                    sent.insert(kernels::screen_site(*chain, site));
                    // Taken as a site of the screen, it has one of the object.
                    const std::array<double, 3> source = kernels::object_site(*chain, site);
                    ASSERT_EQ(kernels::screen_site(*chain, source), site);
                }
        EXPECT_EQ(sent.size(), 11u * 11 * 11);
    }
}

TEST(ShearChain, ReflectionsAreTakenOutFirst) {
    for (int degrees = 0; degrees < 360; degrees += 11) {
        const Matrix3d a = turn(2, degrees) * Vector3d(1, -1, 1).asDiagonal();
        const auto chain = shear_chain(affine(a));
        ASSERT_TRUE(chain);
        expect_product(*chain, a, Vector3d::Zero());
        EXPECT_LE(chain->bound(), 1.0675);
    }
}

TEST(ShearChain, MapsThatScaleAreRefused) {
    EXPECT_FALSE(shear_chain(affine(1.01 * Matrix3d::Identity())));
    EXPECT_FALSE(shear_chain(affine(Matrix3d::Zero())));
    EXPECT_FALSE(shear_chain(affine(Matrix3d::Constant(std::nan("")))));
}

}  // namespace
}  // namespace edgewise
