#include <gtest/gtest.h>
#include <random>

#include "reference/answer.hpp"
#include "tests/transitions/spectrum/spectrum_scene.hpp"

namespace edgewise {
namespace {

/// Pixels of all views that see the volume, and the reference there.
struct Truth {
    std::vector<OutputSample> at;
    std::vector<double> values;
    double range = 1;

    Truth(const Request& want, const Data& data, std::pmr::memory_resource* memory) {
        const ReferenceField field(data, want.field);
        const Reference reference(want, field, memory);
        std::mt19937 random(5);
        while (at.size() < 400) {
            const OutputSample sample{static_cast<int>(random() % want.frames),
                                      static_cast<std::int64_t>(random() % want.screen.x),
                                      static_cast<std::int64_t>(random() % want.screen.y), 0};
            if (reference.sees_input(sample)) at.push_back(sample);
        }
        values = reference.values(at);
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        range = *high - *low;
    }
};

struct Measured {
    double error = 0, predicted = 0;  // NRMSE
};

Measured measure(const Data& data, const Request& want, const Chosen& chosen) {
    std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
    const Truth truth(want, data, memory);
    Scene scene = scene_of(data);
    scene.range = truth.range;
    const Ask ask{want, scene};
    const Path path(data.what, ask, chosen);
    const Data spectrum = path.spectrum(data, ask, memory);
    std::vector<Data> pictures;
    for (int view = 0; view < want.frames; ++view)
        pictures.push_back(path.picture(spectrum, ask, view, memory));
    double squares = 0;
    for (std::size_t i = 0; i < truth.at.size(); ++i) {
        const OutputSample& at = truth.at[i];
        const float got = pictures[at.view].as<float>()[at.y * want.screen.x + at.x];
        squares += std::pow(got - truth.values[i], 2);
    }
    return {std::sqrt(squares / static_cast<double>(truth.at.size())) / truth.range,
            path.error(ask) / truth.range};
}

const Extent kExtent{36, 30, 24};

/// Predictions are made of the largest errors that scans gave: never far below the truth, and
/// within a factor of 20 above it.
void expect_predicted(const Measured& measured) {
    EXPECT_LT(measured.error, 1.2 * measured.predicted);
    EXPECT_GT(measured.error, measured.predicted / 20);
}

TEST(SpectrumAccuracy, XrayOfTheSplineField) {
    const Data data = blobs(kExtent, 0, std::pmr::new_delete_resource());
    for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(0.7, 0.7, 1.5)}) {
        const Request want = request_of(kExtent, spacing, Mode::xray, spacing.minCoeff());
        const Measured coarse = measure(data, want, {4, 1.25, "volume"});
        expect_predicted(coarse);
        EXPECT_LT(coarse.error, 3e-3);
        const Measured fine = measure(data, want, {6, 1.25, "volume"});
        expect_predicted(fine);
        EXPECT_LT(fine.error, 1e-3);
    }
}

/// What lies beyond the picture's band is not measured: a face along the rays rings by up to a
/// tenth of what it bounds.
TEST(SpectrumAccuracy, ThePicturesOwnBandPromisesNothing) {
    std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
    const Data data = blobs(kExtent, 0, memory);
    const Request want = request_of(kExtent, Vec3(1, 1, 1), Mode::xray, 2);
    const Scene scene = scene_of(data);
    const Ask ask{want, scene};
    for (const bool whole : {true, false}) {
        const Path path(data.what, ask, {6, 1.25, whole ? "volume" : "picture"});
        EXPECT_EQ(path.slice.error(path.cut, ask).known, whole);
    }
}

TEST(SpectrumAccuracy, XrayOfTheTrilinearField) {
    const Data data = blobs(kExtent, 0, std::pmr::new_delete_resource());
    Request want = request_of(kExtent, Vec3(1, 1, 1), Mode::xray, 1);
    want.field = Field::linear;
    expect_predicted(measure(data, want, {6, 1.25, "volume"}));
}

TEST(SpectrumAccuracy, PixelsLargerAndSmallerThanVoxels) {
    const Data data = blobs(kExtent, 0, std::pmr::new_delete_resource());
    for (const double pixel : {0.4, 2.7}) {
        const Request want = request_of(kExtent, Vec3(1, 1, 1), Mode::xray, pixel);
        expect_predicted(measure(data, want, {6, 1.25, "volume"}));
    }
}

TEST(SpectrumAccuracy, AConstantFarFromZeroCostsNothing) {
    // 1e5 beside values of 0..120: f32 holds them to 1/128, and no more may be lost.
    const Data data = blobs(kExtent, 1e5, std::pmr::new_delete_resource());
    Request want = request_of(kExtent, Vec3(1, 1, 1), Mode::xray, 1);
    want.zero = 1e5;
    EXPECT_LT(measure(data, want, {6, 1.25, "volume"}).error, 1e-3);
    want.zero = 1e5 - 40;  // the constant's chords are added exactly
    EXPECT_LT(measure(data, want, {6, 1.25, "volume"}).error, 1e-3);
}

TEST(SpectrumAccuracy, MeanDividesByTheLengthInside) {
    const Data data = blobs(kExtent, 50, std::pmr::new_delete_resource());
    const Request want = request_of(kExtent, Vec3(1, 1, 1.3), Mode::mean, 1);
    const Measured fine = measure(data, want, {6, 1.25, "volume"});
    EXPECT_LT(fine.error, 1.2 * fine.predicted);
    EXPECT_LT(fine.error, 3e-3);
}

TEST(SpectrumAccuracy, OneVoxelAndThinVolumesAreOrdinary) {
    for (const Extent& extent : {Extent{1, 1, 1}, Extent{20, 17, 1}, Extent{1, 30, 2}}) {
        std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
        Representation what;
        what.extent = extent;
        Data data = Data::make(what, memory);
        std::fill_n(data.as<float>(), extent.samples(), 3.f);
        const Request want = request_of(extent, Vec3(1, 1, 1), Mode::xray, 0.5);
        const Scene scene = scene_of(data);
        const Ask ask{want, scene};
        const Path path(data.what, ask, {});
        ASSERT_EQ(path.made.refused, "");
        const Data picture = path.picture(path.spectrum(data, ask, memory), ask, 0, memory);
        // A constant is nothing but chords, which are exact: seen along z, 3 x thickness.
        const Extent& seen = picture.what.extent;
        EXPECT_NEAR(picture.as<float>()[seen.y / 2 * seen.x + seen.x / 2],
                    3. * static_cast<double>(extent.z), 1e-5);
    }
}

}  // namespace
}  // namespace edgewise
