// Rays through labels against all voxels' boxes, one by one.
#include "transitions/project/label_cast.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>

#include "graph/label_surface.hpp"
#include "reference/answer.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise::label_cast_test {
namespace {

constexpr Extent kVolume{11, 9, 13}, kPicture{47, 41, 30};

/// About a tenth of the voxels have one of the labels.
template <class T>
Data labels_of(Type type, const std::vector<T>& labels, const ValueMap& values = {},
               const Extent& n = kVolume) {
    Representation what;
    what.type = type;
    what.extent = n;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 bits(5);
    for (std::int64_t i = 0; i < n.samples(); ++i) {
        const auto drawn = static_cast<std::size_t>(bits() % (10 * labels.size()));
        data.as<T>()[i] = drawn < labels.size() ? labels[drawn] : T{0};
    }
    return data;
}

Request request_for(const Data& data, bool eye, const Vec3& spacing = Vec3::Ones()) {
    Request want;
    want.mode = mode_named("surface");
    want.surface = SurfaceOf{};
    want.field = Field::nearest;
    want.input = data.what.extent;
    want.spacing = spacing;
    want.screen = kPicture;
    want.pixel = {0.4, 0.5};
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.9, Vec3(3, -2, 1).normalized()).toRotationMatrix();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = Vec3(2.5, 2, 1).asDiagonal() * turn * spacing.asDiagonal();
    const auto middle = [](const Extent& n) -> Vec3 {
        return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2;
    };
    map.topRightCorner<3, 1>() =
        middle(kPicture) - map.topLeftCorner<3, 3>() * middle(data.what.extent);
    want.views = Placement(map);
    if (eye) want.eye = Eye{Vec3(20, 22, -25), middle(kPicture).z(), 0.4, 0.5};
    for (int i = -200; i <= 200; ++i)
        want.transfer.points.push_back(
            {i - 0.5, 1, {0.5 + i / 500.0, 0.5 - i / 500.0, i % 2 == 0 ? 0.9 : 0.1}});
    return want;
}

Data cast(const Data& in, const Request& want, Region region = {}) {
    const Transition edge = label_cast();
    const Scene scene;
    const Ask ask{want, scene};
    const Offer offer = edge.offer(in.what, ask, {});
    EXPECT_EQ(offer.refused, "");
    if (region.empty()) region = Region::all(offer.to.extent);
    Data out = Data::make(offer.to, region, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, region, context);
    return out;
}

struct Line {
    Vec3 origin, along, to_eye;
};
Line line_of(const Request& want, double x, double y) {
    const Mat4 back = want.views.at(0).matrix().inverse();
    const auto point = [&](const Vec3& p) -> Vec3 {
        return back.topLeftCorner<3, 3>() * p + back.topRightCorner<3, 1>();
    };
    if (!want.eye)
        return {point({x, y, 0}), back.topLeftCorner<3, 3>() * Vec3(0, 0, 1), {0, 0, -1}};
    const Vec3 along = Vec3(x, y, want.eye->plane) - want.eye->at;
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    return {point(want.eye->at), back.topLeftCorner<3, 3>() * along,
            (-along).cwiseProduct(steps).normalized()};
}

/// The voxel with a label whose box a line meets first.
struct Met {
    double t = std::numeric_limits<double>::infinity(), label = 0;
    bool is_clear = true;  // no edge is grazed, and no other label begins there
};
template <class T>
Met met_by(const Line& line, const Data& in, const Request& want) {
    constexpr double kSame = 1e-9;
    Met met;
    for (std::int64_t z = 0; z < in.what.extent.z; ++z)
        for (std::int64_t y = 0; y < in.what.extent.y; ++y)
            for (std::int64_t x = 0; x < in.what.extent.x; ++x) {
                const double value = in.what.values(static_cast<double>(*in.at<T>(x, y, z)));
                if (!is_label(want, value)) continue;
                const Vec3 middle{double(x), double(y), double(z)};
                const Vec3 low = middle.array() - 0.5 - line.origin.array(),
                           high = middle.array() + 0.5 - line.origin.array();
                const Vec3 a = low.cwiseQuotient(line.along), b = high.cwiseQuotient(line.along);
                const double enters = a.cwiseMin(b).maxCoeff(), leaves = a.cwiseMax(b).minCoeff();
                if (std::abs(leaves - enters) < kSame) met.is_clear = false;
                if (enters >= leaves || enters > met.t + kSame) continue;
                if (std::abs(enters - met.t) < kSame && value != met.label) met.is_clear = false;
                if (enters < met.t) met.t = enters, met.label = value;
            }
    return met;
}

/// How much of a label there is near p, and which way that changes.
double bump(double x) {
    const double a = std::abs(x) / kCoverageWidth;
    return a >= 2 ? 0 : a >= 1 ? std::pow(2 - a, 3) / 6 : 2.0 / 3 - a * a + a * a * a / 2;
}
template <class T>
double coverage(const Data& in, double label, const Vec3& p) {
    double sum = 0;
    for (std::int64_t z = 0; z < in.what.extent.z; ++z)
        for (std::int64_t y = 0; y < in.what.extent.y; ++y)
            for (std::int64_t x = 0; x < in.what.extent.x; ++x)
                if (in.what.values(static_cast<double>(*in.at<T>(x, y, z))) == label)
                    sum +=
                        bump(p.x() - double(x)) * bump(p.y() - double(y)) * bump(p.z() - double(z));
    return sum;
}
template <class T>
Vec3 change_of_coverage(const Data& in, double label, const Vec3& p) {
    constexpr double kStep = 1e-4;
    Vec3 change;
    for (int axis = 0; axis < 3; ++axis)
        change[axis] = coverage<T>(in, label, p + kStep * Vec3::Unit(axis)) -
                       coverage<T>(in, label, p - kStep * Vec3::Unit(axis));
    return change / (2 * kStep);
}

template <class T>
void expect_nearest_voxels(const Data& in, const Request& want) {
    const Data picture = cast(in, want);
    int hits = 0, clear = 0;
    for (std::int64_t y = 0; y < kPicture.y; ++y)
        for (std::int64_t x = 0; x < kPicture.x; ++x) {
            const Met met = met_by<T>(line_of(want, double(x), double(y)), in, want);
            if (!met.is_clear) continue;
            ++clear;
            const float* got = picture.at<float>(x, y, 0);
            ASSERT_EQ(got[3], std::isfinite(met.t) ? 1 : 0) << x << ' ' << y;
            const std::array<double, 3> color =
                got[3] > 0 ? color_of_label(want, met.label) : std::array<double, 3>{};
            for (std::size_t c = 0; c < 3; ++c)
                ASSERT_EQ(got[c], static_cast<float>(color[c])) << x << ' ' << y;
            hits += got[3] > 0;
        }
    EXPECT_GT(hits, kPicture.x * kPicture.y / 5);
    EXPECT_GT(clear, kPicture.x * kPicture.y * 99 / 100);
}

TEST(LabelCast, ShowsTheNearestVoxelOfEachRay) {
    const Vec3 uneven(0.8, 1.3, 1);
    const Data bytes = labels_of<std::uint8_t>(Type::u8, {1, 2, 199});
    const Data below = labels_of<std::int16_t>(Type::i16, {-200, -1, 7});
    const Data halves = labels_of<std::int8_t>(Type::i8, {-100, 1, 90}, {-0.5, 0});
    const Data floats =
        labels_of<float>(Type::f32, {-3, 12, std::numeric_limits<float>::quiet_NaN(), HUGE_VALF});
    for (const bool eye : {false, true})
        for (const Vec3& spacing : {Vec3(1, 1, 1), uneven}) {
            expect_nearest_voxels<std::uint8_t>(bytes, request_for(bytes, eye, spacing));
            expect_nearest_voxels<std::int16_t>(below, request_for(below, eye, spacing));
            expect_nearest_voxels<std::int8_t>(halves, request_for(halves, eye, spacing));
            expect_nearest_voxels<float>(floats, request_for(floats, eye, spacing));
        }
}

TEST(LabelCast, LightsByTheLabelsCoverageAsTheReferenceDoes) {
    const Data in = labels_of<std::uint8_t>(Type::u8, {1, 2, 199});
    for (const bool eye : {false, true})
        for (const bool cued : {false, true}) {
            Request want = request_for(in, eye, {0.8, 1.3, 1});
            want.shading.by = Shade::phong;
            want.shading.lights = {{Vec3(0, 0, -1), 0.6}, {Vec3(0.6, 0.48, -0.64), 0.5}};
            want.unit = 1.5;
            if (cued) want.cue = DepthCue{0.02, false};
            const Data picture = cast(in, want);
            const ReferenceField field(in, Field::nearest);
            const Reference reference(want, field, std::pmr::new_delete_resource());
            const Eigen::Matrix3d to_screen =
                Vec3(want.pixel[0], want.pixel[1], 1).cwiseInverse().asDiagonal() *
                want.views.at(0).matrix().topLeftCorner<3, 3>().inverse().transpose();
            int hits = 0, same = 0;
            for (std::int64_t y = 0; y < kPicture.y; y += 5)
                for (std::int64_t x = 0; x < kPicture.x; x += 4) {
                    const Line line = line_of(want, double(x), double(y));
                    const Met met = met_by<std::uint8_t>(line, in, want);
                    const float* got = picture.at<float>(x, y, 0);
                    if (!met.is_clear || !std::isfinite(met.t)) continue;
                    const Vec3 p = line.origin + met.t * line.along;
                    const Lit lit = want.shading.at(
                        to_screen * change_of_coverage<std::uint8_t>(in, met.label, p),
                        line.to_eye);
                    const Vec3 seen = want.views.at(0).matrix().topLeftCorner<3, 3>() * p +
                                      want.views.at(0).matrix().topRightCorner<3, 1>();
                    const double left =
                        cued ? want.cue->left((seen.z() - nearest_corner(want, 0)) * want.unit) : 1;
                    // Differences over 2e-4 are off by 1e-8, and change by a thirtieth a sample.
                    for (std::size_t c = 0; c < 3; ++c)
                        ASSERT_NEAR(
                            got[c],
                            (color_of_label(want, met.label)[c] * lit.diffuse + lit.specular) *
                                left,
                            1e-5)
                            << x << ' ' << y;
                    const OutputSample at{0, x, y, 0};
                    const auto expected = reference.values(std::span(&at, 1));
                    // Corners that are thinner than an eighth of a sample it may miss.
                    bool is_same = true;
                    for (std::size_t c = 0; c < 4; ++c)
                        is_same = is_same && std::abs(got[c] - expected[c]) < 1e-6;
                    same += is_same;
                    ++hits;
                }
            EXPECT_GT(hits, 30);
            EXPECT_GE(same, hits * 9 / 10);
        }
}

TEST(LabelCast, ACutIsClosedAndFacesTheEye) {
    Data in = labels_of<std::uint8_t>(Type::u8, {1});
    std::fill_n(in.as<std::uint8_t>(), in.what.extent.samples(), std::uint8_t{3});
    Request want = request_for(in, false);
    want.shading.by = Shade::phong;
    const Lit facing = want.shading.at({0, 0, -1}, {0, 0, -1});
    const Data whole = cast(in, want);
    // Half of the volume, behind a plane across the view.
    const Eigen::Matrix3d turn = want.views.at(0).matrix().topLeftCorner<3, 3>();
    HalfSpace behind;
    behind.normal = Vec3(turn.row(2).transpose()).normalized();
    behind.offset = -behind.normal.dot(Vec3(5, 4, 6));
    want.clips = {clip_of(in.what.extent, std::span(&behind, 1))};
    const Data half = cast(in, want);
    const ReferenceField field(in, Field::nearest);
    const Reference reference(want, field, std::pmr::new_delete_resource());
    int faces = 0;
    for (std::int64_t y = 0; y < kPicture.y; ++y)
        for (std::int64_t x = 0; x < kPicture.x; ++x) {
            const float* got = half.at<float>(x, y, 0);
            EXPECT_LE(got[3], whole.at<float>(x, y, 0)[3]);
            faces += std::abs(double(got[0]) - (color_of_label(want, 3)[0] * facing.diffuse +
                                                facing.specular)) < 1e-6;
            const OutputSample at{0, x, y, 0};
            const auto expected = reference.values(std::span(&at, 1));
            if (!std::isfinite(expected[0])) continue;
            for (std::size_t c = 0; c < 4; ++c) ASSERT_NEAR(got[c], expected[c], 1e-6);
        }
    EXPECT_GT(faces, 300);
}

TEST(LabelCast, BoxesAndThreadsGiveTheBytesOfTheWhole) {
    const Data in = labels_of<std::uint16_t>(Type::u16, {1, 2, 65535});
    Request want = request_for(in, true);
    want.shading.by = Shade::phong;
    const Data whole = cast(in, want);
    for (const int threads : {1, 2, 7}) {
        const oneapi::tbb::global_control limit(
            oneapi::tbb::global_control::max_allowed_parallelism,
            static_cast<std::size_t>(threads));
        const Region box{{5, 11, 0}, {39, 40, 1}};
        const Data part = cast(in, want, box);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            EXPECT_EQ(
                std::memcmp(part.at<float>(box.begin[0], y, 0), whole.at<float>(box.begin[0], y, 0),
                            sizeof(float) * 4 * static_cast<std::size_t>(box.extent().x)),
                0);
    }
}

TEST(LabelCast, RefusesWhatIsNoPictureOfLabels) {
    const Data in = labels_of<std::uint8_t>(Type::u8, {1});
    const auto refused = [&](const Request& want, Representation what) {
        const Scene scene;
        return label_cast().offer(what, {want, scene}, {}).refused;
    };
    const Request want = request_for(in, false);
    EXPECT_EQ(refused(want, in.what), "");
    Request other = want;
    other.surface = SurfaceOf{0.5};
    EXPECT_EQ(refused(other, in.what), "no surfaces of labels are asked for");
    other.surface = {};
    EXPECT_EQ(refused(other, in.what), "no surfaces of labels are asked for");
    other = want;
    other.mode = Mode::mip;
    EXPECT_EQ(refused(other, in.what), "no surfaces of labels are asked for");
    Representation wide = in.what;
    wide.type = Type::u32;
    EXPECT_EQ(refused(want, wide), "u32 samples are converted first");
    wide = in.what;
    wide.channels = 3;
    EXPECT_EQ(refused(want, wide), "3 channels; rays combine one");
}

}  // namespace
}  // namespace edgewise::label_cast_test
