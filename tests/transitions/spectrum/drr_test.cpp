#include <gtest/gtest.h>
#include <random>
#include <tbb/global_control.h>

#include "tests/transitions/spectrum/spectrum_scene.hpp"
#include "transitions/spectrum/pixel_of_sum.hpp"

namespace edgewise {
namespace {

constexpr double kWater = 0.0206;  // of the mode [1 / mm]

Mode drr() { return mode_named("drr"); }

constexpr double kWidth = 2.2;  // of Gaussians [sample]

/// What a spline through samples of a Gaussian has along one axis of the spectra that repeat about
/// one cycle a sample, on both sides, over the Gaussian: of these it keeps at most 0.01027 s^4 +
/// 0.077 s^6, s = sin(pi f), f the distance from the cycle (see spectrum_model.cpp); the mean of
/// (pi f)^4 is 3 / (16 width^4), that of (pi f)^6 is 15 / (64 width^6).
double beyond(double width) {
    return 2 * (0.01027 * 3 / 16 / std::pow(width, 4) + 0.077 * 15 / 64 / std::pow(width, 6));
}

/// A soft ball of tissue with a soft ball of bone, in air, empty at the faces [HU].
Data body(const Extent& extent, std::pmr::memory_resource* memory) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, memory);
    const auto gauss = [&](std::int64_t x, std::int64_t y, std::int64_t z, double fx, double fy,
                           double fz) {
        const double r2 = std::pow(static_cast<double>(x) - fx * static_cast<double>(extent.x), 2) +
                          std::pow(static_cast<double>(y) - fy * static_cast<double>(extent.y), 2) +
                          std::pow(static_cast<double>(z) - fz * static_cast<double>(extent.z), 2);
        return std::exp(-r2 / (2 * kWidth * kWidth));
    };
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x) {
                const double value =
                    1800 * gauss(x, y, z, 0.45, 0.5, 0.5) + 900 * gauss(x, y, z, 0.62, 0.45, 0.55);
                data.as<float>()[(z * extent.y + y) * extent.x + x] =
                    static_cast<float>(-1000 + (value < 1e-3 ? 0 : value));
            }
    return data;
}

struct Case {
    Extent extent{26, 24, 22};
    Counting memory;
    Data data = body(extent, &memory);
    Request want;
    Scene scene = scene_of(data);

    explicit Case(const Vec3& spacing = Vec3(1, 1, 1))
        : want(request_of(extent, spacing, drr(), spacing.minCoeff())) {}
    Ask ask() const { return {want, scene}; }
    Data picture(const Chosen& chosen, int view) {
        const Path path(data.what, ask(), chosen);
        EXPECT_EQ(path.made.refused, "");
        EXPECT_EQ(path.seen.refused, "");
        return path.picture(path.spectrum(data, ask(), &memory), ask(), view, &memory);
    }
};

TEST(SpectrumRadiograph, APixelIsThatOfAUniformMedium) {
    Case c;
    c.want.unit = 0.7;
    for (const double value : {-1000.0, -400.0, 0.0, 35.0, 2500.0})
        for (const double length : {0.25, 3.0, 120.0})
            EXPECT_NEAR(pixel_of_sum(c.want, value * length, length),
                        std::exp(-kWater * length * 0.7 * (1 + value / 1000)), 1e-14);
    EXPECT_EQ(pixel_of_sum(c.want, 0, 0), 1);      // a ray that misses
    EXPECT_EQ(pixel_of_sum(c.want, -5000, 2), 1);  // ghosts of less than air take nothing away
    EXPECT_FALSE(grows_with_length(c.want));
    // exp(-x) is steepest at x = 0.
    EXPECT_NEAR(steepness(c.want, -1000, 2000), kWater * 0.7 / 1000, 1e-5 * kWater);
    c.want.mode = Mode::mean;
    for (const double zero : {0.0, -1.0}) {  // which a mean does not read
        c.want.zero = zero;
        EXPECT_FALSE(grows_with_length(c.want));
    }
    c.want.mode = Mode::xray;
    EXPECT_TRUE(grows_with_length(c.want));
    c.want.zero = 12;
    EXPECT_TRUE(grows_with_length(c.want));
}

TEST(SpectrumRadiograph, RefusesValuesThatTheModeCutsOff) {
    Case c;
    c.scene.low = -3024, c.scene.high = 1500;
    EXPECT_EQ(Path(c.data.what, c.ask(), {}).made.refused,
              "drr cuts off some of the values from -3024 to 1500, and a slice knows only what "
              "rays add up");
    for (const double low : {-1000.1, -1024.0, -2000.0, -1e30}) {
        c.scene.low = low;
        EXPECT_NE(no_pixel_of_sum(c.want, c.scene), "") << low;
    }
    for (const double low : {-1000.0, -999.0, 0.0}) {
        c.scene.low = low;
        EXPECT_EQ(no_pixel_of_sum(c.want, c.scene), "") << low;
    }
    // All of it air or less: no ray loses any light, whatever it adds up to.
    c.scene.low = -3000, c.scene.high = -1000;
    EXPECT_EQ(no_pixel_of_sum(c.want, c.scene), "");
    // Sums and means count every value.
    for (const Mode mode : {Mode::xray, Mode::mean}) {
        c.want.mode = mode;
        c.scene.low = -3e4, c.scene.high = 7e4;
        EXPECT_EQ(no_pixel_of_sum(c.want, c.scene), "");
    }
}

TEST(SpectrumRadiograph, RefusesACue) {
    Case c;
    c.want.cue = DepthCue{};
    EXPECT_NE(Path(c.data.what, c.ask(), {}).made.refused, "");
}

/// Columns of samples, summed in f64: the spline through a smooth body adds up to its samples.
TEST(SpectrumRadiograph, AxisViewsAreExponentialsOfSums) {
    for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(1, 1, 2.5)}) {
        Case c(spacing);
        // Pixels on columns.
        c.want.screen = {c.extent.x, c.extent.y, 1};
        Mat4 deep = Mat4::Identity();
        deep(2, 2) = spacing[2];
        c.want.views = Placement(deep);
        c.want.frames = 1;
        const Data picture = c.picture({8, 2, "volume"}, 0);
        const Extent& n = c.extent;
        double worst = 0, largest = 0;
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                double sum = 0;
                for (std::int64_t z = 0; z < n.z; ++z)
                    sum += 1 + c.data.as<float>()[(z * n.y + y) * n.x + x] / 1000.;
                const double got = picture.as<float>()[y * n.x + x];
                worst = std::max(worst, std::abs(got - std::exp(-kWater * spacing[2] * sum)));
                largest = std::max(largest, kWater * spacing[2] * sum);
            }
        EXPECT_GT(largest, 0.1);
        // The exponent lacks what two axes have beyond 3/4 of a cycle, and exp(-x) changes by no
        // more than x.
        EXPECT_LT(worst, 2 * beyond(kWidth) * largest);
    }
}

/// A Gaussian adds up to sqrt(2 pi) width times itself along any line through isotropic samples.
TEST(SpectrumRadiograph, ObliqueViewsOfGaussiansAreKnown) {
    Case c;
    for (const int view : {1, 2}) {
        const Data picture = c.picture({8, 2, "volume"}, view);
        const Mat4 map = c.want.views.at(view).matrix();
        const auto place = [&](double fx, double fy, double fz) {
            return Eigen::Vector4d(map * Eigen::Vector4d(fx * double(c.extent.x),
                                                         fy * double(c.extent.y),
                                                         fz * double(c.extent.z), 1));
        };
        const Eigen::Vector4d one = place(0.45, 0.5, 0.5), other = place(0.62, 0.45, 0.55);
        double worst = 0;
        for (std::int64_t y = 0; y < c.want.screen.y; ++y)
            for (std::int64_t x = 0; x < c.want.screen.x; ++x) {
                const auto seen = [&](const Eigen::Vector4d& at) {
                    return std::exp(
                        -(std::pow(double(x) - at[0], 2) + std::pow(double(y) - at[1], 2)) /
                        (2 * kWidth * kWidth));
                };
                const double sum =
                    std::sqrt(2 * M_PI) * kWidth * (1.8 * seen(one) + 0.9 * seen(other));
                const double got = picture.as<float>()[y * c.want.screen.x + x];
                worst = std::max(worst, std::abs(got - std::exp(-kWater * sum)));
            }
        // The spline differs from the Gaussian by all that repeats, along three axes.
        EXPECT_LT(worst, 3 * beyond(kWidth) * kWater * 2.7 * std::sqrt(2 * M_PI) * kWidth);
    }
}

TEST(SpectrumRadiograph, BytesDoNotDependOnThreads) {
    Case c(Vec3(0.8, 1, 1.7));
    std::vector<std::vector<float>> pictures;
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Data picture = c.picture({4, 1.25, "volume"}, 2);
        pictures.emplace_back(picture.as<float>(),
                              picture.as<float>() + picture.what.extent.samples());
    }
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST(SpectrumRadiograph, NoPixelIsBrighterThanItsSource) {
    // Ghosts of two taps without padding are as bright as the object.
    Case c;
    for (const int view : {0, 1, 2}) {
        const Data picture = c.picture({2, 1, "volume"}, view);
        for (std::int64_t i = 0; i < picture.what.extent.samples(); ++i) {
            ASSERT_LE(picture.as<float>()[i], 1);
            ASSERT_GE(picture.as<float>()[i], 0);
        }
    }
}

TEST(SpectrumRadiograph, OneVoxelThinAndConstantVolumes) {
    for (const Extent& extent : {Extent{1, 1, 1}, Extent{20, 17, 1}, Extent{1, 30, 2}})
        for (const double value : {-1000., 0., 3000.}) {
            std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
            Representation what;
            what.extent = extent;
            Data data = Data::make(what, memory);
            std::fill_n(data.as<float>(), extent.samples(), static_cast<float>(value));
            const Request want = request_of(extent, Vec3(1, 1, 1), drr(), 0.5);
            const Scene scene = scene_of(data);
            const Ask ask{want, scene};
            const Path path(data.what, ask, {});
            ASSERT_EQ(path.made.refused, "");
            const Data picture = path.picture(path.spectrum(data, ask, memory), ask, 0, memory);
            const Extent& seen = picture.what.extent;
            // A constant is nothing but chords, which are exact.
            EXPECT_NEAR(picture.as<float>()[seen.y / 2 * seen.x + seen.x / 2],
                        std::exp(-kWater * static_cast<double>(extent.z) * (1 + value / 1000)),
                        1e-6);
        }
}

/// Without a preview an error is that of the exponent at its steepest, which no pixel exceeds.
TEST(SpectrumRadiograph, PredictedWithoutAPreviewIsNeverTooSmall) {
    Case c;
    double worst = 0;
    const Data best = c.picture({8, 2, "volume"}, 2), some = c.picture({4, 1.25, "volume"}, 2);
    for (std::int64_t i = 0; i < best.what.extent.samples(); ++i)
        worst += std::pow(best.as<float>()[i] - some.as<float>()[i], 2);
    worst = std::sqrt(worst / static_cast<double>(best.what.extent.samples()));
    EXPECT_GT(worst, 0);
    EXPECT_LT(worst, Path(c.data.what, c.ask(), {4, 1.25, "volume"}).error(c.ask()));
}

}  // namespace
}  // namespace edgewise
