// The outermost half voxel of a shear-warp: rays there are as long inside the volume as geometry
// says, and what lies beside it does not glow.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "reference/view_geometry.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

constexpr double kValue = 0.75, kMiss = -2;

std::shared_ptr<const Data> constant(const Extent& extent, MemoryBudget& memory) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, &memory);
    std::fill_n(data.as<float>(), extent.samples(), static_cast<float>(kValue));
    return std::make_shared<const Data>(std::move(data));
}

/// The pixel of a ray that is inside a volume of kValue for a length [unit]; none: 0.
double expected(const Request& want, double length) {
    if (want.mode == Mode::xray) return (kValue - want.zero) * length * want.unit;
    if (want.mode == Mode::composite)
        return 1 -
               std::pow(1 - want.transfer.at(kValue)[3], length * want.unit / want.transfer.unit);
    return length > 0 ? kValue : kMiss;
}

/// Rays that may be in a face, and those that rounding makes short, are not compared.
bool near_a_face(const ViewGeometry& geometry, double x, double y) {
    constexpr double kNear = 1e-5;
    const bool meets = geometry.ray(0, x, y).has_value();
    for (const double dx : {-kNear, kNear})
        for (const double dy : {-kNear, kNear})
            if (geometry.ray(0, x + dx, y + dy).has_value() != meets) return true;
    return false;
}

/// @return how many paths were compared
int expect_chords(const Extent& shape, Mode mode, const std::array<double, 3>& turn) {
    MemoryBudget memory(std::size_t{1} << 28);
    const auto input = constant(shape, memory);
    Request want =
        request_of(Job::render, mode, input->what, {rotation(turn[0], turn[1], turn[2])});
    // Pixels between samples: some see less than half a voxel of the border.
    Mat4 map = want.views.at(0).matrix();
    map(0, 3) += 0.2;
    map(1, 3) -= 0.3;
    want.views = Placement(map);
    want.miss = kMiss;
    want.zero = 0.25;
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const Catalogue edges = catalogue();
    const ViewGeometry geometry(want);
    const std::int64_t channels = mode == Mode::composite ? 4 : 1;
    int paths = 0;
    for (const Plan& path : paths_of(edges, ask, input->what, 1000)) {
        const Step& last = path.steps.back();
        if (last.by->name != "project.shear_warp") continue;
        // The nearest ray of the intermediate image is as long as it is, but meets the volume where
        // the pixel's own does.
        const bool nearest = last.offer.with.word("filter") == "zoh";
        const std::vector<float> picture = values_of(*results_of(path, ask, input, 2, memory)[0]);
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                const auto px = static_cast<double>(x), py = static_cast<double>(y);
                if (near_a_face(geometry, px, py)) continue;
                const auto ray = geometry.ray(0, px, py);
                const double length = ray ? ray->high - ray->low : 0;
                const auto at =
                    static_cast<std::size_t>((y * want.screen.x + x) * channels + channels - 1);
                if (nearest && (mode == Mode::xray || mode == Mode::composite)) {
                    EXPECT_EQ(picture[at] > 0, length > 0) << fmt::format(
                        "{}x{}x{} {} {},{},{}: pixel {},{}, length {}", shape.x, shape.y, shape.z,
                        name_of(mode), turn[0], turn[1], turn[2], x, y, length);
                    continue;
                }
                // Rays of a composite end where 1/4096 is left to see.
                EXPECT_NEAR(picture[at], expected(want, length),
                            mode == Mode::composite ? 1.0 / 4096 + 1e-5 : 2e-5 * (1 + length))
                    << fmt::format("{}x{}x{} {} {},{},{}: pixel {},{}, length {}", shape.x, shape.y,
                                   shape.z, name_of(mode), turn[0], turn[1], turn[2], x, y, length);
            }
        ++paths;
    }
    return paths;
}

/// Faces along the rays, nearly along them, and slanted; from the front and from behind. Of light
/// and opacity neighbours differ by more than a linear amount where faces are slanted.
TEST(ShearBorder, AConstantHasTheChordOfEachRay) {
    for (const Extent& shape : {Extent{14, 11, 12}, Extent{5, 16, 9}, Extent{2, 3, 20}}) {
        for (const Mode mode : {Mode::mip, Mode::xray, Mode::mean})
            for (const std::array<double, 3>& turn : {std::array{0.0, 0.0, 0.0},
                                                      {0.0, 7.5, 0.0},
                                                      {0.0, 45.0, 0.0},
                                                      {0.0, 82.5, 0.0},
                                                      {0.4, 0.0, 0.0},
                                                      {0.3, 0.7, 20.0},
                                                      {1.0, 179.0, 0.0},
                                                      {20.0, 35.0, -50.0}})
                EXPECT_GT(expect_chords(shape, mode, turn), 0);
        for (const std::array<double, 3>& turn :
             {std::array{0.0, 0.0, 0.0}, {0.0, 90.0, 0.0}, {180.0, 0.0, 0.0}, {0.0, 0.02, 0.01}})
            EXPECT_GT(expect_chords(shape, Mode::composite, turn), 0);
    }
}

}  // namespace
}  // namespace edgewise
