#include "transitions/warp/backward.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <memory_resource>
#include <optional>
#include <vector>

#include "transitions/kernels/spline_prefilter.hpp"

namespace edgewise {
namespace {

/// A case of scipy_fixtures.bin, which make_scipy_fixtures.py describes and writes.
struct Fixture {
    int axes = 0;
    Extent input, output;
    Mat4 to_screen;
    std::vector<float> samples, linear, cubic;
};

std::vector<float> floats(std::istream& file, const Extent& extent) {
    std::vector<float> values(static_cast<std::size_t>(extent.samples()));
    file.read(reinterpret_cast<char*>(values.data()),
              static_cast<std::streamsize>(values.size() * sizeof(float)));
    return values;
}

std::optional<Fixture> next_fixture(std::istream& file) {
    std::array<std::int32_t, 7> head{};
    Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix;
    if (!file.read(reinterpret_cast<char*>(head.data()), sizeof head)) return std::nullopt;
    file.read(reinterpret_cast<char*>(matrix.data()), sizeof(double) * 16);
    Fixture fixture;
    fixture.axes = head[0];
    fixture.input = {head[1], head[2], head[3]};
    fixture.output = {head[4], head[5], head[6]};
    fixture.to_screen = matrix;
    fixture.samples = floats(file, fixture.input);
    fixture.linear = floats(file, fixture.output);
    fixture.cubic = floats(file, fixture.output);
    return fixture;
}

/// The samples as a hold reads them: the cubic one wants coefficients.
Data input_of(const Fixture& fixture, bool cubic) {
    Representation what;
    what.axes = fixture.axes;
    what.extent = fixture.input;
    if (cubic) what.content = "coefficients";
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::copy(fixture.samples.begin(), fixture.samples.end(), data.as<float>());
    if (cubic) kernels::spline_prefilter(data.as<float>(), fixture.input);
    return data;
}

/// The largest difference between the edge and scipy, over the range of the input.
double worst_difference(const Fixture& fixture, bool cubic) {
    Request want;
    want.job = Job::warp;
    want.axes = fixture.axes;
    want.input = fixture.input;
    want.screen = fixture.output;
    want.views = Placement(fixture.to_screen);
    const Scene scene;
    const Ask ask{want, scene};
    const Transition edge = backward_warp();
    const Data in = input_of(fixture, cubic);
    const Parameters with{{"filter", std::string(cubic ? "bspline3" : "foh")}};
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "");
    if (!offer.refused.empty()) return HUGE_VAL;
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    const std::vector<float>& answer = cubic ? fixture.cubic : fixture.linear;
    double worst = 0;
    for (std::size_t i = 0; i < answer.size(); ++i)
        worst = std::max(worst, std::abs(double(out.as<float>()[i]) - answer[i]));
    const auto [low, high] = std::minmax_element(fixture.samples.begin(), fixture.samples.end());
    return worst / (double(*high) - *low);
}

TEST(BackwardWarpEdge, EqualsScipyInDoublePrecision) {
    const char* tests = std::getenv("EDGEWISE_TESTS");
    std::ifstream file(
        std::filesystem::path(tests ? tests : "tests") / "transitions/warp/scipy_fixtures.bin",
        std::ios::binary);
    ASSERT_TRUE(file);
    int images = 0, volumes = 0, projective = 0;
    while (const auto fixture = next_fixture(file)) {
        ASSERT_TRUE(file);
        (fixture->axes == 2 ? images : volumes) += 1;
        projective += fixture->to_screen(3, 0) != 0;
        EXPECT_LE(worst_difference(*fixture, false), 1e-5) << fixture->to_screen;
        EXPECT_LE(worst_difference(*fixture, true), 1e-4) << fixture->to_screen;
    }
    EXPECT_EQ(images, 5);
    EXPECT_EQ(volumes, 3);
    EXPECT_EQ(projective, 1);
}

/// An inverse is rounded: where that reaches its corner, a volume must still not be taken for a
/// plane under a homography, as one of six of these maps was.
TEST(BackwardWarpEdge, IsAffineHoweverTheInverseIsRounded) {
    Representation what;
    what.extent = {5, 6, 7};
    Data in = Data::make(what, std::pmr::new_delete_resource());
    std::fill_n(in.as<float>(), what.extent.samples(), 3.0f);
    const Transition edge = backward_warp();
    for (int i = 0; i < 200; ++i) {
        const double scale = 0.9 + 0.001 * i;
        Mat4 map = Mat4::Identity();
        map.topLeftCorner<3, 3>() = scale * (Eigen::AngleAxisd(0.17, Vec3::UnitY()) *
                                             Eigen::AngleAxisd(1.05, Vec3::UnitX()))
                                                .toRotationMatrix();
        const Vec3 centre(2, 2.5, 3);
        map.topRightCorner<3, 1>() = centre - map.topLeftCorner<3, 3>() * centre;
        Request want;
        want.job = Job::warp;
        want.input = want.screen = what.extent;
        want.views = Placement(map);
        const Scene scene;
        const Ask ask{want, scene};
        const Offer offer = edge.offer(what, ask, {{"filter", std::string("zoh")}});
        ASSERT_EQ(offer.refused, "");
        Data out = Data::make(offer.to, std::pmr::new_delete_resource());
        Context context{.memory = std::pmr::new_delete_resource()};
        edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
        EXPECT_EQ(out.as<float>()[2 + 5 * (2 + 6 * 3)], 3.0f) << scale;
    }
}

}  // namespace
}  // namespace edgewise
