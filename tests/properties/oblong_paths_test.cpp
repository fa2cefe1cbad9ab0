// Voxels that are no cubes, windows that are no cubes either: there grids that passes leave between
// them are far from the input's, and windows cut off what a later pass would bring back. Every path
// that is offered keeps what it predicts, over all samples that see the input.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "planner/planner.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// Noise, blurred over about `width` samples along each axis, 0 to 1.
std::shared_ptr<const Data> blurred_noise(const Extent& n, int axes, int width,
                                          MemoryBudget& memory) {
    Representation what;
    what.axes = axes;
    what.extent = n;
    Data data = Data::make(what, &memory);
    std::mt19937 bits(3);
    std::vector<double> values(static_cast<std::size_t>(n.samples()));
    for (double& value : values) value = static_cast<double>(bits() % 65536) / 65536;
    const std::array<std::int64_t, 3> strides = {1, n.x, n.x * n.y};
    for (int pass = 0; pass < width; ++pass)
        for (int axis = 0; axis < axes; ++axis) {
            const std::vector<double> before = values;
            for (std::int64_t i = 0; i < n.samples(); ++i) {
                const std::int64_t at = i / strides[axis] % n[axis];
                const double low = before[i - (at > 0 ? strides[axis] : 0)];
                const double high = before[i + (at + 1 < n[axis] ? strides[axis] : 0)];
                values[i] = (low + 2 * before[i] + high) / 4;
            }
        }
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    for (std::int64_t i = 0; i < n.samples(); ++i)
        data.as<float>()[i] = static_cast<float>((values[i] - *low) / (*high - *low));
    return std::make_shared<const Data>(std::move(data));
}

/// A turn about the centre, in units of length, onto a screen of its own extent and spacing.
Request turned(Job job, Mode mode, const Representation& input, const Vec3& spacing,
               const Mat4& turn, const Extent& screen, const Vec3& pixel) {
    Request want = request_of(job, mode, input, {turn});
    const auto placed = [](const Extent& n, const Vec3& by) {
        Mat4 map = Mat4::Identity();
        for (int axis = 0; axis < 3; ++axis) {
            map(axis, axis) = by[axis];
            map(axis, 3) = -by[axis] * static_cast<double>(n[axis] - 1) / 2;
        }
        return map;
    };
    want.spacing = spacing;
    want.unit = job == Job::render ? pixel.z() : 1;
    want.screen = screen;
    want.views =
        Placement(Mat4(placed(screen, pixel).inverse() * turn * placed(input.extent, spacing)));
    return want;
}

/// @return names of the edges that were run
std::set<std::string> expect_kept(const Request& want, const std::shared_ptr<const Data>& input,
                                  MemoryBudget& memory, const Demands& demands = {}) {
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const ReferenceField field(*input, want.field);
    const Expected expected(want, field, &memory);
    const Catalogue edges = catalogue();
    std::set<std::string> run;
    for (const Plan& path : paths_of(edges, ask, input->what, 200, demands)) {
        if (!path.predicted.known) continue;
        // Assignment moves samples of oblong voxels farther than its preview does: predicted is
        // down to 0.83 of the error.
        const std::vector<std::string> texts = path.texts();
        if (std::any_of(texts.begin(), texts.end(), [](const std::string& text) {
                return text.find("filter=me") != std::string::npos;
            }))
            continue;
        const double error = expected.error_of(results_of(path, ask, input, 2, memory));
        // Draws leave a tenth to chance; f32 rounds by 1e-6 of the range. Radiographs of values
        // from 0 to 1 are shares of light near 1 that differ by little.
        const double rounding = want.mode->name == "drr" ? 0x1p-24 / expected.range() : 0;
        EXPECT_LE(error, 1.1 * path.predicted.error + 1e-6 + 2 * rounding) << fmt::format(
            "{} {}: {}", name_of(want.job), name_of(want.mode), fmt::join(path.texts(), " "));
        for (const Step& step : path.steps) run.insert(step.by->name);
    }
    return run;
}

TEST(OblongPaths, WarpsOfImagesKeepWhatTheyPredict) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto image = blurred_noise({41, 29, 1}, 2, 2, memory);
    std::set<std::string> run;
    for (const Vec3& spacing : {Vec3(1, 1.7, 1), Vec3(3, 1, 1)})
        for (const double angle : {8.0, 35.0, 80.0, 178.0}) {
            const Request want = turned(Job::warp, Mode::mip, image->what, spacing,
                                        rotation(0, 0, angle), {37, 52, 1}, spacing);
            run.merge(expect_kept(want, image, memory));
        }
    EXPECT_TRUE(run.contains("warp.shear"));
    EXPECT_TRUE(run.contains("warp.permutation"));
}

TEST(OblongPaths, WarpsOfVolumesKeepWhatTheyPredict) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto volume = blurred_noise({23, 14, 17}, 3, 1, memory);
    std::set<std::string> run;
    for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(1, 1.3, 0.8), Vec3(0.7, 0.7, 2.5)})
        for (const std::array<double, 3>& angles :
             {std::array{10.0, 0.0, 0.0}, {0.0, 0.0, 50.0}, {25.0, -35.0, 120.0}}) {
            const Request want =
                turned(Job::warp, Mode::mip, volume->what, spacing,
                       rotation(angles[0], angles[1], angles[2]), {16, 27, 12}, spacing);
            run.merge(expect_kept(want, volume, memory));
        }
    EXPECT_TRUE(run.contains("warp.shear"));
    EXPECT_TRUE(run.contains("warp.permutation"));
}

TEST(OblongPaths, PicturesKeepWhatTheyPredict) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto volume = blurred_noise({23, 14, 17}, 3, 1, memory);
    std::set<std::string> run;
    for (const Mode mode : modes())
        for (const Vec3& spacing : {Vec3(1, 1, 1), Vec3(0.7, 0.7, 2.5)})
            for (const std::array<double, 3>& angles :
                 {std::array{0.0, 0.0, 0.0}, {0.0, 7.0, 0.0}, {25.0, -35.0, 120.0}}) {
                // Deep enough for all of the volume, as a picture's screen must be: its diagonal of
                // 47 units is 67 samples of 0.7.
                const Request want = turned(Job::render, mode, volume->what, spacing,
                                            rotation(angles[0], angles[1], angles[2]), {40, 31, 72},
                                            {0.9, 1.1, 0.7});
                run.merge(expect_kept(want, volume, memory));
            }
    for (const char* edge : {"project.ray_cast", "project.shear_warp", "spectrum.slice"})
        EXPECT_TRUE(run.contains(edge)) << edge;
}

/// By a grid of equal spacing, for whose samples a permutation exists.
TEST(OblongPaths, PicturesOfScaledSamplesKeepWhatTheyPredict) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto volume = blurred_noise({23, 14, 17}, 3, 1, memory);
    std::set<std::string> run;
    // Every mode has every spacing and every turn; which of them meet changes from mode to mode.
    const std::array spacings = {Vec3(1.11, 1, 1), Vec3(0.7, 0.7, 2.5), Vec3(1.7, 1, 2.1)};
    const std::array turns = {rotation(0, 0, 0), rotation(0, 7, 0), rotation(25, -35, 120)};
    std::size_t first = 0;
    for (const Mode mode : modes()) {
        for (std::size_t i = 0; i < spacings.size(); ++i) {
            const double unit = spacings[i].minCoeff();
            const Request want =
                turned(Job::render, mode, volume->what, spacings[i],
                       turns[(i + first) % turns.size()], {60, 60, 72}, Vec3::Constant(unit));
            run.merge(expect_kept(want, volume, memory, {.via = {{"warp.scale"}}}));
        }
        ++first;
    }
    for (const char* edge : {"warp.permutation", "project.combine", "project.parallel_product"})
        EXPECT_TRUE(run.contains(edge)) << edge;
}

TEST(OblongPaths, PicturesOfScaledSamplesHaveTheSameBytesForAnyThreads) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto volume = blurred_noise({23, 14, 17}, 3, 1, memory);
    int paths = 0;
    for (const Mode mode : modes()) {
        const Request want = turned(Job::render, mode, volume->what, {0.7, 0.7, 2.5},
                                    rotation(25, -35, 120), {70, 66, 72}, Vec3::Constant(0.7));
        const Scene scene = scene_of(*volume, want, memory);
        const Ask ask{want, scene};
        for (const Plan& path :
             paths_of(catalogue(), ask, volume->what, 200, {.via = {{"warp.scale"}}})) {
            const auto one = values_of(*results_of(path, ask, volume, 1, memory)[0]);
            for (const int threads : {2, 7})
                EXPECT_EQ(one, values_of(*results_of(path, ask, volume, threads, memory)[0]))
                    << fmt::format("{} {}", mode->name, fmt::join(path.texts(), " "));
            ++paths;
        }
    }
    EXPECT_GT(paths, 10);
}

/// Lengths of slanted rays: of the scene, whatever squeezes the object or the pixels.
TEST(OblongPaths, PicturesFromAnEyeKeepWhatTheyPredict) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto volume = blurred_noise({23, 14, 17}, 3, 1, memory);
    std::set<std::string> run;
    for (const Mode mode : {Mode::xray, Mode::mean, Mode::composite})
        for (const Vec3& squeezed : {Vec3(1, 1, 2), Vec3(0.6, 1.5, 1)})
            for (const Vec3& pixel : {Vec3(1, 1, 1), Vec3(0.7, 1.3, 0.9)}) {
                Mat4 turn = rotation(20, 30, 0);
                turn.topLeftCorner<3, 3>() =
                    squeezed.asDiagonal() * turn.topLeftCorner<3, 3>().eval();
                turn(0, 1) += 0.3;  // a shear
                Request want = turned(Job::render, mode, volume->what, Vec3(1, 1.2, 0.8), turn,
                                      {30, 24, 40}, pixel);
                want.eye = Eye{.at = {14.5, 11.5, -25 / pixel.z()},
                               .plane = 19.5,
                               .width = pixel.x() / pixel.z(),
                               .height = pixel.y() / pixel.z()};
                run.merge(expect_kept(want, volume, memory));
            }
    EXPECT_TRUE(run.contains("project.ray_cast"));
}

}  // namespace
}  // namespace edgewise
