#include <array>
#include <atomic>
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <tbb/global_control.h>

#include "tests/transitions/spectrum/spectrum_scene.hpp"
#include "transitions/spectrum/depth_polynomial.hpp"
#include "transitions/spectrum/faded_picture.hpp"
#include "transitions/spectrum/moment_slice.hpp"
#include "transitions/spectrum/moments.hpp"

namespace edgewise {
namespace {

/// The three edges that give pictures whose light falls off.
struct FadedPath : SlicePath {
    FadedPath(const Representation& from, const Ask& ask, double degree, double width = 6,
              double padding = 2)
        : SlicePath{
              spectrum_moments(), spectrum_moment_slice(), spectrum_faded_picture(), {}, {}, {}} {
        choose(from, ask, {{"degree", degree}, {"width", width}, {"padding", padding}}, "volume");
    }
};

struct Case {
    Extent extent{20, 18, 16};
    Counting memory;
    Data data = blobs(extent, 0, &memory);
    Request want = request_of(extent, Vec3(1, 1, 1), Mode::xray, 1);
    Scene scene = scene_of(data);

    explicit Case(const DepthCue& cue = {0.02, true}) { want.cue = cue; }
    Ask ask() const { return {want, scene}; }
    std::string refusal(double degree = 1) const {
        return FadedPath(data.what, ask(), degree).made.refused;
    }
};

TEST(DepthPolynomial, FollowsTheExponentialWithinItsBound) {
    for (const double fall : {0., 1e-9, 0.3, 2., 10., 90.})
        for (int degree = 1; degree <= 3; ++degree) {
            const DepthPolynomial light(DepthCue{fall / 7, false}, 7, degree);
            double most = 0;
            for (int i = 0; i <= 2000; ++i) {
                const double share = i / 2000.;
                most = std::max(most, std::abs(light(2 * share - 1) - std::exp(-fall * share)));
            }
            EXPECT_NEAR(most, light.bound, 1e-13) << fall << " " << degree;
        }
    // A cubic over a depth in which light falls to a tenth.
    EXPECT_LT(DepthPolynomial(DepthCue{std::log(10.), false}, 1, 3).bound, 0.01);
}

TEST(DepthPolynomial, LinearLightIsExact) {
    const DepthPolynomial light(DepthCue{0.125, true}, 6, 1);
    EXPECT_EQ(light.bound, 0);
    for (const double t : {0., 1.5, 6.}) EXPECT_NEAR(light(t / 3 - 1), 1 - 0.125 * t, 1e-15);
}

TEST(DepthPolynomial, MomentsAddUpToIt) {
    std::mt19937 random(3);
    const auto drawn = [&] { return static_cast<double>(random()) * 0x1p-31 - 1; };
    const std::array<std::size_t, 3> counts{4, 10, 20};
    for (int degree = 1; degree <= 3; ++degree) {
        const auto moments = moments_up_to(degree);
        EXPECT_EQ(moments.size(), counts[static_cast<std::size_t>(degree - 1)]);
        const DepthPolynomial light(DepthCue{3, false}, 1, degree);
        for (int draw = 0; draw < 20; ++draw) {
            const DepthAxis axis{0.2 * drawn(), {drawn() / 3, drawn() / 3, drawn() / 3}};
            const std::array u{drawn(), drawn(), drawn()};
            double s = axis.at_origin, sum = 0;
            for (std::size_t k = 0; k < 3; ++k) s += axis.along[k] * u[k];
            const std::vector<double> weights = moment_weights(light, axis, degree);
            for (std::size_t m = 0; m < moments.size(); ++m)
                sum += weights[m] * std::pow(u[0], moments[m].power[0]) *
                       std::pow(u[1], moments[m].power[1]) * std::pow(u[2], moments[m].power[2]);
            EXPECT_NEAR(sum, light(s), 1e-13);
        }
    }
}

TEST(SpectrumMoments, RefuseWhatTheyCannotDo) {
    Case c;
    EXPECT_EQ(c.refusal(), "");
    EXPECT_EQ(c.refusal(2), "light that falls off linearly needs no moments beyond the first");
    EXPECT_EQ(c.refusal(1.5), "a degree of 1.5 is no whole one");
    EXPECT_EQ(FadedPath(c.data.what, c.ask(), 1, 5).made.refused,
              "no window of width 5 for padding 2: moments take 4 and 6, with 1.25, 1.5 and 2");
    c.want.cue.reset();
    EXPECT_EQ(c.refusal(), "light does not fall off along rays: one spectrum has it all");
    c.want.cue = DepthCue{0.05, true};  // the diagonal view is 31 deep
    EXPECT_EQ(c.refusal().substr(0, 39), "light ends at a depth of 20, and the vo");
    c.want.cue = DepthCue{5, false};
    EXPECT_EQ(c.refusal(3).substr(0, 20), "light falls by exp(-");
    c.want.cue = DepthCue{0.02, true};
    c.want.mode = Mode::mip;
    EXPECT_EQ(c.refusal(), "mip does not commute with the Fourier slice theorem");
    c.want.mode = Mode::mean;
    EXPECT_EQ(c.refusal(), "");
    c.scene.non_finite = 1;
    EXPECT_EQ(c.refusal(), "1 samples are not finite, a transform would spread them everywhere");
    c.scene.non_finite = 0;
    c.data.what.channels = 3;
    EXPECT_EQ(c.refusal(), "a spectrum is made of a volume of one channel, whole in memory");
}

TEST(SpectrumMoments, VerticesTellDegreeAndWindow) {
    const Case c(DepthCue{0.1, false});
    for (int degree = 1; degree <= 3; ++degree) {
        const FadedPath path(c.data.what, c.ask(), degree, 4, 1.25);
        EXPECT_EQ(path.made.to.kind(), fmt::format("object/moments+degree{}+window4x1.25", degree));
        EXPECT_EQ(moment_spectra().degree_of(path.made.to), degree);
        EXPECT_EQ(moment_spectra().one_of(path.made.to).samples() *
                      static_cast<std::int64_t>(moments_up_to(degree).size()),
                  path.made.to.samples());
        const auto& joins = path.forward.joins;
        EXPECT_EQ(
            std::count(joins.begin(), joins.end(),
                       std::pair<std::string, std::string>("object/scalar", path.made.to.kind())),
            1);
        EXPECT_TRUE(is_target(path.seen.to, c.want));
        EXPECT_EQ(path.made.to.runs(), 1);
        EXPECT_EQ(path.cut.to.runs(), 3);
    }
}

/// Samples whose light was taken away by hand give the same pictures through one spectrum.
TEST(SpectrumMoments, EqualASpectrumOfFadedSamples) {
    for (const DepthCue& cue : {DepthCue{0.03, true}, DepthCue{0.1, false}})
        for (const int degree : {1, 3}) {
            if (cue.linear && degree > 1) continue;
            Case c(cue);
            const FadedPath path(c.data.what, c.ask(), degree, 6, 1.25);
            ASSERT_EQ(path.made.refused, "");
            const Data spectra = path.spectrum(c.data, c.ask(), &c.memory);
            for (int view = 0; view < 3; ++view) {
                const double depth = depth_of(c.want, view);
                const DepthPolynomial light(cue, depth, degree);
                Data faded = Data::make(c.data.what, &c.memory);
                for (std::int64_t i = 0; i < c.extent.samples(); ++i) {
                    const Vec3 at(static_cast<double>(i % c.extent.x),
                                  static_cast<double>(i / c.extent.x % c.extent.y),
                                  static_cast<double>(i / (c.extent.x * c.extent.y)));
                    const double t =
                        c.want.views.at(view).apply(at).z() - nearest_corner(c.want, view);
                    faded.as<float>()[i] = static_cast<float>(
                        c.data.as<float>()[i] * light(2 * t * c.want.unit / depth - 1));
                }
                Request plain = c.want;
                plain.cue.reset();
                const Ask ask{plain, c.scene};
                const Path one(c.data.what, ask, {6, 1.25, "volume"});
                const Data expected =
                    one.picture(one.spectrum(faded, ask, &c.memory), ask, view, &c.memory);
                const Data got = path.picture(spectra, c.ask(), view, &c.memory);
                // f32: some twenty roundings of sums up to 20 x 120; moments of a cubic cancel in
                // part, by less than 2^3.
                for (std::int64_t i = 0; i < got.what.extent.samples(); ++i)
                    ASSERT_NEAR(got.as<float>()[i], expected.as<float>()[i], 2400 * 20 * 6e-8)
                        << view;
            }
        }
}

/// A Gaussian is its own projection, and its light is known: of a line through it that is r from
/// the centre, which lies at depth t, (1 - K t) or exp(-K t + (K sigma)^2 / 2) of exp(-r^2 / 2
/// sigma^2) sigma sqrt(2 pi).
struct Gaussian {
    static constexpr double kSigma = 2.5;
    Extent extent{40, 36, 38};
    Vec3 centre{20.3, 17.1, 18.6};
    Vec3 spacing;
    std::pmr::memory_resource* memory = std::pmr::new_delete_resource();
    Data data;
    Request want;
    Scene scene;

    explicit Gaussian(const DepthCue& cue, const Vec3& spacing_ = Vec3(1, 1, 1),
                      Mode mode = Mode::xray)
        : spacing(spacing_) {
        Representation what;
        what.extent = extent;
        data = Data::make(what, memory);
        for (std::int64_t i = 0; i < extent.samples(); ++i) {
            const Vec3 at(static_cast<double>(i % extent.x),
                          static_cast<double>(i / extent.x % extent.y),
                          static_cast<double>(i / (extent.x * extent.y)));
            const double r = (at - centre).cwiseProduct(spacing).norm();
            data.as<float>()[i] = static_cast<float>(std::exp(-r * r / (2 * kSigma * kSigma)));
        }
        want = request_of(extent, spacing, mode, 1);
        want.cue = cue;
        // The band-limited field through samples of a Gaussian of 2 samples or more is itself to
        // exp(-2 pi^2 2^2 / 4) = 3e-9.
        want.field = Field::formula;
        scene = scene_of(data);
        scene.commonest = 0;
    }
    /// Largest error of a picture, over the largest integral without a cue.
    double error(const Data& picture, int view) const {
        const DepthCue& cue = *want.cue;
        const Vec3 at = want.views.at(view).apply(centre);
        const double t = (at.z() - nearest_corner(want, view)) * want.unit;
        const double light =
            cue.linear ? 1 - cue.per_length * t
                       : std::exp(-cue.per_length * t + std::pow(cue.per_length * kSigma, 2) / 2);
        double worst = 0;
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                const double r =
                    std::hypot(static_cast<double>(x) - at.x(), static_cast<double>(y) - at.y());
                const double expected = light * std::exp(-r * r / (2 * kSigma * kSigma));
                const double got = picture.as<float>()[y * want.screen.x + x] / kIntegral;
                worst = std::max(worst, std::abs(got - expected));
            }
        return worst;
    }
    static constexpr double kIntegral = 2.5066282746310002 * kSigma;
};

TEST(SpectrumMoments, GiveTheIntegralOfLinearLight) {
    for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(0.9, 1, 1.2)}) {
        const Gaussian g(DepthCue{0.012, true}, spacing);
        const Ask ask{g.want, g.scene};
        const FadedPath path(g.data.what, ask, 1);
        ASSERT_EQ(path.made.refused, "");
        const Data spectra = path.spectrum(g.data, ask, g.memory);
        // Ghosts of the widest window, a few times 4e-6, and roundings of f32.
        for (int view = 0; view < 3; ++view)
            EXPECT_LT(g.error(path.picture(spectra, ask, view, g.memory), view), 1e-5) << view;
    }
}

TEST(SpectrumMoments, GiveTheIntegralOfExponentialLightWithinTheirBound) {
    const Gaussian g(DepthCue{0.03, false});
    const Ask ask{g.want, g.scene};
    double before = 1;
    for (int degree = 1; degree <= 3; ++degree) {
        const FadedPath path(g.data.what, ask, degree);
        ASSERT_EQ(path.made.refused, "");
        const Data spectra = path.spectrum(g.data, ask, g.memory);
        double worst = 0, bound = 0;
        for (int view = 0; view < 3; ++view) {
            worst = std::max(worst, g.error(path.picture(spectra, ask, view, g.memory), view));
            bound =
                std::max(bound, DepthPolynomial(*g.want.cue, depth_of(g.want, view), degree).bound);
        }
        EXPECT_LT(worst, bound + 1e-5) << degree;
        EXPECT_LT(bound, before / 4);
        before = bound;
    }
}

TEST(SpectrumMoments, AConstantIsKnown) {
    for (const DepthCue& cue : {DepthCue{0.05, true}, DepthCue{0.3, false}, DepthCue{0, true}})
        for (const Extent& extent : {Extent{1, 1, 1}, Extent{12, 7, 1}, Extent{9, 11, 10}})
            for (const Mode mode : {Mode::xray, Mode::mean}) {
                std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
                Representation what;
                what.extent = extent;
                Data data = Data::make(what, memory);
                std::fill_n(data.as<float>(), extent.samples(), 3.f);
                Request want = request_of(extent, Vec3(1, 1, 1), mode, 0.5);
                want.cue = cue;
                want.zero = 1;
                want.miss = -1;
                const Scene scene = scene_of(data);
                const Ask ask{want, scene};
                const FadedPath path(what, ask, 1);
                ASSERT_EQ(path.made.refused, "");
                const Data spectra = path.spectrum(data, ask, memory);
                const Data picture = path.picture(spectra, ask, 0, memory);
                const auto n = static_cast<double>(extent.z);
                const double k = cue.per_length;
                const double light = cue.linear ? n - k * n * n / 2 : (1 - std::exp(-k * n)) / k;
                const Extent& seen = picture.what.extent;
                EXPECT_NEAR(picture.as<float>()[seen.y / 2 * seen.x + seen.x / 2],
                            mode == Mode::mean ? 3 * light / n : 2 * light, 1e-5 * n);
                EXPECT_EQ(picture.as<float>()[0], mode == Mode::mean ? -1.f : 0.f);
            }
}

TEST(SpectrumMoments, BytesDoNotDependOnThreads) {
    Case c(DepthCue{0.05, false});
    std::vector<std::vector<float>> pictures;
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const FadedPath path(c.data.what, c.ask(), 2);
        const Data spectra = path.spectrum(c.data, c.ask(), &c.memory);
        const Data picture = path.picture(spectra, c.ask(), 2, &c.memory);
        pictures.emplace_back(picture.as<float>(),
                              picture.as<float>() + picture.what.extent.samples());
    }
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST(SpectrumMoments, StayWithinTheirCountedBytes) {
    Case c(DepthCue{0.05, false});
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    const FadedPath path(c.data.what, c.ask(), 2);
    Data spectra = Data::make(path.made.to, &c.memory), plane = Data::make(path.cut.to, &c.memory),
         picture = Data::make(path.seen.to, &c.memory);
    Context context{.memory = &c.memory, .view = 1};
    const auto expect = [&](const Transition& edge, const Offer& offer, const Data& in, Data& out) {
        const Work work = edge.work(offer, c.ask(), 1);
        const double most = static_cast<double>(c.memory.now()) + 2 * work.scratch + work.workspace;
        c.memory.restart();
        edge.run(offer, c.ask(), in, out, Region::all(out.what.extent), context);
        EXPECT_LE(static_cast<double>(c.memory.peak()), most) << edge.name;
    };
    expect(path.forward, path.made, c.data, spectra);
    expect(path.slice, path.cut, spectra, plane);
    expect(path.inverse, path.seen, plane, picture);
}

TEST(SpectrumMoments, StopWhenAsked) {
    Case c;
    const FadedPath path(c.data.what, c.ask(), 1);
    Data spectra = Data::make(path.made.to, &c.memory), plane = Data::make(path.cut.to, &c.memory);
    const std::atomic<bool> stop{true};
    Context context{.memory = &c.memory, .stop = &stop};
    EXPECT_THROW(path.forward.run(path.made, c.ask(), c.data, spectra, {}, context), Cancelled);
    EXPECT_THROW(path.slice.run(path.cut, c.ask(), spectra, plane, {}, context), Cancelled);
}

/// Along an axis of the volume only the powers of one coordinate count, and are paid for.
TEST(SpectrumMoments, AreCountedAsFarAsTheyCount) {
    const Case c(DepthCue{0.05, false});
    const FadedPath path(c.data.what, c.ask(), 2);
    const double along = path.slice.work(path.cut, c.ask(), 0).gathers;
    const Path plain(c.data.what, c.ask(), {});
    Request without = c.want;
    without.cue.reset();
    const Ask ask{without, c.scene};
    const Path one(c.data.what, ask, {6, 2, "volume"});
    EXPECT_EQ(along, 3 * one.slice.work(one.cut, ask, 0).gathers);
    EXPECT_EQ(path.slice.work(path.cut, c.ask(), 2).gathers,
              10 * one.slice.work(one.cut, ask, 2).gathers);
}

}  // namespace
}  // namespace edgewise
