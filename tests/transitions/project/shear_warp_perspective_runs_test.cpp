#include "transitions/project/shear_warp_perspective_runs.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp_perspective.hpp"
#include "transitions/project/shear_warp_runs.hpp"
#include "transitions/project/sliced_runs.hpp"
#include "transitions/shade/runs.hpp"

namespace edgewise {
namespace {

using namespace looking;
using Points = std::vector<Transfer::Point>;

const Points kFaint = {{0.3, 0, {0, 0, 0.2}}, {1, 0.02, {1, 0.5, 0}}};
const Points kOpaque = {{0.5, 0, {1, 1, 1}}, {0.6, 1, {1, 1, 1}}};  // grey
const Points kShell = {{0.4, 0, {1, 0, 0}}, {0.5, 0.6, {0, 1, 0}}, {0.6, 0, {0, 0, 1}}};
const Points kNothing = {{5, 0, {1, 1, 1}}, {6, 1, {1, 1, 1}}};

/// What an eye sees of a volume.
struct Sight {
    Extent screen{72, 66, 60};
    Matrix3d by = Matrix3d::Identity();
    double distance = 90;  // of the eye from the middle [unit]
    Vec3 spacing = Vec3::Ones();
    double zoom = 1;
    Vec3 aside{0, 0, 0};  // of the eye from the middle of the screen [pixel]
};

Request seen_from(const Sight& of, const Extent& input, Mode mode, const Points& points) {
    Request want = seen(mode, input, of.screen, of.by, of.spacing, of.zoom);
    want.transfer.points = points;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    Eye eye;
    const double middle = double(of.screen.z - 1) / 2;
    eye.at = Vec3(double(of.screen.x - 1) / 2, double(of.screen.y - 1) / 2, middle - of.distance);
    eye.at += of.aside;
    eye.plane = middle;
    eye.width = eye.height = 1 / of.zoom;
    want.eye = eye;
    return want;
}

/// Slices of one axis, of each and both ways, of two and of three, and an eye beside the volume.
std::vector<Sight> sights() {
    std::vector<Sight> all;
    all.push_back({});
    all.push_back({.by = turn(17, {3, -2, 1})});
    all.push_back({.by = turn(170, {0, 3, 1}), .zoom = 1.3});
    all.push_back({.by = turn(85, {0.1, 1, 0}), .distance = 120});
    all.push_back({.by = turn(-88, {0.1, 1, 0}), .distance = 120});
    all.push_back({.by = turn(88, {1, 0.1, 0}), .distance = 150, .spacing = {1, 1.3, 0.7}});
    all.push_back({.by = turn(44, {0.3, 1, 0}), .distance = 70, .zoom = 1.5});
    all.push_back({.by = turn(54.7, {1, -1, 0.1}), .distance = 75, .zoom = 1.4});
    all.push_back({.screen = {150, 90, 60}, .by = turn(3, {1, 2, 0}), .distance = 40});
    all.push_back({.by = turn(95, {0, 1, 0.1}), .distance = 85, .aside = {30, -20, 0}});
    return all;
}

template <class T>
Data samples_of(const Extent& extent, Type type, const ValueMap& values) {
    Representation what;
    what.extent = extent;
    what.type = type;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 random(3);
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x) {
                // Balls with a rough skin in empty space, 0 to 1.
                const double lump = std::sin(0.19 * double(x) + 1) * std::cos(0.17 * double(y + z));
                const double noise = 0.1 * double(random() % 1000) / 1000;
                const double value = lump > 0 ? std::min(1.0, lump + noise) : 0;
                *data.at<T>(x, y, z) = static_cast<T>((value - values.offset) / values.slope);
            }
    return data;
}

Data balls(const Extent& extent) { return samples_of<float>(extent, Type::f32, {}); }

Parameters by(const std::string& filter, double density = 1) {
    return {{"filter", filter}, {"density", density}};
}

Data with_runs(const Data& in, const Ask& ask) {
    const Offer offer = sliced_runs().offer(in.what, ask, {});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::sharing(in, offer.to);
    Context context{.memory = std::pmr::new_delete_resource()};
    sliced_runs().run(offer, ask, in, out, Region::all(in.what.extent), context);
    return out;
}

bool same_bytes(const Data& one, const Data& other) {
    return one.what.bytes() == other.what.bytes() &&
           std::memcmp(one.samples.data(), other.samples.data(),
                       static_cast<std::size_t>(one.what.bytes())) == 0;
}

/// The picture by runs is that of all samples.
void expect_same(const Data& in, const Ask& ask, double density = 1) {
    const Data seen = with_runs(in, ask);
    for (const char* filter : {"zoh", "foh"})
        EXPECT_TRUE(same_bytes(made(shear_warp_perspective_runs(), seen, ask, by(filter, density)),
                               made(shear_warp_perspective(), in, ask, by(filter, density))))
            << filter << ' ' << ask.want.mode->name << ' ' << in.what.extent.x << ' '
            << in.what.extent.y << ' ' << in.what.extent.z << ' ' << name_of(in.what.type);
}

TEST(ShearWarpPerspectiveRuns, AreThePictureOfAllSamplesToTheBit) {
    const Extent n{47, 36, 41};
    const Data in = balls(n);
    const Scene scene;
    for (const Sight& of : sights())
        for (const Points& points : {kFaint, kOpaque, kShell, kNothing}) {
            const Request want = seen_from(of, n, Mode::composite, points);
            expect_same(in, {want, scene});
        }
}

TEST(ShearWarpPerspectiveRuns, AreSoOfEveryTypeAndDensity) {
    const Extent n{150, 31, 27};  // wider than a tile
    const Data inputs[] = {samples_of<std::uint8_t>(n, Type::u8, {1 / 255., 0}),
                           samples_of<std::int16_t>(n, Type::i16, {-1 / 3000., 1}),
                           samples_of<double>(n, Type::f64, {})};
    const Scene scene;
    for (const Data& in : inputs)
        for (const double density : {0.5, 1.0, 3.0})
            for (const double degrees : {20.0, 70.0}) {
                const Sight of{
                    .screen = {160, 60, 60}, .by = turn(degrees, {0.2, 1, 0.1}), .distance = 140};
                const Request want = seen_from(of, n, Mode::composite, kShell);
                expect_same(in, {want, scene}, density);
            }
}

TEST(ShearWarpPerspectiveRuns, AreSoInEveryModeThatTakesThem) {
    const Extent n{40, 31, 43};
    const Data in = balls(n);
    const Scene scene;
    int took = 0;
    for (const Mode mode : modes())
        for (const double degrees : {20.0, 50.0}) {
            const Request want = seen_from({.by = turn(degrees, {1, 2, -1})}, n, mode, kShell);
            const Ask ask{want, scene};
            if (!sliced_runs().offer(in.what, ask, {}).refused.empty()) continue;
            EXPECT_EQ(shear_warp_perspective_runs().offer(in.what, ask, by("foh")).refused, "");
            expect_same(in, ask);
            ++took;
        }
    EXPECT_EQ(took, 4);  // by opacity and by level
}

TEST(ShearWarpPerspectiveRuns, AreSoOfOddShapes) {
    const Scene scene;
    for (const Extent& n : {Extent{1, 1, 1}, Extent{20, 9, 1}, Extent{1, 9, 9}, Extent{9, 1, 7},
                            Extent{201, 3, 5}, Extent{33, 40, 2}, Extent{2, 2, 90}}) {
        const Data in = balls(n), full = volume(n, [](auto...) { return 1.0; });
        for (const double degrees : {0.0, 40.0, 90.0})
            for (const Points& points : {kFaint, kOpaque}) {
                const Sight of{.by = turn(degrees, {0.3, 1, 0.2}), .distance = 130};
                const Request want = seen_from(of, n, Mode::composite, points);
                expect_same(in, {want, scene});
                expect_same(full, {want, scene});
            }
    }
}

TEST(ShearWarpPerspectiveRuns, AnEmptyVolumeIsTransparent) {
    const Extent n{30, 20, 25};
    const Data in = volume(n, [](auto...) { return 0.0; });
    const Scene scene;
    for (const Sight& of : sights()) {
        const Request want = seen_from(of, n, Mode::composite, kShell);
        const Ask ask{want, scene};
        const Data got = made(shear_warp_perspective_runs(), with_runs(in, ask), ask, by("foh"));
        const auto* first = got.as<float>();
        EXPECT_TRUE(std::all_of(first, first + got.what.samples() * got.what.channels,
                                [](float value) { return value == 0; }));
    }
}

/// A smooth ball, against rays through the trilinear field: slices and a second interpolation add
/// what ShearWarpPerspective.IsNearTheRayCaster bounds.
TEST(ShearWarpPerspectiveRuns, AreNearARayCast) {
    const Extent n{48, 44, 40};
    const Vec3 middle = Vec3(47, 43, 39) / 2;
    const Data in = volume(n, [&](auto x, auto y, auto z) {
        return std::exp(-(Vec3(double(x), double(y), double(z)) - middle).squaredNorm() / 150);
    });
    const Scene scene;
    for (const double degrees : {15.0, 45.0, 100.0}) {
        const Request want = seen_from({.by = turn(degrees, {1, 2, 0})}, n, Mode::composite,
                                       {{0.2, 0, {1, 1, 1}}, {1, 0.3, {1, 1, 1}}});
        const Ask ask{want, scene};
        const Data got = made(shear_warp_perspective_runs(), with_runs(in, ask), ask, by("foh"));
        const Data cast = made(ray_cast(), in, ask, {{"filter", "foh"}, {"step", 0.25}});
        double squares = 0, largest = 0;
        const std::int64_t count = got.what.samples() * got.what.channels;
        for (std::int64_t i = 0; i < count; ++i) {
            squares += std::pow(double(got.as<float>()[i]) - double(cast.as<float>()[i]), 2);
            largest = std::max(largest, double(cast.as<float>()[i]));
        }
        EXPECT_GT(largest, 0.5);
        EXPECT_LT(std::sqrt(squares / double(count)), 0.01 * largest);
    }
}

TEST(ShearWarpPerspectiveRuns, SamplesThatAreNotFiniteAreKeptToThemselves) {
    const Extent n{40, 33, 21};
    Data in = balls(n);
    for (std::int64_t i = 7; i < n.samples(); i += 101)
        in.as<float>()[i] = i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                       : std::numeric_limits<float>::infinity();
    Scene scene;
    scene.non_finite = 270;
    for (const double degrees : {20.0, 95.0}) {
        const Request want =
            seen_from({.by = turn(degrees, {0, 1, 0.1})}, n, Mode::composite, kShell);
        const Ask ask{want, scene};
        const Data seen = with_runs(in, ask);
        const Data got = made(shear_warp_perspective_runs(), seen, ask, by("zoh"));
        EXPECT_TRUE(same_bytes(got, made(shear_warp_perspective(), in, ask, by("zoh"))));
        for (std::int64_t i = 0; i < got.what.samples() * got.what.channels; ++i)
            ASSERT_TRUE(std::isfinite(got.as<float>()[i]));
        const std::string refused =
            shear_warp_perspective_runs().offer(seen.what, ask, by("foh")).refused;
        EXPECT_NE(refused.find("270 samples are not finite"), std::string::npos) << refused;
    }
}

TEST(ShearWarpPerspectiveRuns, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{47, 61, 43};
    const Data in = balls(n);
    const Scene scene;
    for (const double degrees : {20.0, 47.0, 90.0})
        for (const Points& points : {kFaint, kOpaque}) {
            const Sight of{.screen = {133, 101, 60}, .by = turn(degrees, {0.4, 1, 0}), .zoom = 1.7};
            const Request want = seen_from(of, n, Mode::composite, points);
            const Ask ask{want, scene};
            const auto with = [&](std::size_t threads) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                return made(shear_warp_perspective_runs(), with_runs(in, ask), ask, by("foh"));
            };
            const Data one = with(1);
            for (const std::size_t threads : {2u, 7u}) EXPECT_TRUE(same_bytes(one, with(threads)));
            const Data seen = with_runs(in, ask);
            for (const Region& box :
                 {Region{{50, 13, 0}, {111, 66, 1}}, Region{{60, 50, 0}, {61, 51, 1}}}) {
                const Data part = made(shear_warp_perspective_runs(), seen, ask, box, by("foh"));
                const auto bytes = static_cast<std::size_t>(box.extent().x) * sizeof(float) *
                                   static_cast<std::size_t>(one.what.channels);
                for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                    ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                             one.at<float>(box.begin[0], y, 0), bytes));
            }
        }
}

TEST(ShearWarpPerspectiveRuns, AViewsRunsServeAllViews) {
    // Slices of all axes in turn, one set of runs.
    const Extent n{40, 36, 33};
    const Data in = balls(n);
    Scene scene;
    Request want = seen_from({}, n, Mode::composite, kShell);
    want.frames = 3;
    std::vector<Transform> views;
    for (const Matrix3d& way : {turn(0, {0, 0, 1}), turn(90, {0, 1, 0.05}), turn(90, {1, 0, 0.05})})
        views.push_back(seen_from({.by = way}, n, Mode::composite, kShell).views.at(0));
    want.views = Placement::each(std::move(views));
    const Ask ask{want, scene};
    const Data seen = with_runs(in, ask);
    for (int view = 0; view < 3; ++view) {
        Context context{.memory = std::pmr::new_delete_resource(), .view = view};
        const auto picture = [&](const Transition& edge, const Data& of) {
            const Offer offer = edge.offer(of.what, ask, by("foh"));
            Data out = Data::make(offer.to, std::pmr::new_delete_resource());
            edge.run(offer, ask, of, out, Region::all(offer.to.extent), context);
            return out;
        };
        EXPECT_TRUE(same_bytes(picture(shear_warp_perspective_runs(), seen),
                               picture(shear_warp_perspective(), in)))
            << view;
    }
}

TEST(ShearWarpPerspectiveRuns, CountsFollowWhatIsSeen) {
    const Extent n{96, 96, 96};
    Representation what;
    what.extent = n;
    const auto work = [&](const Sight& of, double seen, double taken) {
        const Request want = seen_from(of, n, Mode::composite, kOpaque);
        Scene scene;
        scene.facts = {{"runs/seen", seen},
                       {"runs/row", 2},
                       {"cast/all", 100},
                       {"cast/taken", 80},
                       {"cast/bricks", 100 * taken}};
        const Ask ask{want, scene};
        const Offer runs = sliced_runs().offer(what, ask, {});
        EXPECT_EQ(runs.refused, "");
        const Offer offer = shear_warp_perspective_runs().offer(runs.to, ask, by("foh"));
        EXPECT_EQ(offer.refused, "");
        EXPECT_FALSE(shear_warp_perspective_runs().error_of(offer, ask).known);
        return shear_warp_perspective_runs().work(offer, ask, 0).operations;
    };
    const Sight of{.screen = {160, 160, 160}, .by = turn(10, {1, 2, 0}), .distance = 200};
    EXPECT_NEAR(work(of, 0.3, 0.2) - work(of, 0.3, 0.1), work(of, 0.2, 0.9) - work(of, 0.1, 0.9),
                1);
    EXPECT_GT(work(of, 0.3, 0.2) - work(of, 0.3, 0.1), 0.04 * double(n.samples()) * 20);
    // Runs of each axis that has slices: of x with rows of their own.
    const auto facets = [&](const Sight& from) {
        const Request want = seen_from(from, n, Mode::composite, kOpaque);
        const Scene scene;
        return sliced_runs().offer(what, {want, scene}, {}).to.facet_bytes;
    };
    const Sight along_x{.screen = {160, 160, 160}, .by = turn(90, {0, 1, 0}), .distance = 600};
    const Sight both{.screen = {160, 160, 160}, .by = turn(45, {0, 1, 0}), .distance = 200};
    EXPECT_EQ(facets(along_x), facets(of) + what.bytes());
    EXPECT_EQ(facets(both), facets(of) + facets(along_x));
}

TEST(ShearWarpPerspectiveRuns, RefuseWhatTheyCannotDo) {
    const Extent n{40, 33, 21};
    Representation what;
    what.extent = n;
    const Scene scene;
    const auto runs_refused = [&](const Request& want) {
        return sliced_runs().offer(what, {want, scene}, {}).refused;
    };
    const auto refused = [&](const Request& want) {
        return shear_warp_perspective_runs().offer(what, {want, scene}, by("foh")).refused;
    };
    const auto names = [](const std::string& reason, const char* word) {
        return reason.find(word) != std::string::npos;
    };
    const Request fine = seen_from({.by = turn(10, {1, 2, 0})}, n, Mode::composite, kShell);
    EXPECT_EQ(runs_refused(fine), "");
    EXPECT_EQ(refused(fine), "");
    EXPECT_TRUE(names(shear_warp_runs().offer(what, {fine, scene}, {{"filter", "foh"}}).refused,
                      "finite distance"));
    EXPECT_TRUE(names(refused(seen_from({}, n, Mode::mip, kShell)), "no value is transparent"));
    EXPECT_TRUE(names(visible_runs().offer(what, {fine, scene}, {}).refused, "finite distance"));
    Request want = fine;
    want.eye.reset();
    EXPECT_TRUE(names(refused(want), "parallel"));
    EXPECT_TRUE(names(runs_refused(want), "parallel"));
    for (const auto& [distance, word] :
         {std::pair(5.0, "inside the volume"), std::pair(10.8, "voxels away from the volume")}) {
        want = seen_from({.distance = distance}, n, Mode::composite, kShell);
        EXPECT_TRUE(names(refused(want), word)) << refused(want);
        EXPECT_TRUE(names(runs_refused(want), word)) << runs_refused(want);
    }
    want = fine;
    want.clips.resize(1);
    EXPECT_TRUE(names(refused(want), "clip"));
    EXPECT_TRUE(names(runs_refused(want), "clip"));
    want = fine;
    want.shading.by = Shade::phong;
    EXPECT_TRUE(names(refused(want), "light"));
    want = fine;
    want.transfer.points = {{0, 0.1, {1, 1, 1}}};
    EXPECT_TRUE(names(refused(want), "no value is transparent"));
    what.extent.y = 70000;
    EXPECT_TRUE(
        names(runs_refused(seen_from({.distance = 1e5}, what.extent, Mode::composite, kShell)),
              "columns of 70000 samples"));
}

}  // namespace
}  // namespace edgewise
