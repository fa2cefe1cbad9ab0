#include "reference/answer.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <tbb/global_control.h>

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

/// A picture of a cubic volume, turned about its centre, pixels and units one sample wide.
Request picture_of(std::int64_t side, double angle, Mode mode) {
    Request want;
    want.job = Job::render;
    want.input = {side, side, side};
    const std::int64_t wide = 2 * side;
    want.screen = {wide, wide, wide};
    const Vec3 centre = Vec3::Constant(0.5 * static_cast<double>(side - 1));
    const Eigen::Affine3d view =
        Eigen::Translation3d(Vec3::Constant(0.5 * static_cast<double>(wide - 1))) *
        Eigen::AngleAxisd(angle, Vec3(1, 2, 0.5).normalized()) * Eigen::Translation3d(-centre);
    want.views = view.matrix();
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.transfer.points = {{0, 0, {0, 0, 0}}, {1, 0.3, {1, 0.5, 0.25}}};
    return want;
}

Data constant(std::int64_t side, float value) {
    Representation what;
    what.extent = {side, side, side};
    Data data = Data::make(what, heap());
    std::fill_n(data.as<float>(), what.samples(), value);
    return data;
}

TEST(Reference, IntegratesThePhantomSphere) {
    const std::int64_t side = 64;
    const Phantom phantom = phantom_named("sphere", side);
    const Data data = make_phantom("sphere", side, heap());
    const ReferenceField field(data, Field::formula, &phantom);
    const double radius = 16, middle = 63.5;
    std::vector<OutputSample> samples;
    for (std::int64_t x = 50; x < 78; ++x) samples.push_back({0, x, 60, 0});
    const Request mip = picture_of(side, 0.7, Mode::mip), sum = picture_of(side, 0.7, Mode::xray);
    const auto peaks = Reference(mip, field, heap()).values(samples);
    const auto sums = Reference(sum, field, heap()).values(samples);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double d = std::hypot(static_cast<double>(samples[i].x) - middle, 60 - middle);
        const double half = std::sqrt(std::max(0.0, radius * radius - d * d));
        // The integral of 1 - sqrt(d^2 + t^2) / R over the chord.
        const double integral = half > 0 ? half - d * d / radius * std::asinh(half / d) : 0;
        EXPECT_NEAR(peaks[i], std::max(0.0, 1 - d / radius), 2e-4);  // t off by at most 1/16
        EXPECT_NEAR(sums[i], integral, 5e-4);  // midpoint rule at a kink: h^2 / 8 over R
    }
}

TEST(Reference, KeepsHomogeneousMatterWhateverTheGeometry) {
    const Data data = constant(20, 0.5F);
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        Request want = picture_of(20, 0.4, Mode::composite);
        want.unit = 0.8;
        want.spacing = Vec3::Constant(0.8);
        want.transfer.unit = 1.6;
        want.zero = 0.25;
        const OutputSample at{0, 17, 22, 0};
        const double length = [&] {
            const RaySpan ray = *ViewGeometry(want).ray(at);
            return (ray.high - ray.low) * 0.8;
        }();
        const double opacity = 1 - std::pow(1 - 0.15, length / 1.6);  // EQ 53
        const auto light = Reference(want, field, heap()).values(std::span(&at, 1));
        ASSERT_EQ(light.size(), 4u);
        EXPECT_NEAR(light[0], opacity * 0.5, 1e-9);
        EXPECT_NEAR(light[2], opacity * 0.125, 1e-9);
        EXPECT_NEAR(light[3], opacity, 1e-9);
        want.mode = Mode::xray;
        EXPECT_NEAR(Reference(want, field, heap()).values(std::span(&at, 1))[0], 0.25 * length,
                    1e-9);
        want.mode = Mode::mean;
        EXPECT_NEAR(Reference(want, field, heap()).values(std::span(&at, 1))[0], 0.5, 1e-9);
    }
}

TEST(Reference, MeasuresPerspectiveRaysInUnits) {
    const Data data = constant(20, 1);
    const ReferenceField field(data, Field::linear);
    Request want = picture_of(20, 0, Mode::xray);
    // Pixels half a sample wide; the eye on the axis, 30 units before the volume's front face.
    Mat4 finer = Mat4::Identity();
    finer(0, 0) = finer(1, 1) = 2;
    want.views = Mat4(finer * want.views.at(0).matrix());
    const Vec3 middle = (want.views.at(0).matrix() * Vec3(9.5, 9.5, 9.5).homogeneous()).head<3>();
    want.eye = Eye{.at = middle - Vec3(0, 0, 40), .plane = middle.z(), .width = 0.5, .height = 0.5};
    for (double off : {0.0, 6.0}) {
        const std::optional<RaySpan> ray =
            ViewGeometry(want).ray(0, middle.x() + 2 * off, middle.y());
        ASSERT_TRUE(ray);
        // The pixel is `off` samples beside the axis at a distance of 40.
        const double stretch = std::hypot(40.0, off) / 40;
        EXPECT_NEAR(ray->low, 30 * stretch, 1e-9);
        EXPECT_NEAR(ray->high, 50 * stretch, 1e-9);
    }
}

/// A perspective view of a volume under any affine map: wide pixels, a squeezed object, shears.
/// Positions are in units of length of the scene; what is asked of the reference is made of them,
/// what is expected is worked out in the scene itself.
struct Scene {
    Eigen::Matrix3d edges;    // of a voxel, as columns
    Vec3 centre, eye;         // of the volume; the eye looks along z
    double wide, high, deep;  // pixel and unit
    Request want;

    Scene(const Extent& n, std::mt19937& bits) {
        const auto random = [&](double low, double up) {
            return std::uniform_real_distribution(low, up)(bits);
        };
        do
            for (int i = 0; i < 9; ++i) edges.data()[i] = random(-2, 2);
        while (std::abs(edges.determinant()) < 0.5);
        centre = Vec3(random(-5, 5), random(-5, 5), random(-5, 5));
        eye = Vec3(random(-20, 20), random(-20, 20), -60);
        wide = random(0.3, 2), high = random(0.3, 2), deep = random(0.3, 2);
        const Vec3 middle(0.5 * double(n.x - 1), 0.5 * double(n.y - 1), 0.5 * double(n.z - 1));
        Mat4 view = Mat4::Identity();
        const Eigen::Matrix3d per = Vec3(1 / wide, 1 / high, 1 / deep).asDiagonal().toDenseMatrix();
        view.topLeftCorner<3, 3>() = per * edges;
        view.topRightCorner<3, 1>() = per * (centre - edges * middle);
        want.job = Job::render;
        want.mode = Mode::xray;
        want.input = n;
        want.screen = {64, 64, 64};
        want.unit = deep;
        want.spacing = Vec3(random(0.5, 2), random(0.5, 2), random(0.5, 2));
        want.views = view;
        want.eye = Eye{.at = per * eye,
                       .plane = random(-40, 40) / deep,
                       .width = wide / deep,
                       .height = high / deep};
    }

    /// The pixel that shows a place.
    std::array<double, 2> pixel_of(const Vec3& place) const {
        const double far = (want.eye->plane * deep - eye.z()) / (place.z() - eye.z());
        const Vec3 shown = eye + far * (place - eye);
        return {shown.x() / wide, shown.y() / high};
    }
};

TEST(Reference, LengthsOfPerspectiveRaysAreThoseOfTheSceneWhateverTheMatrix) {
    std::mt19937 bits(7);
    const Extent n{7, 5, 9};
    for (int trial = 0; trial < 40; ++trial) {
        const Scene scene(n, bits);
        std::uniform_real_distribution<double> aside(-3, 3);
        const Vec3 through = scene.centre + Vec3(aside(bits), aside(bits), aside(bits));
        const Vec3 along = (through - scene.eye).normalized();
        // Three pairs of parallel faces: what is left of the line between each is the chord.
        double enters = 0, leaves = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 normal =
                scene.edges.col((axis + 1) % 3).cross(scene.edges.col((axis + 2) % 3)).normalized();
            const double half = std::abs(normal.dot(scene.edges.col(axis))) * double(n[axis]) / 2;
            const double to = normal.dot(scene.centre - scene.eye), by = normal.dot(along);
            enters = std::max(enters, std::min((to - half) / by, (to + half) / by));
            leaves = std::min(leaves, std::max((to - half) / by, (to + half) / by));
        }
        const auto [x, y] = scene.pixel_of(through);
        const std::optional<RaySpan> ray = ViewGeometry(scene.want).ray(0, x, y);
        ASSERT_EQ(ray.has_value(), enters < leaves) << trial;
        if (!ray) continue;
        EXPECT_NEAR(ray->low * scene.deep, enters, 1e-9) << trial;
        EXPECT_NEAR(ray->high * scene.deep, leaves, 1e-9) << trial;
    }
}

TEST(Reference, IntegratesASqueezedBallFromAnyEye) {
    std::mt19937 bits(8);
    const std::int64_t side = 48;
    const double radius = 12;  // of the phantom [sample]
    const Phantom phantom = phantom_named("sphere", side);
    const Data data = make_phantom("sphere", side, heap());
    const ReferenceField field(data, Field::formula, &phantom);
    for (int trial = 0; trial < 20; ++trial) {
        Scene scene({side, side, side}, bits);
        scene.want.eye->plane = scene.centre.z() / scene.deep;
        // The ray of a pixel, which is near the middle of the ball but for its fraction.
        const auto [x, y] = scene.pixel_of(scene.centre + Vec3(0.7, -1.1, 0.4));
        const OutputSample at{0, std::int64_t(std::floor(x)), std::int64_t(std::floor(y)), 0};
        const Vec3 seen(double(at.x) * scene.wide, double(at.y) * scene.high,
                        scene.want.eye->plane * scene.deep);
        // Samples from the middle of the ball, along the ray: |p + s q|, s a length of the scene.
        const Eigen::Matrix3d to_samples = scene.edges.inverse();
        const Vec3 p = to_samples * (scene.eye - scene.centre);
        const Vec3 q = to_samples * (seen - scene.eye).normalized();
        const double nearest = p.cross(q).norm() / q.norm();
        const double half = std::sqrt(std::max(0.0, radius * radius - nearest * nearest));
        const double integral =
            half > 0 ? (half - nearest * nearest / radius * std::asinh(half / nearest)) / q.norm()
                     : 0;
        const double got = Reference(scene.want, field, heap()).values(std::span(&at, 1))[0];
        // Cells of h = deep / 8; the kinks in the middle and at the ends cost h^2 |q| / (8 R) each.
        const double cell = scene.deep / 8;
        EXPECT_NEAR(got, integral, 1e-9 + cell * cell * q.norm() / radius) << trial;
    }
}

TEST(Reference, TilesDoNotShow) {
    // 70 samples are two tiles along every axis; stretches are joined by "over".
    const Data data = make_phantom("marschner-lobb", 70, heap());
    const ReferenceField field(data, Field::spline);
    for (Mode mode : modes()) {
        const Request want = picture_of(70, 0.9, mode);
        const Reference reference(want, field, heap());
        const OutputSample at{0, 68, 74, 0};
        const auto got = reference.values(std::span(&at, 1));
        const RaySpan ray = *reference.geometry().ray(at);
        Stretch whole = Stretch::empty(mode);
        EXPECT_EQ(ray.step, mode->sampled_every > 0 ? mode->sampled_every : 0.125);
        const double first = std::floor((ray.low - ray.front) / ray.step);
        for (double k = first; ray.front + k * ray.step < ray.high; ++k) {
            const double begin = ray.front + k * ray.step;
            const double low = std::max(ray.low, begin),
                         high = std::min(ray.high, begin + ray.step);
            double value = 0;
            ASSERT_TRUE(field.at(ray.origin + (low + high) / 2 * ray.direction, {&value, 1}));
            whole.add(value, high - low, want);
        }
        std::array<double, 4> expected{};
        whole.result(want, expected.data());
        for (std::size_t c = 0; c < got.size(); ++c) EXPECT_NEAR(got[c], expected[c], 1e-11);
    }
}

/// Rounding may let a ray along an axis begin a little before the face, where no sample is.
TEST(Reference, TakesAsManySamplesAsThereAreUnits) {
    constexpr std::int64_t kSide = 12;
    const Data data = constant(kSide, 1);
    const ReferenceField field(data, Field::linear);
    Data ends = constant(kSide, 0);  // 1 in the last plane along z, which is met once
    std::fill_n(ends.as<float>() + (kSide - 1) * kSide * kSide, kSide * kSide, 1.0F);
    const ReferenceField last(ends, Field::linear);
    for (int turn = 0; turn < 40; ++turn) {
        Request want = picture_of(kSide, 0, mode_named("top2"));
        want.screen = {20, 20, kSide};
        const Vec3 centre = Vec3::Constant(0.5 * (kSide - 1));
        const Eigen::Affine3d view = Eigen::Translation3d(9.5, 9.5, centre.z()) *
                                     Eigen::AngleAxisd(0.05 * turn, Vec3::UnitZ()) *
                                     Eigen::AngleAxisd(std::acos(-1) * (turn % 2), Vec3::UnitX()) *
                                     Eigen::Translation3d(-centre);
        want.views = view.matrix();
        const OutputSample at{0, 7 + turn % 5, 6 + turn % 7, 0};
        EXPECT_NEAR(Reference(want, field, heap()).values(std::span(&at, 1))[0], 2, 1e-12);
        EXPECT_NEAR(Reference(want, last, heap()).values(std::span(&at, 1))[0], 1, 1e-12) << turn;
    }
}

TEST(Reference, WarpsTheSameAloneAndInTiles) {
    const Data data = make_phantom("noise", 60, heap());
    Request want = picture_of(60, 0.6, Mode::mip);
    want.job = Job::warp;
    want.screen = {120, 120, 120};
    for (Field kind : {Field::spline, Field::linear, Field::nearest}) {
        const ReferenceField field(data, kind);
        const Reference reference(want, field, heap());
        std::vector<OutputSample> many;
        std::mt19937 bits(2);
        std::uniform_int_distribution<std::int64_t> index(0, 119);
        for (int i = 0; i < 1500; ++i) many.push_back({0, index(bits), index(bits), index(bits)});
        const auto together = reference.values(many);
        for (std::size_t i = 0; i < 40; ++i) {
            const double alone = reference.values(std::span(&many[i], 1))[0];
            EXPECT_EQ(std::isnan(alone), !reference.sees_input(many[i]));
            if (std::isnan(alone))
                EXPECT_TRUE(std::isnan(together[i]));
            else
                EXPECT_NEAR(together[i], alone, 1e-12);
        }
    }
}

TEST(Reference, GivesTheSameBytesForAnyNumberOfThreads) {
    const Data data = make_phantom("gaussians", 64, heap());
    const ReferenceField field(data, Field::spline);
    const Request want = picture_of(64, 0.3, Mode::composite);
    std::vector<OutputSample> samples;
    for (std::int64_t i = 0; i < 400; ++i) samples.push_back({0, 30 + i % 64, 40 + i / 8, 0});
    const auto run = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return Reference(want, field, heap()).values(samples);
    };
    const auto one = run(1);
    EXPECT_EQ(one, run(2));
    EXPECT_EQ(one, run(7));
}

TEST(ViewGeometry, FollowsAHomography) {
    Request want;
    want.job = Job::warp;
    want.axes = 2;
    want.input = want.screen = {100, 80, 1};
    Mat4 map = Mat4::Identity();
    map(0, 1) = 0.2;
    map(1, 3) = 4;
    map(3, 0) = 1e-3;
    want.views = map;
    const ViewGeometry geometry(want);
    const std::optional<Vec3> p = geometry.point({0, 30, 20, 0});
    ASSERT_TRUE(p);
    const Eigen::Vector4d screen = map * p->homogeneous();
    EXPECT_NEAR(screen.x() / screen.w(), 30, 1e-10);
    EXPECT_NEAR(screen.y() / screen.w(), 20, 1e-10);
}

}  // namespace
}  // namespace edgewise
