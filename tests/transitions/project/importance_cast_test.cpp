#include "transitions/project/importance_cast.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/importance_cast.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;

Parameters with_loss(double loss, double step = 1, const char* filter = "foh") {
    return {{"filter", filter}, {"step", step}, {"loss", loss}};
}
Parameters equal(double step = 1, const char* filter = "foh") {
    return {{"filter", filter}, {"step", step}};
}

/// @param opacity  of a value of 1, a unit of length
Request composite(const Extent& input, const Extent& screen, const Matrix3d& by, double opacity,
                  const Vec3& spacing = Vec3::Ones(), double zoom = 1) {
    Request want = seen(Mode::composite, input, screen, by, spacing, zoom);
    want.transfer.points = {{0, 0, {0.1, 0.2, 0.3}}, {1, opacity, {1, 0.5, 0}}};
    return want;
}

Request with_eye(Request want, double distance) {
    Eye eye;
    eye.plane = double(want.screen.z - 1) / 2;
    eye.at =
        Vec3(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2, eye.plane - distance);
    want.eye = eye;
    return want;
}

/// What a ray has of the trilinear field in f64, by so many samples a unit.
struct Fine {
    std::array<double, 4> light{};  // and opacity
    double length = 0;

    Fine(const Data& in, const Request& want, double px, double py) {
        constexpr double kPieces = 32;
        const Mat4 back = want.views.at(0).matrix().inverse();
        Vec3 at(px, py, 0), along(0, 0, 1);
        if (want.eye) {
            at = want.eye->at;
            along = (Vec3(px, py, want.eye->plane) - at).normalized();
        }
        const Vec3 origin = back.topLeftCorner<3, 3>() * at + back.topRightCorner<3, 1>();
        const Vec3 direction = back.topLeftCorner<3, 3>() * along;
        double low = want.eye ? 0 : -1e300, high = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-0.5 - origin[axis]) / direction[axis];
            const double b = (double(want.input[axis]) - 0.5 - origin[axis]) / direction[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
        length = std::max(0.0, high - low);
        const auto count = static_cast<int>(std::ceil(length * kPieces));
        double left = 1;
        for (int i = 0; i < count; ++i) {
            const Vec3 p = origin + (low + (i + 0.5) / count * length) * direction;
            const std::array<double, 4> optics = want.transfer.at(trilinear(in, p));
            const double kept =
                std::pow(1 - optics[3], length / count * want.unit / want.transfer.unit);
            for (std::size_t c = 0; c < 3; ++c) light[c] += left * (1 - kept) * optics[c];
            left *= kept;
        }
        light[3] = 1 - left;
    }
};

/// A cast whose rays count their samples. Kept alive as long as it is used.
class Counting {
 public:
    Counting(const Data& in, const Request& want, double step)
        : optics_(optics_of(want, in.what.values)) {
        cast_.volume = kernels::grid_of(in);
        cast_.rule = Combine::over;
        cast_.rays = rays_of(in.what, want, 0, -0.5);
        cast_.step = step;
        cast_.unit = want.unit;
        cast_.optics = &optics_;
        cast_.bound = kTerminated;
        cast_.taken = &taken_;
        bricks_ =
            bricks_of(cast_.volume, {.optics = &optics_}, std::pmr::new_delete_resource(), nullptr);
    }
    Counting(const Counting&) = delete;
    Counting& operator=(const Counting&) = delete;

    std::int64_t samples(double loss, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, bool bricks) {
        taken_ = {};
        cast_.bricks = bricks ? bricks_.get() : nullptr;
        std::vector<float> out(static_cast<std::size_t>(width * height * 4));
        kernels::importance_cast(cast_, loss, x, y, width, height, out.data(), width * 4);
        return taken_.samples;
    }

 private:
    kernels::Optics optics_;
    std::shared_ptr<const kernels::Bricks> bricks_;
    kernels::Taken taken_;
    kernels::RayCast cast_;
};

double largest_difference(const Data& a, const Data& b) {
    double most = 0;
    for (std::int64_t i = 0; i < a.what.samples() * a.what.channels; ++i)
        most = std::max(most, std::abs(double(a.as<float>()[i]) - double(b.as<float>()[i])));
    return most;
}

bool same(const Data& a, const Data& b) {
    return std::memcmp(a.samples.data(), b.samples.data(),
                       static_cast<std::size_t>(a.what.bytes())) == 0;
}

const Extent kInput{37, 29, 41}, kScreen{61, 58, 70};

TEST(ImportanceCast, IsTheCasterWhereNothingMayBeLost) {
    const Data smooth = volume(kInput, wave);
    std::mt19937 bits(3);
    Data gaps = volume(kInput, [&](auto...) { return bits() % 3 ? 0.0 : double(bits() % 2); });
    for (int i = 0; i < 500; ++i)
        gaps.as<float>()[bits() % std::uint32_t(kInput.samples())] =
            i % 2 ? std::numeric_limits<float>::quiet_NaN()
                  : std::numeric_limits<float>::infinity();
    Scene scene;
    for (const Data* in : {&smooth, static_cast<const Data*>(&gaps)})
        for (const double degrees : {0.0, 37.0, 90.0, 160.0})
            for (const double distance : {0.0, 90.0})
                for (const double step : {0.4, 1.0, 1.7}) {
                    Request want =
                        composite(kInput, kScreen, turn(degrees, {3, -2, 1}), 0.4, {1, 1.2, 1.5});
                    if (distance > 0) want = with_eye(want, distance);
                    scene.non_finite = in == &gaps ? 500 : 0;
                    const Ask ask{want, scene};
                    EXPECT_TRUE(same(made(importance_cast(), *in, ask, with_loss(0, step)),
                                     made(ray_cast(), *in, ask, equal(step))))
                        << degrees << ' ' << distance << ' ' << step;
                }
}

TEST(ImportanceCast, OfNoDataIsMoreLostThanWasAllowed) {
    // Noise, and walls of one voxel behind what is faint, which long steps pass over.
    std::mt19937 bits(5);
    const Data noise = volume(kInput, [&](auto...) { return double(bits() % 1000) / 999; });
    const Data walls = volume(kInput, [](auto, auto, auto z) {
        return z < 14 ? 0.35 : z % 5 == 0 ? 1 : 0;
    });
    const Scene scene;
    double most = 0;
    for (const Data* in : {&noise, &walls})
        for (const double opacity : {0.1, 0.5, 0.98})
            for (const double degrees : {0.0, 35.0, 180.0})
                for (const double loss : {0.02, 0.0625, 0.25}) {
                    Request want = composite(kInput, kScreen, turn(degrees, {1, 2, 1}), opacity);
                    if (degrees == 35) want = with_eye(want, 80);
                    const Ask ask{want, scene};
                    const Data got = made(importance_cast(), *in, ask, with_loss(loss));
                    const double lost =
                        largest_difference(got, made(ray_cast(), *in, ask, equal()));
                    // f32 adds up some 80 samples of a light of at most 1.
                    ASSERT_LE(lost, loss + 80 * 0x1p-23) << opacity << ' ' << degrees;
                    most = std::max(most, lost / loss);
                }
    EXPECT_GT(most, 0.3);  // the bound is of this size
}

TEST(ImportanceCast, ErrsByLessThanStepsAndSlopesSay) {
    const Data in = volume(kInput, wave);
    const Scene scene;
    constexpr double kSlope = 0.215;  // of the wave along any direction, see looking.hpp
    for (const double opacity : {0.02, 0.3, 0.9})  // faint to opaque
        for (const double distance : {0.0, 90.0})
            for (const double loss : {0.01, 0.0625, 0.25}) {
                constexpr double kStep = 0.5;
                Request want = composite(kInput, kScreen, turn(37, {3, -2, 1}), opacity);
                if (distance > 0) want = with_eye(want, distance);
                const Data got = made(importance_cast(), in, {want, scene}, with_loss(loss, kStep));
                // A depth is -log(1 - opacity v): its slope is largest where v is 1, and so is it;
                // colours of 0 to 1 differ by at most 0.9 from v = 0 to 1.
                const double deepest = -std::log(1 - opacity);
                const double steep = kSlope * opacity / (1 - opacity);
                const double rate = steep / 4 + deepest * 0.9 * kSlope / 2;
                Counting counting(in, want, kStep);
                double squares = 0, allowed = 0;
                for (std::int64_t y = 5; y < kScreen.y; y += 7)
                    for (std::int64_t x = 5; x < kScreen.x; x += 7) {
                        const Fine exact(in, want, double(x), double(y));
                        const auto samples = double(counting.samples(loss, x, y, 1, 1, false));
                        const double bound =
                            rate * kStep * kStep * samples * std::max(1.0, 4 * loss);
                        for (int c = 0; c < 4; ++c) {
                            const double error =
                                double(got.at<float>(x, y, 0)[c]) - exact.light[std::size_t(c)];
                            ASSERT_LE(std::abs(error), bound + kTerminated + 1e-5)
                                << x << ' ' << y << ' ' << opacity << ' ' << loss;
                            squares += error * error;
                            allowed += std::pow(bound + kTerminated, 2);
                        }
                    }
                EXPECT_LT(squares, 0.05 * allowed);  // errors of pieces have both signs
            }
}

TEST(ImportanceCast, TakesAsManySamplesAsTransparencyTells) {
    // Of an even medium with depth s a unit T = exp(-s t) is known, and with it every piece.
    const Extent n{9, 9, 300}, screen{9, 9, 300};
    const Data in = volume(n, [](auto...) { return 1; });
    for (const double opacity : {0.02, 0.08})
        for (const double loss : {0.0, 0.02, 0.0625, 0.25}) {
            const Request want = composite(n, screen, Matrix3d::Identity(), opacity);
            int pieces = 0;
            double left = 1, before = 1;  // now, and before the last sample
            for (int cell = 0; cell < 300 && left > 0; ++pieces) {
                int pace = std::max(1, static_cast<int>(std::sqrt(4 * loss / before)));
                pace = cell == 0 ? 1 : std::max(1, std::min(pace, 299 - cell));
                before = left;
                left *= std::pow(1 - opacity, pace);
                if (left < kTerminated) left = 0;
                cell += pace;
            }
            Counting counting(in, want, 1);
            // A pace changes where a root is whole, which f32 knows to a few parts in 2^24.
            EXPECT_NEAR(double(counting.samples(loss, 4, 4, 1, 1, false)), pieces, 1)
                << opacity << ' ' << loss;
            EXPECT_EQ(counting.samples(loss, 4, 4, 1, 1, true),
                      counting.samples(loss, 4, 4, 1, 1, false));
        }
}

/// The bundled head, or nothing.
std::optional<Data> head() {
    const char* folder = std::getenv("EDGEWISE_DATA");
    if (!folder) return {};
    Representation what;
    what.type = Type::i16;
    what.extent = {64, 64, 93};
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (int slice = 1; slice <= 93; ++slice) {
        std::ifstream file(std::string(folder) + "/ct_head/quarter." + std::to_string(slice),
                           std::ios::binary);
        file.read(reinterpret_cast<char*>(data.at<std::int16_t>(0, 0, slice - 1)), 64 * 64 * 2);
        if (!file) return {};
    }
    return data;
}

TEST(ImportanceCast, TakesFewerSamplesOfAnOpaqueHead) {
    const std::optional<Data> in = head();
    if (!in) GTEST_SKIP() << "EDGEWISE_DATA is not set";
    // Soft tissue takes a tenth of the light on 1.5 mm.
    Request want = seen(Mode::composite, in->what.extent, {150, 150, 200},
                        turn(80, {1, 0, 0}) * turn(25, {0, 0, 1}), Vec3(3.2, 3.2, 1.5) / 1.5);
    want.transfer.points = {{300, 0, {0.8, 0.5, 0.4}}, {1200, 0.15, {0.9, 0.6, 0.5}}};
    const Scene scene;
    const Ask ask{want, scene};
    for (const double step : {1.0, 0.25}) {
        Counting counting(*in, want, step);
        const auto samples = [&](double loss) {
            return double(counting.samples(loss, 0, 0, 150, 150, true));
        };
        const double all = samples(0);
        EXPECT_GT(all, 5e5);
        EXPECT_GT(all / samples(1.0 / 16), 1.3);
        EXPECT_GT(all / samples(0.25), 1.5);
        const Data equally = made(ray_cast(), *in, ask, equal(step));
        for (const double loss : {1.0 / 16, 0.25})
            EXPECT_LE(largest_difference(made(importance_cast(), *in, ask, with_loss(loss, step)),
                                         equally),
                      loss);
    }
}

TEST(ImportanceCast, SameBytesForAnyThreadsAndAnyRegion) {
    std::mt19937 bits(11);
    const Data in = volume(kInput, [&](auto x, auto y, auto z) {
        return z > 12 && (x + y) % 9 > 3 ? double(bits() % 8) / 7 : 0.0;
    });
    for (const double distance : {0.0, 70.0})
        for (const char* filter : {"foh", "bspline3"}) {
            Request want =
                composite(kInput, {101, 77, 70}, turn(37, {3, -2, 1}), 0.4, Vec3(1, 1.3, 1.1), 1.4);
            if (distance > 0) want = with_eye(want, distance);
            Data read = Data::sharing(in, in.what);
            // Coefficients are any numbers.
            if (filter == std::string("bspline3")) read.what.content = "coefficients";
            const Scene scene;
            const Ask ask{want, scene};
            const Parameters by = with_loss(0.1, 0.6, filter);
            const auto with = [&](std::size_t threads) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                return made(importance_cast(), read, ask, by);
            };
            const Data one = with(1);
            for (const std::size_t threads : {2u, 7u}) EXPECT_TRUE(same(with(threads), one));
            for (const Region& box :
                 {Region{{13, 21, 0}, {90, 70, 1}}, Region{{50, 33, 0}, {51, 34, 1}}}) {
                const Data part = made(importance_cast(), read, ask, box, by);
                for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                    ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                             one.at<float>(box.begin[0], y, 0),
                                             std::size_t(box.extent().x) * 4 * sizeof(float)))
                        << y << ' ' << distance << ' ' << filter;
            }
        }
}

TEST(ImportanceCast, TakesOddShapesTypesClipsAndNothing) {
    const Scene scene;
    for (const Extent& n : {Extent{1, 1, 1}, Extent{1, 1, 70}, Extent{50, 40, 1}, Extent{2, 3, 2}})
        for (const double degrees : {0.0, 70.0})
            for (const double step : {0.3, 4.0}) {
                const Data in = volume(n, [](auto...) { return 1; });
                Request want = composite(n, {60, 50, 70}, turn(degrees, {1, 1, 0}), 0.3);
                // So that no ray lies in a face.
                Mat4 map = want.views.at(0).matrix();
                map(0, 3) += 0.25;
                map(1, 3) += 0.25;
                want.views = Placement(map);
                const Ask ask{want, scene};
                const Data got = made(importance_cast(), in, ask, with_loss(0.05, step));
                for (std::int64_t y = 0; y < 50; ++y)
                    for (std::int64_t x = 0; x < 60; ++x) {
                        // Of an even medium no piece is wrong, and bright is what is opaque.
                        const Fine exact(in, want, double(x), double(y));
                        ASSERT_NEAR(got.at<float>(x, y, 0)[3], exact.light[3],
                                    exact.length > 0 ? kTerminated + 2e-5 : 0)
                            << x << ' ' << y << ' ' << degrees << ' ' << step;
                        ASSERT_NEAR(got.at<float>(x, y, 0)[0], got.at<float>(x, y, 0)[3],
                                    kTerminated + 1e-5);
                    }
            }
    // Spacings so far apart that levels of bricks tell of less than one step.
    const Extent n{12, 11, 90};
    const Data in = volume(n, [](auto x, auto, auto) { return x % 5 == 0; });
    Request want = composite(n, {60, 50, 60}, turn(20, {1, 1, 0}), 0.6, Vec3(4, 4, 0.5));
    Request zoomed = want;
    Mat4 map = want.views.at(0).matrix();
    map.row(2) *= 0.1;
    zoomed.views = Placement(map);
    for (const Request& of : {want, zoomed}) {
        const Ask ask{of, scene};
        const Data got = made(importance_cast(), in, ask, with_loss(0.1, 3));
        EXPECT_LE(largest_difference(got, made(ray_cast(), in, ask, equal(3))), 0.1 + 1e-5);
    }
    want.transfer.points = {{0, 0, {}}, {1, 0, {}}};
    const Data nothing = made(importance_cast(), in, {want, scene}, with_loss(0.1));
    EXPECT_EQ(largest_difference(nothing, made(ray_cast(), in, {want, scene}, equal())), 0);
    // Narrow samples, whose numbers stand for others; a part of the volume.
    Representation what;
    what.extent = kInput;
    what.type = Type::u8;
    what.values = {.slope = -1.0 / 255, .offset = 1};
    Data narrow = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < kInput.samples(); ++i)
        narrow.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(i * 7919 % 251);
    Request clipped = composite(kInput, kScreen, turn(30, {1, 2, 0}), 0.3);
    const std::vector<HalfSpace> planes = {{Vec3(0.8, 0.6, 0), -9}};
    const std::vector<Ball> balls = {{Vec3(18, 14, 20), Matrix3d::Identity() / 17}};
    clipped.clips = {clip_of(kInput, planes, balls)};
    const Ask ask{clipped, scene};
    EXPECT_TRUE(same(made(importance_cast(), narrow, ask, with_loss(0, 0.5)),
                     made(ray_cast(), narrow, ask, equal(0.5))));
    EXPECT_LE(largest_difference(made(importance_cast(), narrow, ask, with_loss(0.05, 0.5)),
                                 made(ray_cast(), narrow, ask, equal(0.5))),
              0.05 + 1e-5);
}

TEST(ImportanceCast, RefusesWhatItCannotDo) {
    const Scene scene;
    Representation what;
    what.extent = kInput;
    const auto refused = [&](const Request& want) {
        return importance_cast().offer(what, {want, scene}, with_loss(0.05)).refused;
    };
    const Request plain = composite(kInput, kScreen, turn(20, {1, 2, 0}), 0.3);
    EXPECT_EQ(refused(plain), "");
    for (const Mode mode : {Mode::mip, Mode::xray}) {
        Request other = plain;
        other.mode = mode;
        EXPECT_NE(refused(other).find("nothing hides"), std::string::npos);
    }
    Request lit = plain;
    lit.shading.by = Shade::phong;
    EXPECT_NE(refused(lit).find("light"), std::string::npos);
    Request cue = plain;
    cue.cue = DepthCue{};
    EXPECT_NE(refused(cue).find("falls off"), std::string::npos);
    Request edges = plain;
    edges.transfer.edges = {{0, 0}, {1, 1}};
    EXPECT_NE(refused(edges).find("gradients"), std::string::npos);
    Request warp = plain;
    warp.job = Job::warp;
    EXPECT_NE(refused(warp), "");
    const Offer offer = importance_cast().offer(what, {plain, scene}, with_loss(0.05));
    EXPECT_GT(importance_cast().work(offer, {plain, scene}, 0).operations, 1e5);
}

}  // namespace
}  // namespace edgewise
