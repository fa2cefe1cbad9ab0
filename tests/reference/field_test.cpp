#include "reference/field.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace edgewise {
namespace {

Data volume_of(const Extent& n, Type type, int axes = 3, int channels = 1) {
    Representation what;
    what.extent = n;
    what.type = type;
    what.axes = axes;
    what.channels = channels;
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::mt19937 bits(7);
    for (std::int64_t i = 0; i < n.samples() * channels; ++i) {
        const auto byte = static_cast<std::uint8_t>(bits() >> 24);
        if (type == Type::u8)
            data.as<std::uint8_t>()[i] = byte;
        else
            data.as<float>()[i] = static_cast<float>(byte) / 16 - 3;
    }
    return data;
}

/// B-spline coefficients of a mirrored line, by solving the interpolation equations as they stand.
Eigen::MatrixXd interpolation_matrix(std::int64_t n) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
    for (std::int64_t i = 0; i < n; ++i) {
        matrix(i, i) += 4.0 / 6;
        matrix(i, mirrored_index(i - 1, n)) += 1.0 / 6;
        matrix(i, mirrored_index(i + 1, n)) += 1.0 / 6;
    }
    return matrix;
}

double cubic(double t) {
    t = std::abs(t);
    return t < 1 ? 2.0 / 3 - t * t + t * t * t / 2 : t < 2 ? std::pow(2 - t, 3) / 6 : 0;
}

/// Dense evaluation of the spline through a whole volume.
class WholeSpline {
 public:
    explicit WholeSpline(const Data& data) : n_(data.what.extent) {
        for (std::int64_t i = 0; i < n_.samples(); ++i)
            c_.push_back(data.what.type == Type::u8 ? data.as<std::uint8_t>()[i]
                                                    : data.as<float>()[i]);
        solve(n_.x, 1, {n_.y, n_.z}, {n_.x, n_.x * n_.y});
        solve(n_.y, n_.x, {n_.x, n_.z}, {1, n_.x * n_.y});
        solve(n_.z, n_.x * n_.y, {n_.x, n_.y}, {1, n_.x});
    }
    double at(const Vec3& p) const {
        double sum = 0;
        for (int k = -1; k < 3; ++k)
            for (int j = -1; j < 3; ++j)
                for (int i = -1; i < 3; ++i) {
                    const Vec3 s = p.array().floor().matrix() + Vec3(i, j, k);
                    const auto at = [&](int axis) {
                        return mirrored_index(static_cast<std::int64_t>(s[axis]), n_[axis]);
                    };
                    sum += cubic(p.x() - s.x()) * cubic(p.y() - s.y()) * cubic(p.z() - s.z()) *
                           c_[static_cast<std::size_t>(at(0) + n_.x * (at(1) + n_.y * at(2)))];
                }
        return sum;
    }

 private:
    void solve(std::int64_t n, std::int64_t step, std::array<std::int64_t, 2> lines,
               std::array<std::int64_t, 2> steps) {
        if (n == 1) return;
        const Eigen::PartialPivLU<Eigen::MatrixXd> equations(interpolation_matrix(n));
        for (std::int64_t a = 0; a < lines[0]; ++a)
            for (std::int64_t b = 0; b < lines[1]; ++b) {
                double* first = c_.data() + a * steps[0] + b * steps[1];
                Eigen::Map<Eigen::VectorXd, 0, Eigen::InnerStride<>> line(
                    first, n, Eigen::InnerStride<>(step));
                line = equations.solve(Eigen::VectorXd(line));
            }
    }
    Extent n_;
    std::vector<double> c_;
};

class Splines : public testing::TestWithParam<Extent> {};

TEST_P(Splines, AgreeWithTheWholeVolumeSolvedDensely) {
    const Extent n = GetParam();
    for (Type type : {Type::u8, Type::f32}) {
        const Data data = volume_of(n, type);
        const WholeSpline whole(data);
        const ReferenceField field(data, Field::spline);
        const Region all = Region::all(n);
        Region cells = all;  // a tile in the middle, cut on all sides where n allows
        for (int axis = 0; axis < 3; ++axis) {
            cells.begin[axis] = n[axis] / 2;
            cells.end[axis] = std::min(n[axis], cells.begin[axis] + 3);
        }
        const FieldPiece piece(field, all, std::pmr::get_default_resource());
        const FieldPiece cut(field, cells, std::pmr::get_default_resource());
        const SplineBlock<float> coarse(data, cells, 12, std::pmr::get_default_resource());
        std::mt19937 bits(3);
        std::uniform_real_distribution<double> uniform(0, 1);
        for (int i = 0; i < 60; ++i) {
            Vec3 p, q;
            for (int axis = 0; axis < 3; ++axis) {
                p[axis] = uniform(bits) * static_cast<double>(n[axis]) - 0.5;
                q[axis] =
                    static_cast<double>(cells.begin[axis]) +
                    uniform(bits) * static_cast<double>(cells.end[axis] - cells.begin[axis] - 1);
            }
            double value = 0;
            // Values up to 255, sums of 64 taps, margins of 24 samples: 255 x 1e-13.
            ASSERT_TRUE(field.at(p, {&value, 1}));
            EXPECT_NEAR(value, whole.at(field.clamped(p)), 3e-11);
            ASSERT_TRUE(piece.at(p, &value));
            EXPECT_NEAR(value, whole.at(field.clamped(p)), 3e-11);
            ASSERT_TRUE(cut.at(q, &value));
            EXPECT_NEAR(value, whole.at(q), 3e-11);
            coarse.at(q, &value);
            EXPECT_NEAR(value, whole.at(q), 255 * 3e-6);  // f32, and |pole|^12 = 1.4e-7
            // Differences h = 1e-4 to either side, also beyond faces, where the spline is mirrored:
            // third derivatives of 255 x 100 leave h^2 / 6 of these, and where they jump thrice.
            for (const auto& [in, at] : {std::pair(&piece, p), std::pair(&cut, q)})
                for (int axis = 0; axis < 3; ++axis) {
                    const Vec3 away = 1e-4 * Vec3::Unit(axis), here = field.clamped(at);
                    const double slope =
                        n[axis] == 1 ? 0 : (whole.at(here + away) - whole.at(here - away)) / 2e-4;
                    EXPECT_NEAR(in->gradient(at)[axis], slope, 255 * 1e-6);
                }
        }
    }
}
INSTANTIATE_TEST_SUITE_P(Extents, Splines,
                         testing::Values(Extent{1, 1, 1}, Extent{2, 1, 3}, Extent{5, 4, 1},
                                         Extent{9, 2, 7}, Extent{70, 5, 61}, Extent{20, 64, 33}));

TEST(ReferenceField, GoesThroughItsSamples) {
    const Data data = volume_of({11, 7, 5}, Type::f32);
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        for (std::int64_t i = 0; i < data.what.samples(); ++i) {
            double value = 0;
            const Vec3 p(static_cast<double>(i % 11), static_cast<double>(i / 11 % 7),
                         static_cast<double>(i / 77));
            ASSERT_TRUE(field.at(p, {&value, 1}));
            EXPECT_NEAR(value, static_cast<double>(data.as<float>()[i]), 1e-11);
        }
    }
}

TEST(ReferenceField, ReachesHalfASampleBeyondTheCentres) {
    const Data data = volume_of({4, 4, 4}, Type::u8);
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        double at_face = 0, at_centre = 0;
        EXPECT_TRUE(field.at({-0.5, 1, 3.5}, {&at_face, 1}));
        EXPECT_TRUE(field.at({0, 1, 3}, {&at_centre, 1}));
        EXPECT_NEAR(at_face, at_centre, 1e-11);
        EXPECT_FALSE(field.at({-0.51, 1, 1}, {&at_face, 1}));
        EXPECT_FALSE(field.at({1, 3.51, 1}, {&at_face, 1}));
    }
}

TEST(ReferenceField, IsAbsentAroundValuesThatAreNotFiniteAndFiniteElsewhere) {
    Data data = volume_of({12, 12, 12}, Type::f32);
    data.as<float>()[5 + 12 * (5 + 12 * 5)] = std::numeric_limits<float>::quiet_NaN();
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        const FieldPiece piece(field, Region::all({12, 12, 12}), std::pmr::get_default_resource());
        double value = 0;
        EXPECT_FALSE(field.at({5.3, 4.8, 5}, {&value, 1}));
        EXPECT_FALSE(piece.at({5.3, 4.8, 5}, &value));
        for (double x : {4.0, 5.6, 9.0}) {
            EXPECT_TRUE(field.at({x, 5, 5}, {&value, 1}));
            EXPECT_TRUE(std::isfinite(value));
            EXPECT_TRUE(piece.at({x, 5, 5}, &value));
            EXPECT_TRUE(std::isfinite(value));
        }
        EXPECT_TRUE(field.near_non_finite({6.9, 5, 5}));
        EXPECT_FALSE(field.near_non_finite({7.1, 5, 5}));
    }
}

/// Samples that are not finite are passed over: with any of them missing a constant stays constant.
TEST(ReferenceField, KeepsAConstantBesideGaps) {
    const Extent n{14, 11, 9};
    Data data = volume_of(n, Type::f32);
    std::mt19937 bits(5);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        data.as<float>()[i] = bits() % 5 == 0 ? HUGE_VALF : 1000;
    for (std::int64_t i = 3 * 14 * 11; i < 5 * 14 * 11; ++i) data.as<float>()[i] = NAN;
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        const FieldPiece piece(field, Region::all(n), std::pmr::get_default_resource());
        int present = 0;
        for (int i = 0; i < 300; ++i) {
            const Vec3 p(13 * (bits() * 0x1p-32), 10 * (bits() * 0x1p-32), 8 * (bits() * 0x1p-32));
            double alone = 0, value = 0;
            const bool is_there = field.at(p, {&alone, 1});
            ASSERT_EQ(piece.at(p, &value), is_there);
            if (!is_there) continue;
            ++present;
            EXPECT_NEAR(alone, 1000, 1e-9);
            EXPECT_NEAR(value, 1000, 1e-9);
        }
        EXPECT_GT(present, 100);
    }
}

/// Prepared or not, the field is the same near gaps and far from them.
TEST(ReferenceField, IsTheSameInPiecesWithGaps) {
    const Extent n{30, 11, 9};
    Data data = volume_of(n, Type::f32);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        if (i % 30 < 3) data.as<float>()[i] = NAN;
    const ReferenceField field(data, Field::spline);
    const FieldPiece piece(field, Region::all(n), std::pmr::get_default_resource());
    std::mt19937 bits(5);
    for (int i = 0; i < 300; ++i) {
        const Vec3 p(2.5 + 26 * (bits() * 0x1p-32), 10 * (bits() * 0x1p-32),
                     8 * (bits() * 0x1p-32));
        double alone = 0, value = 0;
        ASSERT_TRUE(field.at(p, {&alone, 1}));
        ASSERT_TRUE(piece.at(p, &value));
        EXPECT_NEAR(alone, value, 1e-9) << p.transpose();
    }
}

TEST(ReferenceField, MapsValuesAndKeepsChannelsApart) {
    Data data = volume_of({9, 8, 1}, Type::u8, 2, 3);
    data.what.values = {2, -5};
    Data second = volume_of({9, 8, 1}, Type::u8, 2);
    for (std::int64_t i = 0; i < 72; ++i)
        second.as<std::uint8_t>()[i] = data.as<std::uint8_t>()[3 * i + 1];
    const WholeSpline whole(second);
    const ReferenceField field(data, Field::spline);
    const FieldPiece piece(field, Region::all({9, 8, 1}), std::pmr::get_default_resource());
    for (const Vec3& p : {Vec3(3.3, 2.2, 17), Vec3(0, 6.9, 0), Vec3(8, 7, 0)}) {
        std::array<double, 3> value{};
        ASSERT_TRUE(field.at(p, value));
        EXPECT_NEAR(value[1], 2 * whole.at({p.x(), p.y(), 0}) - 5, 1e-10);
        ASSERT_TRUE(piece.at(p, value.data()));
        EXPECT_NEAR(value[1], 2 * whole.at({p.x(), p.y(), 0}) - 5, 1e-10);
    }
}

}  // namespace
}  // namespace edgewise
