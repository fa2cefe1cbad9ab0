#include "transitions/kernels/spectrum_slice.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <vector>

#include "tests/transitions/kernels/spectrum_testing.hpp"

namespace edgewise::kernels {
namespace {

TEST(Slice, AxisViewsAreSums) {
    for (const Extent extent : {Extent{12, 12, 12}, Extent{11, 9, 13}, Extent{16, 9, 1}}) {
        const PlainVolume volume = noise(extent, 0);
        for (int axis = 0; axis < 3; ++axis) {
            // The next two axes become x and y of the picture.
            const int ax = (axis + 1) % 3, ay = (axis + 2) % 3;
            Affine m{};
            m[ax] = m[4 + ay] = m[8 + axis] = 1;
            const Extent picture{extent[ax], extent[ay], 1};
            std::vector<double> want(picture.samples());
            for (std::int64_t z = 0; z < extent.z; ++z)
                for (std::int64_t y = 0; y < extent.y; ++y)
                    for (std::int64_t x = 0; x < extent.x; ++x) {
                        const std::int64_t at[3] = {x, y, z};
                        want[at[ay] * picture.x + at[ax]] += volume.at(x, y, z);
                    }
            // Frequencies on the grid of the picture: the window's ghosts alone are left.
            const auto got =
                project(volume, m, picture, {.between = Between::band, .folded = false});
            EXPECT_LT(nrmse(got, want), 3e-5) << axis;
            // Those of the widest window are fainter than rounding.
            const auto best = project(volume, m, picture, {8, 2, Between::band, false, 0});
            const double largest = *std::max_element(want.begin(), want.end());
            for (std::size_t i = 0; i < want.size(); ++i)
                ASSERT_NEAR(best[i], want[i], 1e-6 * largest) << axis;
        }
    }
}

/// Gaussians in voxels of two sizes, off the centre; their projections are known.
struct Blobs {
    static constexpr double kWidth = 2.4;  // standard deviation [smallest voxel]
    Extent extent{45, 46, 41};
    std::array<double, 3> scale{1, 1, 1.25};
    std::array<std::array<double, 3>, 3> centres{{{14, 31.5, 17}, {30, 15, 29.2}, {20.4, 22, 12}}};
    PlainVolume volume{extent};

    Blobs() {
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x) {
                    double sum = 0;
                    for (const auto& centre : centres) {
                        const double at[3] = {static_cast<double>(x), static_cast<double>(y),
                                              static_cast<double>(z)};
                        double squares = 0;
                        for (int axis = 0; axis < 3; ++axis)
                            squares += std::pow((at[axis] - centre[axis]) * scale[axis], 2);
                        sum += std::exp(-squares / (2 * kWidth * kWidth));
                    }
                    volume.at(x, y, z) = static_cast<float>(sum);
                }
    }
    std::vector<double> seen(const Affine& m, const Extent& picture) const {
        std::vector<double> pixels(picture.samples());
        for (const auto& centre : centres) {
            const auto at = apply(m, centre[0], centre[1], centre[2]);
            for (std::int64_t y = 0; y < picture.y; ++y)
                for (std::int64_t x = 0; x < picture.x; ++x)
                    pixels[y * picture.x + x] +=
                        kWidth * std::sqrt(2 * kPi) *
                        std::exp(-(std::pow(static_cast<double>(x) - at[0], 2) +
                                   std::pow(static_cast<double>(y) - at[1], 2)) /
                                 (2 * kWidth * kWidth));
        }
        return pixels;
    }
};

TEST(Slice, ViewsStayWithinTheBoundOfEveryWindow) {
    const Blobs blobs;
    const Extent picture{60, 57, 1};
    for (const std::array<double, 3> angles :
         {std::array<double, 3>{kPi / 4, 0, 0}, {kPi / 4, kPi / 4, kPi / 4}, {2.5, -1.2, 3}}) {
        const Affine m = turned(blobs.extent, angles, blobs.scale, 29.3, 28.8);
        const auto want = blobs.seen(m, picture);
        const double largest = *std::max_element(want.begin(), want.end());
        for (const KaiserBessel& window : known_windows()) {
            const auto got = project(blobs.volume, m, picture,
                                     {window.width(), window.padding(), Between::band, true, 0});
            double wrong = 0;
            for (std::size_t i = 0; i < want.size(); ++i)
                wrong = std::max(wrong, std::abs(got[i] - want[i]));
            // Ghosts of ghosts along three axes. f32: 2^-24 for each of some additions, times what
            // the window makes of it. The Gaussians end at the faces, 5e-6 high.
            const double bound = std::pow(1 + window.bound(), 3) - 1;
            const double grown = std::pow(std::max(1., window.amplified()), 3);
            EXPECT_LT(wrong, (bound + 5e-7 * grown + 5e-6) * largest)
                << window.width() << " " << window.padding();
            // Wide windows are held to what f32 leaves, and no bound is idle.
            if (bound < 1e-5) {
                EXPECT_LT(wrong, 2e-6 * largest) << window.width();
            }
            if (bound > 1e-2) {
                EXPECT_GT(wrong, 1e-3 * bound * largest) << window.width();
            }
        }
    }
}

TEST(Slice, ObliqueViewsOfAGaussianAreGaussians) {
    const double width = 2.5;  // standard deviation [voxel]: 1e-8 of it is above the band
    const std::array<double, 3> centre{13.2, 17.9, 15.4};
    for (const std::array<double, 3> angles :
         {std::array<double, 3>{0.3, 0.5, -0.2}, {kPi / 4, 0, 0}, {2.5, -1.2, 3}}) {
        const std::array<double, 3> scale{1, 1, 1};
        const Extent extent{31, 34, 32}, picture{40, 33, 1};
        PlainVolume volume(extent);
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x)
                    volume.at(x, y, z) = static_cast<float>(
                        std::exp(-(std::pow(static_cast<double>(x) - centre[0], 2) +
                                   std::pow(static_cast<double>(y) - centre[1], 2) +
                                   std::pow(static_cast<double>(z) - centre[2], 2)) /
                                 (2 * width * width)));
        const Affine m = turned(extent, angles, scale, 21.3, 15.8);
        const auto at = apply(m, centre[0], centre[1], centre[2]);
        std::vector<double> want(picture.samples());
        for (std::int64_t y = 0; y < picture.y; ++y)
            for (std::int64_t x = 0; x < picture.x; ++x)
                want[y * picture.x + x] = width * std::sqrt(2 * kPi) *
                                          std::exp(-(std::pow(static_cast<double>(x) - at[0], 2) +
                                                     std::pow(static_cast<double>(y) - at[1], 2)) /
                                                   (2 * width * width));
        for (const bool folded : {false, true}) {
            const auto got =
                project(volume, m, picture, {.between = Between::band, .folded = folded});
            EXPECT_LT(nrmse(got, want), 1e-5);
            const auto coarse = project(volume, m, picture, {4, 1.25, Between::band, folded, 0});
            EXPECT_LT(nrmse(coarse, want), 4e-3);
        }
    }
}

/// Of blobs, whose gradients are known: -f (x - c) scale^2 / width^2 by voxel.
TEST(Slice, TakesDerivativesAlong) {
    const Blobs blobs;
    const Extent picture{60, 57, 1};
    const std::array<double, 3> angles{2.5, -1.2, 3}, along{0.7, -0.4, 0.5};
    const Affine m = turned(blobs.extent, angles, blobs.scale, 29.3, 28.8);
    // The integral of along . gradient f is the derivative of the picture along what the view makes
    // of that vector: what lies along the rays adds up to nothing.
    std::array<double, 2> moved{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t row = 0; row < 2; ++row) moved[row] += m[4 * row + axis] * along[axis];
    std::vector<double> want(static_cast<std::size_t>(picture.samples()));
    for (const auto& centre : blobs.centres) {
        const auto at = apply(m, centre[0], centre[1], centre[2]);
        for (std::int64_t y = 0; y < picture.y; ++y)
            for (std::int64_t x = 0; x < picture.x; ++x) {
                const double dx = static_cast<double>(x) - at[0],
                             dy = static_cast<double>(y) - at[1];
                const double squares = Blobs::kWidth * Blobs::kWidth;
                const double sum = Blobs::kWidth * std::sqrt(2 * kPi) *
                                   std::exp(-(dx * dx + dy * dy) / (2 * squares));
                want[static_cast<std::size_t>(y * picture.x + x)] +=
                    sum * (0.25 - (dx * moved[0] + dy * moved[1]) / squares);
            }
    }
    for (const bool folded : {true, false}) {
        const auto got =
            project(blobs.volume, m, picture, {8, 2, Between::band, folded, 0, 0.25, along});
        EXPECT_LT(nrmse(got, want), 1e-5) << folded;
        const auto spline =
            project(blobs.volume, m, picture, {8, 2, Between::spline, folded, 0, 0.25, along});
        EXPECT_LT(nrmse(spline, want), 2e-3) << folded;
    }
}

/// A trilinear field is derived by differences, so a volume of these gives the same picture.
TEST(Slice, OfATrilinearFieldDerivesByDifferences) {
    const Extent n{15, 14, 13}, picture{26, 24, 1};
    const PlainVolume volume = noise(n, 2);
    PlainVolume differences(n);
    const std::array<double, 3> along{0.7, -0.4, 0.5};
    for (std::int64_t z = 1; z + 1 < n.z; ++z)
        for (std::int64_t y = 1; y + 1 < n.y; ++y)
            for (std::int64_t x = 1; x + 1 < n.x; ++x)
                differences.at(x, y, z) = static_cast<float>(
                    along[0] * (volume.at(x + 1, y, z) - volume.at(x - 1, y, z)) / 2 +
                    along[1] * (volume.at(x, y + 1, z) - volume.at(x, y - 1, z)) / 2 +
                    along[2] * (volume.at(x, y, z + 1) - volume.at(x, y, z - 1)) / 2);
    const Affine m = turned(n, {0.4, 0.9, -0.3}, {1, 1, 1}, 12.6, 11.8);
    const auto want = project(differences, m, picture, {8, 2, Between::linear, true, 0});
    const auto got = project(volume, m, picture, {8, 2, Between::linear, true, 0, 0, along});
    const double largest = *std::max_element(want.begin(), want.end());
    for (std::size_t i = 0; i < want.size(); ++i) ASSERT_NEAR(got[i], want[i], 2e-5 * largest);
}

struct Scene {
    Extent extent, picture;
    std::array<double, 3> angles, scale;
    double reach;
};

/// Noise has energy up to the highest frequency, so these are worst cases.
const Scene kScenes[] = {
    {{20, 21, 22}, {24, 23, 1}, {0, 0, 0}, {1, 1, 1}, 20},
    {{20, 21, 22}, {28, 27, 1}, {0.4, -0.7, 0.3}, {1, 1, 1}, 20},
    {{20, 14, 16}, {26, 30, 1}, {0.5, 0.2, 1.1}, {1, 1.5, 2.4}, 28},  // anisotropic voxels
    {{20, 20, 20}, {9, 8, 1}, {0.5, 0.2, 1.1}, {0.4, 0.4, 0.4}, 8},   // a thumbnail
    {{16, 16, 16}, {30, 20, 1}, {0.5, 0.9, 1.1}, {3, 3, 3}, 42},      // part of an enlargement
};

TEST(Slice, AgreesWithIntegralsOfTheSplineField) {
    for (const Scene& scene : kScenes) {
        const PlainVolume volume = noise(scene.extent, 5);  // (sqrt(3) - 2)^5 = 1e-3 at the faces
        const Affine m = turned(scene.extent, scene.angles, scene.scale,
                                static_cast<double>(scene.picture.x) / 2 - 0.7,
                                static_cast<double>(scene.picture.y) / 2 - 0.4);
        const auto want = integrated(coefficients(volume), scene.extent, back_of(m, scene.scale),
                                     scene.picture, scene.reach, cubic);
        const auto got = project(volume, m, scene.picture, {});
        // Of white noise 3e-5 of the energy lies beyond the cutoff, and is left out.
        EXPECT_LT(nrmse(got, want), 1e-3);
    }
}

TEST(Slice, AgreesWithIntegralsOfTheTrilinearField) {
    for (const Scene& scene : kScenes) {
        const PlainVolume volume = noise(scene.extent, 3);
        const Affine m = turned(scene.extent, scene.angles, scene.scale,
                                static_cast<double>(scene.picture.x) / 2 - 0.7,
                                static_cast<double>(scene.picture.y) / 2 - 0.4);
        const std::vector<double> samples(volume.samples.begin(), volume.samples.end());
        const auto want = integrated(samples, scene.extent, back_of(m, scene.scale), scene.picture,
                                     scene.reach, hat);
        const auto got = project(volume, m, scene.picture, {.between = Between::linear});
        // The trilinear field falls off slower: 1e-2 of the energy of white noise is left out.
        EXPECT_LT(nrmse(got, want), 1e-2);
    }
}

/// One bright voxel at x = `at` of a row of voxels, seen across it.
std::vector<float> point_seen(std::int64_t at, const Options& options, const Extent& extent,
                              const Extent& picture) {
    PlainVolume volume(extent);
    volume.at(at, extent.y / 2, extent.z / 2) = 1;
    return project(volume, turned(extent, {0, 0.3, 0}, {1, 1, 1}, 39.5, 4), picture, options);
}

TEST(Slice, GhostsOfAPointStayBelowTheWindowsBound) {
    const Extent extent{64, 9, 9}, picture{80, 9, 1};
    for (const KaiserBessel& window : known_windows()) {
        const int width = window.width();
        const double padding = window.padding();
        const SpectrumShape shape(extent, window);
        for (const std::int64_t at : {32, 40, 48, 56, 60, 63, 0}) {
            const auto ghosted =
                point_seen(at, {width, padding, Between::spline, true, 90}, extent, picture);
            // The centre of a volume has no ghosts to speak of.
            PlainVolume alone({1, 1, 1});
            alone.at(0, 0, 0) = 1;
            Affine m = turned(extent, {0, 0.3, 0}, {1, 1, 1}, 39.5, 4);
            const auto to = apply(m, static_cast<double>(at), static_cast<double>(extent.y / 2),
                                  static_cast<double>(extent.z / 2));
            m[3] = to[0], m[7] = to[1], m[11] = to[2];
            const auto clean = project(alone, m, picture, {8, 2, Between::spline, true, 90});
            double difference = 0, energy = 0;
            for (std::size_t i = 0; i < clean.size(); ++i) {
                difference += std::pow(ghosted[i] - clean[i], 2);
                energy += std::pow(clean[i], 2);
            }
            // Along each axis: ghosts that fall on different pixels, and all on one.
            double squares = 0, most = 1;
            const std::int64_t where[3] = {at, extent.y / 2, extent.z / 2};
            for (int axis = 0; axis < 3; ++axis) {
                const double x = static_cast<double>(where[axis] - shape.origin()[axis]) /
                                 static_cast<double>(shape.period[axis]);
                squares += std::pow(window.ghost(x), 2);
                double sum = 0;
                for (int far = 1; far <= 256; ++far)
                    sum +=
                        std::abs(window.transform(x + far)) + std::abs(window.transform(x - far));
                most *= 1 + sum / window.transform(x);
                EXPECT_LT(sum / window.transform(x), 1.005 * window.bound());
            }
            // A ghost carries at most its amplitude of the point's energy into the picture; 2e-5
            // are rounding and the table of weights.
            const double ghosts = std::sqrt(difference / energy);
            EXPECT_LT(ghosts, most - 1 + 2e-5) << width << " " << padding << " " << at;
            if (width % 2 == 0 && width > 2 && padding != 1.5) {
                EXPECT_LT(ghosts, 1.05 * std::sqrt(squares) + 2e-5)
                    << width << " " << padding << " " << at;
            }
        }
    }
}

TEST(Slice, WeakDetailOverALargeConstantSurvivesSubtraction) {
    const Extent extent{24, 24, 24};
    PlainVolume detail = noise(extent, 0), raised(extent);
    for (std::int64_t i = 0; i < extent.samples(); ++i) {
        detail.samples[i] = std::round(detail.samples[i] * 8);  // exact beside the constant
        raised.samples[i] = detail.samples[i] + 1e6f;
    }
    const SpectrumShape shape(extent, KaiserBessel(6, 1.25));
    const auto want = spectrum_of(detail, shape);
    std::vector<Complex> got(want.size());
    spectrum_of_volume(raised.grid(), 1e6, shape, got.data(), kMemory, {});
    for (std::int64_t i = 0; i < shape.stored().samples(); ++i) ASSERT_EQ(got[i], want[i]);
}

TEST(Slice, BytesDoNotDependOnThreads) {
    const PlainVolume volume = noise({33, 20, 27}, 0);
    const Affine m = turned(volume.extent, {0.4, -0.7, 0.3}, {1, 1, 1}, 20, 20);
    for (const bool folded : {false, true}) {
        std::vector<std::vector<float>> results;
        for (const std::size_t threads : {1, 4}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            results.push_back(
                project(volume, m, {41, 40, 1}, {4, 1.25, Between::spline, folded, 0}));
        }
        EXPECT_EQ(results[0], results[1]);
    }
}

TEST(Slice, StopsWhenAsked) {
    const PlainVolume volume = noise({16, 16, 16}, 0);
    const SpectrumShape shape(volume.extent, KaiserBessel(4, 1.25));
    std::vector<Complex> out(shape.stored().samples() + 8, Complex{7, 7});
    spectrum_of_volume(volume.grid(), 0, shape, out.data(), kMemory, [] { return true; });
    EXPECT_EQ(out[100], Complex(7, 7));
}

TEST(Slice, CountsItsSamples) {
    SliceView view;
    view.to_screen = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    view.width = view.height = 40;
    view.folded = false;
    EXPECT_EQ(slice_samples(view), 21 * 41);  // both signs of the highest ky
    view.folded = true;
    EXPECT_EQ(slice_samples(view), 31 * 61);  // up to 0.75 cycles a voxel
}

}  // namespace
}  // namespace edgewise::kernels
