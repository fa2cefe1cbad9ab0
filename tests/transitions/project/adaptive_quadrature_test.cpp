#include "transitions/project/adaptive_quadrature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/adaptive_quadrature.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/importance_cast.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;

Parameters within(double tolerance, double least = 1e-6) {
    return {{"tolerance", tolerance}, {"least", least}};
}

Request quadrature_request(const Extent& input, const Extent& screen, const Matrix3d& by,
                           std::vector<Transfer::Point> points, const Vec3& spacing = Vec3::Ones(),
                           double zoom = 1) {
    Request want = seen(Mode::composite, input, screen, by, spacing, zoom);
    want.transfer.points = std::move(points);
    return want;
}

Request quadrature_eye(Request want, double distance) {
    Eye eye;
    eye.plane = double(want.screen.z - 1) / 2;
    eye.at =
        Vec3(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2, eye.plane - distance);
    want.eye = eye;
    return want;
}

using Channels = std::array<double, 4>;

/// The ray of a pixel in f64, in index space.
struct RayLine {
    Vec3 origin, along;
    double low = -1e300, high = 1e300;

    RayLine(const Request& want, double px, double py) {
        const Mat4 back = want.views.at(0).matrix().inverse();
        Vec3 at(px, py, 0), way(0, 0, 1);
        if (want.eye) {
            at = want.eye->at;
            way = (Vec3(px, py, want.eye->plane) - at).normalized();
            low = 0;
        }
        origin = back.topLeftCorner<3, 3>() * at + back.topRightCorner<3, 1>();
        along = back.topLeftCorner<3, 3>() * way;
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-0.5 - origin[axis]) / along[axis];
            const double b = (double(want.input[axis]) - 0.5 - origin[axis]) / along[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
    }
    double length() const { return std::max(0.0, high - low); }
};

/// Beside samples that are not finite: none where the nearest one is not, else that of the others.
double beside_gap(const Data& in, const Vec3& at) {
    double sum = 0, share = 0, largest = -1, nearest = 0;
    std::array<std::int64_t, 3> cell{};
    Vec3 part;
    for (int axis = 0; axis < 3; ++axis) {
        const double p = std::clamp(at[axis], 0.0, double(in.what.extent[axis] - 1));
        cell[std::size_t(axis)] = std::int64_t(p);
        part[axis] = p - std::floor(p);
    }
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<std::int64_t, 3> i{};
        for (int axis = 0; axis < 3; ++axis) {
            const int next = corner >> axis & 1;
            weight *= next ? part[axis] : 1 - part[axis];
            i[std::size_t(axis)] =
                std::min(cell[std::size_t(axis)] + next, in.what.extent[axis] - 1);
        }
        const double value = *in.at<float>(i[0], i[1], i[2]);
        if (weight > largest) {
            largest = weight;
            nearest = value;
        }
        if (!std::isfinite(value) || weight == 0) continue;
        sum += weight * value;
        share += weight;
    }
    return std::isfinite(nearest) ? sum / share : nearest;
}

/// The integral along a ray by so many midpoints a unit, more of them where the function changes by
/// more than a two-hundredth within a step. Values that are not finite count as outside.
class BruteForce {
 public:
    BruteForce(const Data& in, const Request& want, double px, double py, int per_unit)
        : in_(in), want_(want), line_(want, px, py) {
        const auto count = static_cast<int>(std::ceil(line_.length() * per_unit));
        const double step = count ? line_.length() / count : 0;
        for (int i = 0; i < count && left_ > 1e-9; ++i) add(line_.low + i * step, step, 4);
    }
    Channels light() const { return {light_[0], light_[1], light_[2], 1 - left_}; }

 private:
    /// At a jump casts take what is before it.
    Channels optics(double t) const {
        const Vec3 at = line_.origin + t * line_.along;
        double value = trilinear(in_, at) - 1e-12;
        if (!std::isfinite(value)) value = beside_gap(in_, at);
        return std::isfinite(value) ? want_.transfer.at(value) : Channels{};
    }
    void add(double from, double step, int deeper) {
        constexpr int kParts = 8;
        if (deeper > 0) {
            const Channels a = optics(from), b = optics(from + step);
            double most = 0;
            for (std::size_t c = 0; c < 4; ++c) most = std::max(most, std::abs(a[c] - b[c]));
            if (most > 0.005) {
                for (int i = 0; i < kParts; ++i)
                    add(from + i * step / kParts, step / kParts, deeper - 1);
                return;
            }
        }
        const Channels at = optics(from + step / 2);
        if (at[3] == 0) return;
        const double kept = std::exp(step * want_.unit / want_.transfer.unit * std::log1p(-at[3]));
        for (std::size_t c = 0; c < 3; ++c) light_[c] += left_ * (1 - kept) * at[c];
        left_ *= kept;
    }

    const Data& in_;
    const Request& want_;
    RayLine line_;
    double left_ = 1, light_[3] = {0, 0, 0};
};

Channels brute_force(const Data& in, const Request& want, double px, double py, int per_unit) {
    return BruteForce(in, want, px, py, per_unit).light();
}

double off(const Data& picture, std::int64_t x, std::int64_t y, const Channels& truth) {
    double most = 0;
    for (std::size_t c = 0; c < 4; ++c)
        most = std::max(most, std::abs(double(picture.at<float>(x, y, 0)[c]) - truth[c]));
    return most;
}

/// What rays take.
class QuadratureCounts {
 public:
    QuadratureCounts(const Data& in, const Request& want)
        : transfer_(optics_of(want, in.what.values)),
          ranges_(in.what.extent, std::pmr::new_delete_resource()) {
        cast_.volume = kernels::grid_of(in);
        cast_.rule = Combine::over;
        cast_.rays = rays_of(in.what, want, 0, -0.5);
        cast_.unit = want.unit;
        for (std::int64_t layer = 0; layer < ranges_.extent[0].z; ++layer)
            kernels::range_layer(cast_.volume, layer, ranges_);
        kernels::join_ranges(ranges_);
    }
    QuadratureCounts(const QuadratureCounts&) = delete;
    QuadratureCounts& operator=(const QuadratureCounts&) = delete;

    kernels::QuadratureTaken of(double tolerance, const Extent& screen) {
        kernels::QuadratureTaken taken;
        std::vector<float> out(static_cast<std::size_t>(screen.x * screen.y * 4));
        kernels::adaptive_quadrature({.cast = cast_,
                                      .transfer = transfer_,
                                      .ranges = ranges_,
                                      .tolerance = tolerance,
                                      .least = 1e-6,
                                      .taken = &taken},
                                     0, 0, screen.x, screen.y, out.data(), screen.x * 4);
        return taken;
    }

 private:
    kernels::TransferPieces transfer_;
    kernels::ValueRanges ranges_;
    kernels::RayCast cast_;
};

bool equal_bytes(const Data& a, const Data& b) {
    return std::memcmp(a.samples.data(), b.samples.data(),
                       static_cast<std::size_t>(a.what.bytes())) == 0;
}

const std::vector<Transfer::Point> kGentle{{0, 0, {0.1, 0.2, 0.3}}, {1, 0.4, {1, 0.5, 0}}};

struct Phantom {
    std::string name;
    Data data;
    std::vector<Transfer::Point> points;
};

std::vector<Phantom> phantoms(const Extent& n) {
    const auto distance = [&](auto x, auto y, auto z) {
        return Vec3(double(x) - double(n.x - 1) / 2, double(y) - double(n.y - 1) / 2,
                    double(z) - double(n.z - 1) / 2)
            .norm();
    };
    std::mt19937 bits(7);
    std::vector<Phantom> all;
    all.push_back({"wave", volume(n, wave), kGentle});
    // A band of a fiftieth of the values: a bright shell a tenth of a sample thick.
    all.push_back({"shell",
                   volume(n, [&](auto... i) { return distance(i...) / 20; }),
                   {{0.4, 0, {1, 1, 1}},
                    {0.405, 0.9, {1, 0.8, 0.2}},
                    {0.41, 0.9, {1, 0.2, 0.8}},
                    {0.415, 0, {1, 1, 1}}}});
    // Knots and jumps at values that samples have.
    all.push_back({"steps",
                   volume(n, [](auto x, auto, auto z) { return double((x / 2 + z / 3) % 4) / 4; }),
                   {{0.25, 0, {0, 0, 1}},
                    {0.25, 0.3, {0, 1, 0}},
                    {0.5, 0.1, {1, 0, 0}},
                    {0.75, 0.1, {1, 1, 0}},
                    {0.75, 0.02, {0, 1, 1}}}});
    all.push_back({"noise",
                   volume(n, [&](auto...) { return double(bits() % 1001) / 1000; }),
                   {{0.2, 0, {0, 0, 1}}, {0.5, 0.2, {1, 0, 0}}, {0.9, 0.05, {0, 1, 0}}}});
    // Opaque where it is 1, by a ramp.
    all.push_back({"opaque",
                   volume(n, [&](auto... i) { return 1.6 - distance(i...) / 8; }),
                   {{0.2, 0, {0.9, 0.2, 0.1}}, {1, 1, {0.2, 0.9, 1}}}});
    return all;
}

const Extent kIn{23, 19, 26}, kOn{34, 31, 40};

TEST(AdaptiveQuadrature, OfOneMediumIsExact) {
    const Scene scene;
    for (const Extent& n : {Extent{9, 11, 70}, Extent{1, 1, 1}, Extent{40, 1, 5}})
        for (const double opacity : {0.01, 0.3, 0.99})
            for (const double degrees : {0.0, 37.0}) {
                const Data in = volume(n, [](auto...) { return 0.5; });
                Request want = quadrature_request(n, {13, 13, 90}, turn(degrees, {3, -2, 1}),
                                                  {{0, opacity, {1, 0.5, 0.25}}}, {1, 1.5, 1.2});
                want.transfer.unit = 0.7;
                const Data got = made(adaptive_quadrature(), in, {want, scene}, within(1e-6));
                for (int y = 0; y < 13; ++y)
                    for (int x = 0; x < 13; ++x) {
                        const double kept =
                            std::pow(1 - opacity, RayLine(want, x, y).length() * want.unit / 0.7);
                        const double caught = 1 - kept;
                        // A ray ends where less than the tolerance is left.
                        EXPECT_LT(off(got, x, y, {caught, caught / 2, caught / 4, caught}), 1.1e-6)
                            << n.x << ' ' << opacity << ' ' << x << ' ' << y;
                    }
            }
}

TEST(AdaptiveQuadrature, KeepsItsToleranceOnPhantoms) {
    const Scene scene;
    std::mt19937 bits(1);
    std::uniform_real_distribution<double> random(-1, 1);
    for (const Phantom& phantom : phantoms(kIn)) {
        double most = 0;
        for (int view = 0; view < 4; ++view) {
            Request want = quadrature_request(
                kIn, kOn, turn(180 * random(bits), {random(bits), random(bits), random(bits)}),
                phantom.points, {1, 1.2, 0.9});
            if (view == 3) want = quadrature_eye(want, 60);
            want.transfer.unit = view == 1 ? 2.5 : 1;
            std::vector<Data> pictures;
            const std::array<double, 4> tolerances{1e-1, 1e-2, 1e-3, 1e-4};
            for (const double tolerance : tolerances)
                pictures.push_back(
                    made(adaptive_quadrature(), phantom.data, {want, scene}, within(tolerance)));
            for (std::int64_t y = 2; y < kOn.y; y += 9)
                for (std::int64_t x = 2; x < kOn.x; x += 9) {
                    const Channels truth =
                        brute_force(phantom.data, want, double(x), double(y), 300);
                    const Channels coarse =
                        brute_force(phantom.data, want, double(x), double(y), 150);
                    double own = 1e-7;
                    for (std::size_t c = 0; c < 4; ++c)
                        own = std::max(own, 2 * std::abs(truth[c] - coarse[c]));
                    for (std::size_t i = 0; i < tolerances.size(); ++i) {
                        const double error = off(pictures[i], x, y, truth);
                        EXPECT_LE(error, tolerances[i] + own)
                            << phantom.name << ' ' << view << ' ' << x << ' ' << y;
                        most = std::max(most, error / tolerances[i]);
                    }
                    EXPECT_LT(own, 2e-5) << phantom.name;
                }
        }
        EXPECT_GT(most, 0.02) << phantom.name;  // the bound is not of another size
        RecordProperty(phantom.name, std::to_string(most));
    }
}

TEST(AdaptiveQuadrature, TakesFewerSamplesTheMoreItMayErr) {
    const Scene scene;
    for (const Phantom& phantom : phantoms(kIn)) {
        const Request want = quadrature_request(kIn, kOn, turn(33, {3, -2, 1}), phantom.points);
        QuadratureCounts counts(phantom.data, want);
        std::int64_t before = std::numeric_limits<std::int64_t>::max();
        for (const double tolerance : {1e-5, 1e-4, 1e-3, 1e-2, 1e-1}) {
            const std::int64_t samples = counts.of(tolerance, kOn).samples;
            EXPECT_LT(samples, before) << phantom.name << ' ' << tolerance;
            before = samples;
        }
    }
}

TEST(AdaptiveQuadrature, TakesFewerThanEqualStepsOfTheSameErrorWhereMuchIsEven) {
    // A shell in what is nearly even haze, so that the steps of a shell are too many for the rest.
    const Extent n{48, 48, 48}, screen{40, 40, 60};
    const Data in = volume(n, [](auto x, auto y, auto z) {
        const double r = Vec3(double(x) - 23, double(y) - 24, double(z) - 22).norm();
        return r < 12 ? 0.2 : r < 14 ? 1.0 : 0.1 + 1e-4 * double(x);
    });
    const Request want = quadrature_request(n, screen, turn(33, {3, -2, 1}),
                                            {{0, 0.002, {0.2, 0.3, 0.5}},
                                             {0.3, 0.002, {0.2, 0.3, 0.5}},
                                             {0.4, 0.7, {1, 0.7, 0.4}},
                                             {1, 0.7, {1, 1, 1}}});
    const Scene scene;
    const Ask ask{want, scene};
    std::vector<Channels> truth;
    double length = 0;
    for (std::int64_t y = 1; y < screen.y; y += 4)
        for (std::int64_t x = 1; x < screen.x; x += 4)
            truth.push_back(brute_force(in, want, double(x), double(y), 200));
    for (std::int64_t y = 0; y < screen.y; ++y)
        for (std::int64_t x = 0; x < screen.x; ++x)
            length += RayLine(want, double(x), double(y)).length();
    const auto worst = [&](const Data& picture) {
        double most = 0;
        std::size_t i = 0;
        for (std::int64_t y = 1; y < screen.y; y += 4)
            for (std::int64_t x = 1; x < screen.x; x += 4)
                most = std::max(most, off(picture, x, y, truth[i++]));
        return most;
    };
    QuadratureCounts counts(in, want);
    const double own = worst(made(adaptive_quadrature(), in, ask, within(1e-3)));
    EXPECT_LE(own, 1e-3 + 1e-5);
    const kernels::QuadratureTaken taken = counts.of(1e-3, screen);
    // Cells that are read count as samples as well.
    const auto reads = double(taken.samples + taken.cells);
    double step = 1;
    while (worst(made(ray_cast(), in, ask, {{"filter", std::string("foh")}, {"step", step}})) >
               own &&
           step > 1.0 / 64)
        step /= 2;
    EXPECT_LT(reads, length / step);
    RecordProperty("reads", std::to_string(reads));
    RecordProperty("equal", std::to_string(length / step));
}

/// The bundled head, or nothing.
Data small_head() {
    const char* folder = std::getenv("EDGEWISE_DATA");
    Representation what;
    what.type = Type::i16;
    what.extent = {64, 64, 93};
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (int slice = 1; folder && slice <= 93; ++slice) {
        std::ifstream file(fmt::format("{}/ct_head/quarter.{}", folder, slice), std::ios::binary);
        file.read(reinterpret_cast<char*>(data.at<std::int16_t>(0, 0, slice - 1)), 64 * 64 * 2);
        if (!file) folder = nullptr;
    }
    if (!folder) data.what.extent = {};
    return data;
}

/// The table of docs/light.md: errors and reads of equal steps, growing steps, and tolerances.
TEST(AdaptiveQuadrature, ConvergesOnAHead) {
    const Data in = small_head();
    if (in.what.samples() == 0) GTEST_SKIP() << "EDGEWISE_DATA is not set";
    const Extent screen{110, 110, 200};
    Request want =
        quadrature_request(in.what.extent, screen, turn(80, {1, 0, 0}) * turn(25, {0, 0, 1}),
                           {{1240, 0, {1, 1, 1}},
                            {1250, 0.8, {1, 0.9, 0.8}},
                            {1300, 0.8, {1, 0.9, 0.8}},
                            {1310, 0, {1, 1, 1}}},
                           Vec3(3.2, 3.2, 1.5) / 1.5, 0.75);
    for (const char* function : {"band", "gentle"}) {
        if (function == std::string("gentle"))
            want.transfer.points = {{300, 0, {0.8, 0.5, 0.4}}, {1200, 0.15, {0.9, 0.6, 0.5}}};
        const Scene scene;
        const Ask ask{want, scene};
        const Data truth = made(adaptive_quadrature(), in, ask, within(1e-6));
        const kernels::Optics optics = optics_of(want, in.what.values);
        kernels::RayCast cast;
        kernels::Taken taken;
        cast.volume = kernels::grid_of(in);
        cast.rule = Combine::over;
        cast.rays = rays_of(in.what, want, 0, -0.5);
        cast.unit = want.unit;
        cast.optics = &optics;
        cast.bound = kTerminated;
        cast.taken = &taken;
        const auto bricks =
            bricks_of(cast.volume, {.optics = &optics}, std::pmr::new_delete_resource(), nullptr);
        cast.bricks = bricks.get();
        const double pixels = double(screen.x) * double(screen.y);
        const auto row = [&](const std::string& name, const Data& picture, double reads) {
            double most = 0, squares = 0;
            for (std::int64_t i = 0; i < picture.what.samples() * 4; ++i) {
                const double error =
                    std::abs(double(picture.as<float>()[i]) - double(truth.as<float>()[i]));
                most = std::max(most, error);
                squares += error * error;
            }
            RecordProperty(fmt::format("{} {}", function, name),
                           fmt::format("{:.3g} reads, rms {:.2g}, most {:.2g}", reads / pixels,
                                       std::sqrt(squares / 4 / pixels), most));
            return std::pair(most, reads);
        };
        std::vector<std::pair<double, double>> equal;
        for (const double step : {1.0, 0.25, 1.0 / 16, 1.0 / 64})
            for (const double loss : {-1.0, 0.0625}) {
                if (loss > 0 && step != 0.25 && step != 1.0 / 16) continue;
                Data picture = Data::make(truth.what, std::pmr::new_delete_resource());
                cast.step = step;
                taken = {};
                float* out = picture.as<float>();
                if (loss < 0)
                    kernels::ray_cast(cast, 0, 0, screen.x, screen.y, out, picture.row());
                else
                    kernels::importance_cast(cast, loss, 0, 0, screen.x, screen.y, out,
                                             picture.row());
                const auto at = row(fmt::format("{} {}", loss < 0 ? "equal" : "growing", step),
                                    picture, double(taken.samples));
                if (loss < 0) equal.push_back(at);
            }
        QuadratureCounts counts(in, want);
        std::vector<std::pair<double, double>> own;
        for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4}) {
            const kernels::QuadratureTaken all = counts.of(tolerance, screen);
            own.push_back(row(fmt::format("tolerance {}", tolerance),
                              made(adaptive_quadrature(), in, ask, within(tolerance)),
                              double(all.samples + all.cells)));
            EXPECT_LE(own.back().first, tolerance + 1e-6);
        }
        // Fewer reads, and a smaller error.
        EXPECT_LT(own.back().first, equal.back().first);
        EXPECT_LT(own.back().second, equal.back().second);
    }
}

TEST(AdaptiveQuadrature, CrossesWhatIsEvenOrEmptyByNodes) {
    const Extent n{256, 70, 256}, screen{3, 3, 256};
    Data in = volume(n, [](auto...) { return 0.25; });
    const Scene scene;
    for (const double opacity : {0.0, 0.01}) {
        const Request want =
            quadrature_request(n, screen, turn(20, {1, 2, 1}), {{0, opacity, {1, 1, 1}}});
        QuadratureCounts counts(in, want);
        const kernels::QuadratureTaken taken = counts.of(1e-4, screen);
        EXPECT_EQ(taken.samples, 0);
        EXPECT_EQ(taken.cells, 0);
        EXPECT_LT(taken.stretches, 9 * 12);  // a ray meets at most 4 + 3 + 3 nodes of 64
    }
}

TEST(AdaptiveQuadrature, ShowsNoMoreThanThereIs) {
    std::mt19937 bits(9);
    std::uniform_real_distribution<double> random(0, 1);
    const Data in = volume(kIn, [&](auto...) { return random(bits); });
    const Scene scene;
    for (int i = 0; i < 12; ++i) {
        std::vector<Transfer::Point> points;
        for (int k = 0; k < 9; ++k)
            points.push_back({k / 8.0,
                              k % 3 ? random(bits) : double(bits() % 2),
                              {double(bits() % 2), random(bits), 1}});
        const Request want = quadrature_request(kIn, kOn, turn(50 * i, {3, -2, 1}), points);
        const Data got = made(adaptive_quadrature(), in, {want, scene}, within(0.1));
        for (std::int64_t p = 0; p < got.what.samples(); ++p) {
            const float* at = got.as<float>() + 4 * p;
            ASSERT_LE(at[3], 1);
            for (int c = 0; c < 3; ++c) {
                ASSERT_GE(at[c], 0);
                ASSERT_LE(at[c], at[3]);
            }
        }
    }
}

TEST(AdaptiveQuadrature, HasTheSiblingsFieldAroundWhatIsNotFinite) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    Data in = volume(kIn, wave);
    std::mt19937 bits(3);
    for (int i = 0; i < 60; ++i)
        in.as<float>()[bits() % std::uint32_t(kIn.samples())] =
            i % 2 ? kNaN : std::numeric_limits<float>::infinity();
    for (int z = 12; z < 24; ++z)  // a hole that has nodes of its own
        for (int y = 4; y < 15; ++y)
            for (int x = 8; x < 17; ++x) *in.at<float>(x, y, z) = kNaN;
    Scene scene;
    scene.non_finite = 1200;
    for (const double degrees : {0.0, 33.0}) {
        const Request want =
            quadrature_request(kIn, degrees == 0 ? kIn : kOn, turn(degrees, {3, -2, 1}), kGentle);
        const Data got = made(adaptive_quadrature(), in, {want, scene}, within(1e-4)),
                   cast = made(ray_cast(), in, {want, scene},
                               {{"filter", std::string("foh")}, {"step", 0.01}});
        double most = 0;
        for (std::int64_t i = 0; i < got.what.samples() * 4; ++i)
            most = std::max(most, std::abs(double(got.as<float>()[i]) - cast.as<float>()[i]));
        // Steps of 1/100 are off by half of one where a ray enters a gap: some 0.002 each.
        EXPECT_LT(most, 0.01) << degrees;
        for (std::int64_t y = 1; y < want.screen.y; y += 3)
            for (std::int64_t x = 1; x < want.screen.x; x += 3)
                EXPECT_LT(off(got, x, y, brute_force(in, want, double(x), double(y), 100)), 1.5e-4)
                    << degrees << ' ' << x << ' ' << y;
    }
    const Data none = volume(kIn, [](auto...) { return std::numeric_limits<double>::quiet_NaN(); });
    scene.non_finite = kIn.samples();
    const Request want = quadrature_request(kIn, kOn, turn(33, {3, -2, 1}), kGentle);
    const Data got = made(adaptive_quadrature(), none, {want, scene}, within(1e-3));
    for (std::int64_t i = 0; i < got.what.samples() * 4; ++i) ASSERT_EQ(got.as<float>()[i], 0);
}

TEST(AdaptiveQuadrature, KeepsToWhatAClipLeaves) {
    const Data in = volume(kIn, wave);
    Request want = quadrature_request(kIn, kOn, turn(33, {3, -2, 1}), kGentle);
    std::vector<HalfSpace> planes{{Vec3(1, 1, 0).normalized(), -12}, {-Vec3::UnitZ(), 17.2}};
    want.clips = {clip_of(kIn, planes)};
    const Scene scene;
    const Data got = made(adaptive_quadrature(), in, {want, scene}, within(1e-4)),
               cast = made(ray_cast(), in, {want, scene},
                           {{"filter", std::string("foh")}, {"step", 0.02}});
    double most = 0, light = 0;
    for (std::int64_t i = 0; i < got.what.samples() * 4; ++i) {
        most = std::max(most, std::abs(double(got.as<float>()[i]) - cast.as<float>()[i]));
        light += cast.as<float>()[i];
    }
    EXPECT_LT(most, 1e-4 + kTerminated + 1e-4);
    EXPECT_GT(light, 100);
}

TEST(AdaptiveQuadrature, SameBytesForAnyThreadsRegionsAndTypes) {
    std::mt19937 bits(11);
    const Data in = volume(kIn, [&](auto x, auto y, auto z) {
        return z > 12 && (x + y) % 9 > 3 ? double(bits() % 8) : 0.0;
    });
    Request want = quadrature_request(kIn, {50, 41, 40}, turn(37, {3, -2, 1}),
                                      {{0, 0, {0, 0, 1}}, {3, 0.2, {1, 0, 0}}, {7, 0.9, {1, 1, 1}}},
                                      {1, 1.3, 1.1}, 1.3);
    const Scene scene;
    for (const double distance : {0.0, 70.0}) {
        if (distance > 0) want = quadrature_eye(want, distance);
        const Ask ask{want, scene};
        const auto with = [&](const Data& read, std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(adaptive_quadrature(), read, ask, within(1e-3));
        };
        const Data one = with(in, 1);
        for (const std::size_t threads : {2u, 7u}) EXPECT_TRUE(equal_bytes(with(in, threads), one));
        const Region box{{13, 11, 0}, {37, 40, 1}};
        const Data part = made(adaptive_quadrature(), in, ask, box, within(1e-3));
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                     one.at<float>(box.begin[0], y, 0), 24 * 16));
        // Whole numbers of fewer bits.
        Representation what = in.what;
        what.type = Type::u8;
        Data narrow = Data::make(what, std::pmr::new_delete_resource());
        for (std::int64_t i = 0; i < kIn.samples(); ++i)
            narrow.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(in.as<float>()[i]);
        EXPECT_TRUE(equal_bytes(with(narrow, 3), one));
    }
}

TEST(AdaptiveQuadrature, RefusesWithReasons) {
    const Data in = volume(kIn, wave);
    const Scene scene;
    const auto refused = [&](const Request& want) {
        return adaptive_quadrature().offer(in.what, {want, scene}, within(1e-3)).refused;
    };
    Request want = quadrature_request(kIn, kOn, turn(33, {3, -2, 1}), kGentle);
    EXPECT_EQ(refused(want), "");
    Request lit = want;
    lit.shading.by = Shade::phong;
    EXPECT_NE(refused(lit).find("light has no bound"), std::string::npos);
    Request edges = want;
    edges.transfer.edges = {{0, 0}, {1, 1}};
    EXPECT_NE(refused(edges).find("gradients"), std::string::npos);
    Request labels = want;
    labels.field = Field::nearest;
    EXPECT_NE(refused(labels), "");
    EXPECT_NE(refused(seen(Mode::mip, kIn, kOn, turn(3, {1, 1, 1}))).find("composites"),
              std::string::npos);
    EXPECT_TRUE(adaptive_quadrature().on_demand);
}

}  // namespace
}  // namespace edgewise
