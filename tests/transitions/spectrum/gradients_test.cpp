#include "transitions/spectrum/gradients.hpp"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/transitions/kernels/spline_slopes.hpp"
#include "tests/transitions/spectrum/spectrum_scene.hpp"
#include "transitions/spectrum/faded_picture.hpp"
#include "transitions/spectrum/lit_slice.hpp"

namespace edgewise {
namespace {

struct LitPath : SlicePath {
    LitPath(const Representation& from, const Ask& ask, double degree, double width = 6,
            double padding = 2, const char* band = "volume")
        : SlicePath{
              spectrum_gradients(), spectrum_lit_slice(), spectrum_faded_picture(), {}, {}, {}} {
        choose(from, ask, {{"degree", degree}, {"width", width}, {"padding", padding}}, band);
    }
};

struct Case {
    Extent extent{20, 18, 16};
    Counting memory;
    Data data = blobs(extent, 0, &memory);
    Request want = request_of(extent, Vec3(1, 1, 1), Mode::xray, 1);
    Scene scene = scene_of(data);

    explicit Case(Shade by = Shade::hemisphere) { want.shading.by = by; }
    Ask ask() const { return {want, scene}; }
    std::string refusal(double degree = 1, double width = 6) const {
        return LitPath(data.what, ask(), degree, width).made.refused;
    }
};

/// Least squares over the sphere, where cosines are spread evenly.
TEST(LightHarmonics, AreTheNearestToTheCosineOfOneSide) {
    for (const int degree : {1, 2}) {
        const LightHarmonics by(Shade::lambert, degree);
        constexpr int kParts = 20000;
        double largest = 0, of_one = 0, of_cosine = 0, of_square = 0;
        for (int i = 0; i < kParts; ++i) {
            const double c = -1 + (i + 0.5) * 2 / kParts;
            const double off = by.even0 + c / 2 + by.even2 * c * c - std::max(0., c);
            largest = std::max(largest, std::abs(off));
            of_one += off / kParts;
            of_cosine += c * off / kParts;
            of_square += c * c * off / kParts;
        }
        EXPECT_NEAR(largest, by.largest, 1e-4) << degree;
        EXPECT_NEAR(of_one, 0, 1e-8) << degree;
        EXPECT_NEAR(of_cosine, 0, 1e-8) << degree;
        if (degree == 2) {
            EXPECT_NEAR(of_square, 0, 1e-8);
        }
    }
    const LightHarmonics whole(Shade::hemisphere, 1);
    EXPECT_EQ(whole.even0, 0.5);
    EXPECT_EQ(whole.even2, 0);
    EXPECT_EQ(whole.largest, 0);
}

TEST(SpectrumGradients, RefuseWhatTheyCannotDo) {
    Case c;
    EXPECT_EQ(c.refusal(), "");
    EXPECT_EQ(c.refusal(2), "light from a hemisphere is of degree 1");
    EXPECT_EQ(c.refusal(1.5), "a degree of 1.5: harmonics are of degree 1 or 2");
    EXPECT_EQ(c.refusal(1, 5),
              "no window of width 5 for padding 2: gradients take 4 and 6, with 1.25, 1.5 and 2");
    c.want.shading.by = Shade::lambert;
    EXPECT_EQ(c.refusal(2), "");
    c.want.shading.by = Shade::none;
    EXPECT_EQ(c.refusal(), "no light falls on samples: one spectrum has it all");
    c.want.shading.by = Shade::phong;
    EXPECT_EQ(Message(c.refusal()).text(), "shade=phong is no sum over samples");
    c.want.shading.by = Shade::hemisphere;
    c.want.cue = DepthCue{0.02, true};
    EXPECT_EQ(c.refusal(), "light falls off along rays, and a slice of a spectrum sums them alike");
    c.want.cue.reset();
    std::vector<Mat4> maps;
    for (int view = 0; view < c.want.frames; ++view) maps.push_back(c.want.views.at(view).matrix());
    maps.back().row(0) *= 1.01;
    c.want.views = Placement::each(std::move(maps));
    EXPECT_EQ(c.refusal(),
              "views that stretch the volume: gradients are longer in some than in others");
}

TEST(SpectrumGradients, VerticesTellDegreeAndWindow) {
    const Case c(Shade::lambert);
    for (int degree = 1; degree <= 2; ++degree) {
        const LitPath path(c.data.what, c.ask(), degree, 4, 1.25);
        EXPECT_EQ(path.made.to.kind(),
                  fmt::format("object/gradients+degree{}+window4x1.25", degree));
        EXPECT_EQ(
            gradient_spectra().one_of(path.made.to).samples() * gradient_spectra().count(degree),
            path.made.to.samples());
        EXPECT_TRUE(is_target(path.seen.to, c.want));
    }
}

/// Lengths of the gradients of the spline through samples, x fastest, in f64.
std::vector<double> lengths_of(const Data& data) {
    const Extent& n = data.what.extent;
    const std::int64_t strides[3] = {1, n.x, n.x * n.y};
    std::vector<double> squares(static_cast<std::size_t>(n.samples()));
    for (int axis = 0; axis < 3; ++axis)
        for (std::int64_t first = 0; first < n.samples(); ++first) {
            if (first / strides[axis] % n[axis] != 0) continue;
            Eigen::VectorXd line(n[axis]);
            for (std::int64_t i = 0; i < n[axis]; ++i)
                line[i] = static_cast<double>(data.as<float>()[first + i * strides[axis]]);
            const Eigen::VectorXd slopes = spline_slopes(line);
            for (std::int64_t i = 0; i < n[axis]; ++i)
                squares[static_cast<std::size_t>(first + i * strides[axis])] +=
                    slopes[i] * slopes[i];
        }
    for (double& value : squares) value = std::sqrt(value);
    return squares;
}

/// Along an axis the pictures of a light and of its opposite add up to sums of samples and of
/// lengths of gradients: what is derived is gone, and a band-limited field runs through its
/// samples.
TEST(SpectrumGradients, AxisViewsAreSums) {
    Case c;
    c.want.field = Field::formula;
    // Voxels fall onto pixels.
    std::vector<Mat4> maps;
    for (int view = 0; view < c.want.frames; ++view) {
        maps.push_back(c.want.views.at(view).matrix());
        for (int axis = 0; axis < 2; ++axis)
            maps.back()(axis, 3) = std::round(maps.back()(axis, 3));
    }
    c.want.views = Placement::each(std::move(maps));
    const std::vector<double> lengths = lengths_of(c.data);
    for (const Shade by : {Shade::hemisphere, Shade::lambert}) {
        std::vector<Data> pictures;
        const Vec3 towards(0.6, 0, -0.8);
        for (const double sign : {1., -1.}) {
            c.want.shading.by = by;
            c.want.shading.material = {0.3, 0.8, 0, 1};
            c.want.shading.lights = {{sign * towards, 1.5}};
            const LitPath path(c.data.what, c.ask(), 1, 6, 2, "picture");
            ASSERT_EQ(path.made.refused, "");
            const Data spectra = path.spectrum(c.data, c.ask(), &c.memory);
            pictures.push_back(path.picture(spectra, c.ask(), 0, &c.memory));
        }
        const double even = by == Shade::hemisphere ? 1. / 2 : 1. / 4;
        const Mat4 map = c.want.views.at(0).matrix();
        double largest = 0;
        for (std::int64_t y = 0; y < c.extent.y; ++y)
            for (std::int64_t x = 0; x < c.extent.x; ++x) {
                double sum = 0;
                for (std::int64_t z = 0; z < c.extent.z; ++z) {
                    const auto i = (z * c.extent.y + y) * c.extent.x + x;
                    sum += 0.3 * static_cast<double>(c.data.as<float>()[i]) +
                           0.8 * 1.5 * even * lengths[static_cast<std::size_t>(i)];
                }
                const auto px = static_cast<std::int64_t>(map(0, 3)) + x,
                           py = static_cast<std::int64_t>(map(1, 3)) + y;
                const std::int64_t at = py * pictures[0].what.extent.x + px;
                const double got = (static_cast<double>(pictures[0].as<float>()[at]) +
                                    static_cast<double>(pictures[1].as<float>()[at])) /
                                   2;
                largest = std::max(largest, std::abs(sum));
                // Ghosts of the widest of these windows: 4.5e-6 on the mean, 4e-5 at most.
                ASSERT_NEAR(got, sum, 4e-5 * 1000) << x << " " << y;
            }
        EXPECT_GT(largest, 500);
        EXPECT_LT(largest, 1000);
    }
}

}  // namespace
}  // namespace edgewise
