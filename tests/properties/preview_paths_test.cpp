// A preview predicts the error of shear-warp by working it out once more, ray by ray and in f64.
// What it works out must be the picture that the edge makes, pixel by pixel: not only near it on
// the average.
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "planner/planner.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/project/shear_warp_model.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 24;

/// Values of 0 to 1 without any likeness of neighbours, also of those in a face.
std::shared_ptr<const Data> random_volume(const Extent& extent, MemoryBudget& memory) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, &memory);
    std::mt19937 bits(17);
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(bits() % 4096) / 4096;
    return std::make_shared<const Data>(std::move(data));
}

/// Whether a ray misses the input, whatever rounding does to one in a face.
bool clearly_misses(const ViewGeometry& geometry, double x, double y) {
    for (const double dx : {-1e-6, 1e-6})
        for (const double dy : {-1e-6, 1e-6})
            if (geometry.ray(0, x + dx, y + dy)) return false;
    return true;
}

/// Between the preview's picture and a plan's [value].
struct Difference {
    double largest = 0, rms = 0;
};

Difference difference(const Plan& path, const Ask& ask, const ReferenceField& field,
                      std::shared_ptr<const Data> input, MemoryBudget& memory) {
    const Request& want = ask.want;
    const PreviewHold hold = path.steps.back().offer.with.word("filter") == "zoh" ? kZoh : kFoh;
    const std::vector<float> picture = values_of(*results_of(path, ask, input, 2, memory)[0]);
    const PreviewBlock block(field, Region::all(field.extent()), &memory);
    const ViewGeometry geometry(want);
    const auto channels = static_cast<std::size_t>(want.mode->channels);
    Difference all;
    double squares = 0;
    for (std::int64_t y = 0; y < want.screen.y; ++y)
        for (std::int64_t x = 0; x < want.screen.x; ++x) {
            const auto ray = geometry.ray(0, static_cast<double>(x), static_cast<double>(y));
            std::array<double, 4> values{};
            if (ray) {
                ShearedPicture sheared(*ray, want.input, want.mode);
                sheared.trace(block, std::numeric_limits<double>::infinity(), want);
                sheared.result(hold, want, values);
            } else if (!clearly_misses(geometry, static_cast<double>(x), static_cast<double>(y))) {
                continue;
            } else if (want.mode == Mode::mip || want.mode == Mode::mean) {
                values[0] = want.miss;
            }
            for (std::size_t c = 0; c < channels; ++c) {
                const auto at = static_cast<std::size_t>(y * want.screen.x + x) * channels + c;
                const double d = values[c] - double(picture[at]);
                all.largest = std::max(all.largest, std::abs(d));
                squares += d * d;
            }
        }
    all.rms = std::sqrt(squares / static_cast<double>(picture.size()));
    return all;
}

/// All ways to slices and from there to the picture, from the front and from behind, with rays
/// nearly along a face, which the neighbours of a ray meet many slices earlier or later.
void expect_alike(const std::shared_ptr<const Data>& input, Mode mode,
                  const std::array<double, 3>& turn, MemoryBudget& memory) {
    Request want =
        request_of(Job::render, mode, input->what, {rotation(turn[0], turn[1], turn[2])});
    want.miss = -1;
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const ReferenceField field(*input, Field::spline);
    const Catalogue edges = catalogue();
    int compared = 0;
    for (const Plan& path : paths_of(edges, ask, input->what, 1000)) {
        if (path.steps.back().by->name != "project.shear_warp") continue;
        bool quantised = false;
        for (const Step& step : path.steps) quantised |= step.by->name == "store.precision";
        if (quantised) continue;
        const bool smooth =
            mode == Mode::mip && path.steps.back().offer.with.word("filter") != "zoh";
        const Difference found = difference(path, ask, field, input, memory);
        const std::string what = fmt::format("{} {},{},{}: {}", name_of(mode), turn[0], turn[1],
                                             turn[2], path.steps.back().text());
        // f32 sums of some 40 samples, and rays that end where 1/4096 is left to see.
        const double bound = mode == Mode::composite ? 1.0 / 4096 + 1e-5 : 1e-5 * scene.range;
        if (smooth)  // pixels farther away than a preview looks have a weight in the spline
            EXPECT_LE(found.rms, 0.02 * scene.range) << what;
        else
            EXPECT_LE(found.largest, bound) << what;
        ++compared;
    }
    EXPECT_GT(compared, 0);
}

TEST(PreviewPaths, ShearWarpIsThePictureOfTheEdge) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto input = std::make_shared<const Data>(make_phantom("marschner-lobb", kSide, &memory));
    for (const Mode mode : {Mode::composite, Mode::xray, Mode::mip})
        for (const std::array<double, 3>& turn :
             {std::array{5.0, 5.0, 0.0}, {3.0, 170.0, 2.0}, {25.0, -40.0, 10.0}})
            expect_alike(input, mode, turn, memory);
}

/// Where rays run along a face or nearly so, a voxel of the border is as much as any other.
TEST(PreviewPaths, ShearWarpIsThePictureOfTheEdgeAtFacesAlongTheRays) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto input = random_volume({kSide, kSide - 1, kSide - 3}, memory);
    for (const Mode mode : {Mode::composite, Mode::xray, Mode::mean})
        for (const std::array<double, 3>& turn : {std::array{0.0, 0.0, 0.0},
                                                  {0.0, 7.5, 0.0},
                                                  {0.0, 45.0, 0.0},
                                                  {90.0, 82.5, 0.0},
                                                  {0.3, 0.7, 20.0},
                                                  {0.0, 179.6, 3.0}})
            expect_alike(input, mode, turn, memory);
}

}  // namespace
}  // namespace edgewise
