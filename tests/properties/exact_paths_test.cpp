// Where nothing lies between samples nothing may change: identity, whole shifts and quarter turns
// are copies through every warp, and always when the planner chooses.
#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <random>

#include "io/store.hpp"
#include "planner/planner.hpp"
#include "reference/phantoms.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

struct Move {
    const char* name;
    std::array<double, 3> turn, shift;
};

constexpr std::array<Move, 5> kMoves = {{{"identity", {0, 0, 0}, {0, 0, 0}},
                                         {"shift", {0, 0, 0}, {2, -1, 0}},
                                         {"quarter turn", {0, 0, 90}, {0, 0, 0}},
                                         {"half turn and shift", {0, 0, 180}, {1, 3, 0}},
                                         {"three quarters", {0, 0, -90}, {0, 0, 0}}}};
constexpr Move kTilt = {"quarter turns of three axes", {90, -90, 180}, {0, 0, 2}};

Data random_samples(const Extent& extent, int axes, Type type, MemoryBudget& memory) {
    Representation what;
    what.axes = axes;
    what.extent = extent;
    what.type = type;
    Data data = Data::make(what, &memory);
    std::mt19937 bits(7);
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        if (type == Type::u8)
            data.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(bits());
        else if (type == Type::i16)
            data.as<std::int16_t>()[i] = static_cast<std::int16_t>(bits());
        else
            data.as<float>()[i] = static_cast<float>(bits() % 100'000) / 1e5f;
    return data;
}

Data middle_of(const Data& whole, std::int64_t side, MemoryBudget& memory) {
    Representation what;
    what.extent = {side, side, side};
    Data data = Data::make(what, &memory);
    const Extent& n = whole.what.extent;
    const std::vector<float> values = values_of(whole);
    for (std::int64_t i = 0; i < side * side * side; ++i) {
        const std::int64_t x = (n.x - side) / 2 + i % side, y = (n.y - side) / 2 + i / side % side,
                           z = (n.z - side) / 2 + i / (side * side);
        data.as<float>()[i] = values[static_cast<std::size_t>(x + n.x * (y + n.y * z))];
    }
    return data;
}

Request request_for(const Data& input, const Move& move) {
    // A cube of odd side has a sample in the middle of every turn.
    const auto& [x, y, z] = move.turn;
    Request want = request_of(Job::warp, Mode::mip, input.what, {rotation(x, y, z)});
    Mat4 map = want.views.at(0).matrix();
    for (int axis = 0; axis < 3; ++axis) map(axis, 3) += move.shift[axis];
    want.views = Placement(map);
    return want;
}

/// The copy, sample by sample; `outside` where no sample lies.
std::vector<float> copied(const Data& input, const Request& want) {
    const Extent n = input.what.extent;
    const std::vector<float> values = values_of(input);
    const Mat4 back = want.views.at(0).inverse().matrix();
    std::vector<float> copy;
    for (std::int64_t z = 0; z < want.screen.z; ++z)
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                const Vec3 p = (back * Eigen::Vector4d(x, y, z, 1)).head<3>();
                const auto i = std::llround(p.x()), j = std::llround(p.y()),
                           k = std::llround(p.z());
                const bool inside = i >= 0 && j >= 0 && k >= 0 && i < n.x && j < n.y && k < n.z;
                copy.push_back(inside ? values[static_cast<std::size_t>(i + n.x * (j + n.y * k))]
                                      : static_cast<float>(want.outside));
            }
    return copy;
}

/// Quantises on purpose, so it is no copy.
bool makes_coarser(const Plan& path, const Scene& scene) {
    constexpr double kF32 = 0x1p-23;
    for (const Step& step : path.steps)
        if (step.by->name == "store.precision" &&
            step.label.noise > kF32 * std::max(std::abs(scene.low), std::abs(scene.high)))
            return true;
    return false;
}

/// What f32 coefficients can hold [range], u = 2^-24 the largest relative error of one rounding; an
/// average one is 0.43 u.
///
/// The inverse of the cubic kernel, sqrt(3) p^|k| with p = sqrt(3) - 2, multiplies the RMS of white
/// noise by sqrt(3 (1 + p^2) / (1 - p^2)) = 1.86 an axis, 6.4 in a volume: coefficients of noise
/// spread evenly over a range (RMS 0.29) are 1.87 ranges large, RMS. Three roundings an axis on the
/// way to them leave sqrt(9) 0.43 u x 1.87 = 2.4 u. Reconstruction at a node multiplies that by
/// (sqrt(18) / 6)^3 = 0.35 and rounds four sums an axis of 1.3, 0.7 and 0.4 ranges, whose errors
/// join to 1.0 u. Together 1.3 u = 8e-8 RMS, so that 2e-7 for the largest would be 2.6 standard
/// deviations; one of 10^5 samples lies 6 of them off. Coefficients of data whose
/// neighbours are alike are smaller, about as large as the data.
constexpr double kLargest = 6 * 1.3 * 0x1p-24;

bool has_spline(const std::string& text) { return text.find("bspline3") != std::string::npos; }

void expect_copies(const Data& samples, std::shared_ptr<const Data> input, const Move& move,
                   MemoryBudget& memory) {
    const Request want = request_for(samples, move);
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const std::vector<float> expected = copied(*input, want);
    const Catalogue edges = catalogue();
    for (const Plan& path : paths_of(edges, ask, input->what, 100)) {
        if (makes_coarser(path, scene)) continue;
        const std::string text = fmt::format("{}", fmt::join(path.texts(), " "));
        SCOPED_TRACE(fmt::format("{} of {}: {}", move.name, input->what.text(), text));
        const std::vector<float> got = values_of(*results_of(path, ask, input, 2, memory)[0]);
        ASSERT_EQ(got.size(), expected.size());
        // A spline prefilters and reconstructs in f32.
        const bool splines = has_spline(text);
        double worst = 0, sum = 0;
        for (std::size_t i = 0; i < got.size(); ++i) {
            const double wrong = std::abs(double(got[i]) - expected[i]);
            worst = std::max(worst, wrong);
            sum += wrong * wrong;
        }
        const double range = scene.high - scene.low;
        EXPECT_LE(std::sqrt(sum / static_cast<double>(got.size())), splines ? 2e-7 * range : 0);
        EXPECT_LE(worst, splines ? kLargest * range : 0);
    }
    const std::vector<Source> sources{{input->what}};
    const Answer answer = plan(edges, ask, sources, default_profile(edges));
    ASSERT_TRUE(answer.plan);
    EXPECT_EQ(values_of(*results_of(*answer.plan, ask, input, 2, memory)[0]), expected)
        << move.name << ", chosen: " << fmt::format("{}", fmt::join(answer.plan->texts(), " "));
}

TEST(ExactPaths, CopyWhereNothingLiesBetweenSamples) {
    MemoryBudget memory(std::size_t{1} << 30);
    for (const Type type : {Type::u8, Type::i16, Type::f32}) {
        const auto image = std::make_shared<const Data>(random_samples({9, 9, 1}, 2, type, memory));
        const auto volume =
            std::make_shared<const Data>(random_samples({9, 9, 9}, 3, type, memory));
        for (const Move& move : kMoves) {
            expect_copies(*image, image, move, memory);
            expect_copies(*volume, volume, move, memory);
        }
        expect_copies(*volume, volume, kTilt, memory);
    }
}

TEST(ExactPaths, CopySmoothPhantoms) {
    MemoryBudget memory(std::size_t{1} << 30);
    for (const char* phantom : {"gaussians", "noise", "marschner-lobb"}) {
        const auto input = std::make_shared<const Data>(make_phantom(phantom, 25, &memory));
        for (const Move& move : kMoves) expect_copies(*input, input, move, memory);
        expect_copies(*input, input, kTilt, memory);
    }
}

/// The middle of a bundled volume: a cube of odd side.
TEST(ExactPaths, CopyRealData) {
    const char* folder = std::getenv("EDGEWISE_DATA");
    if (!folder) GTEST_SKIP() << "EDGEWISE_DATA is not set";
    MemoryBudget memory(std::size_t{1} << 30);
    for (const char* name : {"/mr_brain/MR.nii.gz", "/ct_head/quarter.nhdr"}) {
        store::Loaded loaded = store::load(std::string(folder) + name, {}, &memory);
        Data whole;
        whole.what.extent = loaded.header.extent;
        whole.what.type = loaded.header.type;
        whole.samples = std::move(loaded.samples);
        const auto input = std::make_shared<const Data>(middle_of(whole, 33, memory));
        for (const Move& move : kMoves) expect_copies(*input, input, move, memory);
    }
}

}  // namespace
}  // namespace edgewise
