#include "transitions/kernels/hartley.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <vector>

#include "tests/transitions/kernels/spectrum_testing.hpp"

namespace edgewise::kernels {
namespace {

double cas(double turns) { return std::cos(2 * kPi * turns) + std::sin(2 * kPi * turns); }

/// The samples as a spectrum has them: weighed, from the origin voxel on. In f64.
struct Weighed {
    Extent extent;
    std::array<std::int64_t, 3> origin;
    std::vector<double> samples;

    Weighed(const PlainVolume& volume, const SpectrumShape& shape)
        : extent(volume.extent), origin(shape.origin()) {
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x) {
                    const std::array<std::int64_t, 3> at{x, y, z};
                    double value = volume.at(x, y, z);
                    for (int axis = 0; axis < 3; ++axis)
                        value /=
                            shape.window.transform(static_cast<double>(at[axis] - origin[axis]) /
                                                   static_cast<double>(shape.period[axis]));
                    samples.push_back(value);
                }
    }
    /// The sum of samples times what `kernel` makes of the phases along x, y and z [turns].
    template <class Kernel>
    double sum(const std::array<std::int64_t, 3>& k, const Extent& period,
               const Kernel& kernel) const {
        double sum = 0;
        std::size_t i = 0;
        const auto turns = [&](int axis, std::int64_t at) {
            return static_cast<double>(k[axis] * (at - origin[axis])) /
                   static_cast<double>(period[axis]);
        };
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x)
                    sum += samples[i++] * kernel(turns(0, x), turns(1, y), turns(2, z));
        return sum;
    }
};

std::vector<float> hartley_of(const PlainVolume& volume, const SpectrumShape& shape) {
    const std::vector<Complex> spectrum = spectrum_of(volume, shape);
    const Extent stored = HartleyShape::stored_of(shape.period);
    std::vector<float> out(stored.samples() + 16, 7.f);
    hartley_of_spectrum({spectrum.data(), Type::c64, shape.stored(), 1, {}}, shape.period,
                        out.data(), {});
    return out;
}

constexpr std::array<std::array<std::int64_t, 3>, 8> kFrequencies = {
    {{0, 0, 0}, {3, 2, 1}, {-2, 5, 15}, {-4, 0, 3}, {8, 8, 8}, {7, -3, 2}, {1, 0, 0}, {0, 9, 4}}};

TEST(Hartley, IsTheTransformByCasOfTheWholePhase) {
    for (const Extent extent : {Extent{7, 6, 5}, Extent{8, 1, 3}, Extent{1, 1, 1}}) {
        const PlainVolume volume = noise(extent, 0);
        const SpectrumShape shape(extent, KaiserBessel(5, 1.5));
        const Weighed weighed(volume, shape);
        const std::vector<float> got = hartley_of(volume, shape);
        const Extent stored = HartleyShape::stored_of(shape.period);
        const double most =
            std::abs(weighed.sum({0, 0, 0}, shape.period, [](auto...) { return 1; }));
        for (const std::array<std::int64_t, 3>& k : kFrequencies) {
            const double whole = weighed.sum(
                k, shape.period, [](double a, double b, double c) { return cas(a + b + c); });
            // The same of the product of cas along each axis, as rows and columns give it.
            const auto product = [&](int x, int y, int z) {
                return weighed.sum(
                    {x * k[0], y * k[1], z * k[2]}, shape.period,
                    [](double a, double b, double c) { return cas(a) * cas(b) * cas(c); });
            };
            const double mended =
                (product(-1, 1, 1) + product(1, -1, 1) + product(1, 1, -1) - product(-1, -1, -1)) /
                2;
            EXPECT_NEAR(mended, whole, 1e-12 * most);
            const auto at = [](std::int64_t i, std::int64_t n) { return (i % n + n) % n; };
            const float stored_there =
                got[(at(k[2], shape.period.z) * stored.y + at(k[1], shape.period.y)) * stored.x +
                    at(k[0], shape.period.x) + HartleyShape::kColumnsBefore];
            EXPECT_NEAR(stored_there, whole, 1e-6 * most);  // f32 rounding of the transform
        }
    }
}

TEST(Hartley, AProductOfCasIsAnotherTransform) {
    const Extent extent{7, 6, 5};
    const PlainVolume volume = noise(extent, 0);
    const SpectrumShape shape(extent, KaiserBessel(5, 1.5));
    const Weighed weighed(volume, shape);
    const std::array<std::int64_t, 3> k{3, 2, 1};
    const double whole =
        weighed.sum(k, shape.period, [](double a, double b, double c) { return cas(a + b + c); });
    const double product = weighed.sum(
        k, shape.period, [](double a, double b, double c) { return cas(a) * cas(b) * cas(c); });
    EXPECT_GT(std::abs(whole - product), 0.01 * std::abs(whole));
}

TEST(Hartley, RepeatsColumnsOnBothSides) {
    const PlainVolume volume = noise({9, 7, 6}, 0);
    const SpectrumShape shape(volume.extent, KaiserBessel(8, 1.25));
    const std::vector<float> got = hartley_of(volume, shape);
    const Extent stored = HartleyShape::stored_of(shape.period);
    EXPECT_EQ(HartleyShape::period_of(stored).x, shape.period.x);
    for (std::int64_t row = 0; row < stored.y * stored.z; ++row)
        for (std::int64_t i = 0; i + shape.period.x < stored.x; ++i)
            ASSERT_EQ(got[row * stored.x + i], got[row * stored.x + i + shape.period.x]);
    EXPECT_EQ(got[stored.samples()], 7.f);
}

/// Slices through both forms, read by windows of every width.
TEST(Hartley, SlicesAgreeWithThoseOfTheHalfSpectrum) {
    for (const Extent extent : {Extent{19, 22, 17}, Extent{1, 12, 5}}) {
        const PlainVolume volume = noise(extent, 0);
        const Affine m = turned(extent, {0.4, -0.7, 2.9}, {1, 1.3, 0.8}, 14.2, 15.1);
        for (const KaiserBessel& window : known_windows()) {
            const SpectrumShape shape(extent, window);
            const std::vector<Complex> spectrum = spectrum_of(volume, shape);
            const std::vector<float> hartley = hartley_of(volume, shape);
            SliceView view;
            view.to_screen = m;
            view.width = 40;
            view.height = 45;
            const Region all = Region::all(view.stored());
            std::vector<Complex> half(view.stored().samples()), real(half.size());
            slice_of_spectrum({spectrum.data(), Type::c64, shape.stored(), 1, {}}, shape.period,
                              window, view, half.data(), all, all, kMemory, {});
            slice_of_spectrum(
                {hartley.data(), Type::f32, HartleyShape::stored_of(shape.period), 1, {}},
                shape.period, window, view, real.data(), all, all, kMemory, {});
            double difference = 0, energy = 0;
            for (std::size_t i = 0; i < half.size(); ++i) {
                difference += std::norm(half[i] - real[i]);
                energy += std::norm(half[i]);
            }
            // width^3 products in f32, each 2^-24 off, of weights that the window made larger by
            // the cube of what it amplifies.
            const double grown = std::pow(std::max(1., window.amplified()), 3);
            EXPECT_LT(std::sqrt(difference / energy), 3e-7 * grown)
                << window.width() << " " << window.padding();
        }
    }
}

TEST(Hartley, BytesDoNotDependOnThreads) {
    const PlainVolume volume = noise({20, 15, 17}, 0);
    const SpectrumShape shape(volume.extent, KaiserBessel(3, 1.5));
    std::vector<std::vector<float>> made;
    for (const std::size_t threads : {1, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        made.push_back(hartley_of(volume, shape));
    }
    EXPECT_EQ(made[0], made[1]);
}

}  // namespace
}  // namespace edgewise::kernels
