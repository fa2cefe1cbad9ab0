// Pictures of the five orders beside a loop in f64, beside each other, and beside project.combine.
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <memory_resource>
#include <numbers>
#include <random>
#include <string>
#include <tbb/task_arena.h>
#include <vector>

#include "transitions/composite/attenuated_sum.hpp"
#include "transitions/composite/back_to_front.hpp"
#include "transitions/composite/binary_tree.hpp"
#include "transitions/composite/binary_tree_front_to_back.hpp"
#include "transitions/composite/classify.hpp"
#include "transitions/composite/front_to_back.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

std::pmr::memory_resource* memory() { return std::pmr::get_default_resource(); }

std::vector<Transition> orders() {
    return {back_to_front_over(), front_to_back_over(), binary_tree_over(),
            binary_tree_front_to_back_over(), attenuated_sum()};
}

/// The parameters that a planner tries.
Parameters usual(const Transition& edge) {
    Parameters with;
    for (const auto& [key, domain] : edge.parameters) with.set(key, domain.tried.at(0));
    return with;
}

Mode compositing() { return mode_named("composite"); }

/// A picture of `extent` samples that lie on the screen already.
Request request_of(const Extent& extent) {
    Request want;
    want.mode = compositing();
    want.input = want.screen = extent;
    want.transfer.points = {{0, 0, {0.1, 0.9, 0.4}}, {1, 1, {1, 0.3, 0.2}}};
    return want;
}

/// Samples on a screen, of random numbers from 0 to 1.
Data scalars(const Extent& extent, unsigned seed) {
    Representation what;
    what.space = "screen";
    what.extent = extent;
    Data data = Data::make(what, memory());
    std::mt19937 bits(seed);
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(bits() % 1025) / 1024;
    return data;
}

/// Random light and transparency; some samples are opaque, some not there.
Data classified(const Request& want, unsigned seed) {
    Representation on_screen;
    on_screen.space = "screen";
    on_screen.extent = want.screen;
    Data data = Data::make(screen_classified(on_screen, want), memory());
    std::mt19937 bits(seed);
    std::uniform_real_distribution<float> share(0, 1);
    // On long rays few samples hide much, so that those at the back matter too.
    const float most = std::min(1.0f, 8.0f / static_cast<float>(want.screen.z));
    for (std::int64_t i = 0; i < want.screen.samples(); ++i) {
        float* sample = data.as<float>() + 4 * i;
        const unsigned kind = bits() % 64;
        const float opacity = kind == 0 ? 1 : kind < 8 ? 0 : most * share(bits);
        for (int c = 0; c < 3; ++c) sample[c] = opacity * share(bits);
        sample[3] = 1 - opacity;
    }
    return data;
}

Data run_on(const Transition& edge, const Parameters& with, const Request& want, const Data& in) {
    const Scene scene;
    const Ask ask{want, scene};
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "") << edge.name;
    Data out = Data::make(offer.to, memory());
    std::memset(out.samples.data(), 0xff, out.samples.bytes());
    Context context{.memory = memory()};
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    return out;
}
Data run_on(const Transition& edge, const Request& want, const Data& in) {
    return run_on(edge, usual(edge), want, in);
}

bool same_bytes(const Data& a, const Data& b) {
    return a.what.bytes() == b.what.bytes() &&
           std::memcmp(a.samples.data(), b.samples.data(),
                       static_cast<std::size_t>(a.what.bytes())) == 0;
}

/// EQ 61 with 1 - opacity: what light of each sample comes through all in front of it.
std::vector<double> composited(const Data& samples) {
    const Extent& n = samples.what.extent;
    std::vector<double> picture;
    for (std::int64_t pixel = 0; pixel < n.x * n.y; ++pixel) {
        std::array<double, 4> all{0, 0, 0, 1};
        for (std::int64_t z = 0; z < n.z; ++z) {
            const float* sample = samples.as<float>() + 4 * (pixel + n.x * n.y * z);
            for (std::size_t c = 0; c < 3; ++c) all[c] += all[3] * double(sample[c]);
            all[3] *= double(sample[3]);
        }
        all[3] = 1 - all[3];
        picture.insert(picture.end(), all.begin(), all.end());
    }
    return picture;
}

/// The largest difference of a picture from numbers.
double largest_difference(const Data& picture, const std::vector<double>& expected) {
    double largest = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const double difference = std::abs(double(picture.as<float>()[i]) - expected[i]);
        largest = difference <= largest ? largest : difference;  // NaN is the largest
    }
    return largest;
}

/// Every composite rounds a product and a sum of numbers up to 1, by 2^-24 each, and what was
/// rounded before passes with a factor up to 1: after W - 1 of them, and 1 - t.
double rounding(std::int64_t samples) { return double(2 * samples) * 0x1p-24; }

constexpr int kDepths[] = {1, 2, 3, 5, 8, 17, 64};

TEST(Orders, GiveWhatALoopInF64Gives) {
    for (const int depth : kDepths)
        for (const Extent& size : {Extent{37, 5, 1}, Extent{1, 1, 1}, Extent{300, 11, 1}}) {
            const Request want = request_of({size.x, size.y, depth});
            const Data samples = classified(want, static_cast<unsigned>(depth));
            const std::vector<double> expected = composited(samples);
            for (const Transition& edge : orders()) {
                SCOPED_TRACE(edge.name + ", W " + std::to_string(depth));
                const Data picture = run_on(edge, want, samples);
                EXPECT_EQ(picture.what.kind(), "screen/picture");
                EXPECT_EQ(picture.what.channels, 4);
                EXPECT_LE(largest_difference(picture, expected), rounding(depth));
            }
        }
}

TEST(Orders, OfOneAndTwoSamplesAreOne) {
    for (const int depth : {1, 2}) {
        const Request want = request_of({70, 3, depth});
        const Data samples = classified(want, 4);
        const Data first = run_on(back_to_front_over(), want, samples);
        // The sum rounds the product before it adds.
        for (const Transition& edge : orders()) {
            if (depth == 2 && edge.name == attenuated_sum().name) continue;
            EXPECT_TRUE(same_bytes(first, run_on(edge, want, samples))) << edge.name;
        }
    }
}

TEST(Orders, OpaqueSamplesHideAndTransparentOnesAreNotSeen) {
    for (const int depth : kDepths) {
        const Request want = request_of({9, 1, depth});
        Data samples = classified(want, 5);
        float* at = samples.as<float>();
        for (std::int64_t i = 0; i < want.screen.samples(); ++i)
            for (int c = 0; c < 4; ++c) at[4 * i + c] = c == 3 ? 1 : 0;
        const int opaque = depth / 2;
        for (std::int64_t x = 0; x < 9; ++x)
            for (int z = opaque; z < depth; ++z)
                for (int c = 0; c < 4; ++c)
                    at[4 * (x + 9 * z) + c] = c == 3        ? 0
                                              : z == opaque ? 0.25f * static_cast<float>(c + 1)
                                                            : 0.9f;
        for (const Transition& edge : orders()) {
            const Data picture = run_on(edge, want, samples);
            for (int i = 0; i < 36; ++i)
                EXPECT_EQ(picture.as<float>()[i], i % 4 == 3 ? 1 : 0.25f * float(i % 4 + 1))
                    << edge.name << ", W " << depth;
        }
    }
}

TEST(Orders, OpacityIsThatOfTheOpticalDepth) {
    // 1 - prod t = 1 - exp(-sum tau) with t = exp(-tau), exactly but for f32.
    for (const int depth : kDepths) {
        const Request want = request_of({33, 2, depth});
        Data samples = classified(want, 6);
        std::vector<double> sums(66);
        std::mt19937 bits(8);
        for (std::int64_t i = 0; i < want.screen.samples(); ++i) {
            const double tau = double(bits() % 1000) / 1000 * 2 / depth;
            samples.as<float>()[4 * i + 3] = static_cast<float>(std::exp(-tau));
            sums[static_cast<std::size_t>(i % 66)] += tau;
        }
        for (const Transition& edge : orders()) {
            const Data picture = run_on(edge, want, samples);
            // W transparencies, W - 1 products and 1 - t are rounded.
            for (std::size_t i = 0; i < sums.size(); ++i)
                EXPECT_NEAR(picture.as<float>()[4 * i + 3], -std::expm1(-sums[i]),
                            rounding(depth) + 0x1p-24)
                    << edge.name << ", W " << depth;
        }
    }
}

TEST(Lemma42, SwappedSlicesAreAnotherPicture) {
    const Request want = request_of({40, 4, 8});
    Data samples = classified(want, 7);
    const std::vector<double> there = composited(samples);
    std::swap_ranges(samples.as<float>() + 4 * 160 * 2, samples.as<float>() + 4 * 160 * 3,
                     samples.as<float>() + 4 * 160 * 5);
    const std::vector<double> swapped = composited(samples);
    for (const Transition& edge : orders()) {
        const Data picture = run_on(edge, want, samples);
        EXPECT_LE(largest_difference(picture, swapped), rounding(8)) << edge.name;
        EXPECT_GT(largest_difference(picture, there), 0.05) << edge.name;
    }
}

TEST(Orders, SameBytesForAnyThreadsAndBoxes) {
    const Request want = request_of({523, 37, 21});
    const Data scalar = scalars(want.screen, 9);
    const Scene scene;
    const Ask ask{want, scene};
    const Data samples = run_on(classify(), want, scalar);
    std::vector<Transition> edges = orders();
    edges.push_back(classify());
    for (const Transition& edge : edges) {
        const Data& in = edge.name == classify().name ? scalar : samples;
        const Data alone = run_on(edge, want, in);
        for (const int threads : {1, 2, 7}) {
            tbb::task_arena arena(threads);
            arena.execute([&] {
                EXPECT_TRUE(same_bytes(alone, run_on(edge, want, in)))
                    << edge.name << ", " << threads << " threads";
            });
        }
        const Offer offer = edge.offer(in.what, ask, usual(edge));
        Data out = Data::make(offer.to, memory());
        Context context{.memory = memory()};
        for (const Region& box : boxes_of(offer.to.extent, 13))
            edge.run(offer, ask, in, out, box, context);
        EXPECT_TRUE(same_bytes(alone, out)) << edge.name;
    }
}

TEST(Orders, AfterFiguresOfTheTables) {
    const Request want = request_of({10, 4, 21});
    const Scene scene;
    const Ask ask{want, scene};
    const Data samples = classified(want, 1);
    const Compositing how[] = {Compositing::back_to_front, Compositing::front_to_back,
                               Compositing::tree_from_back, Compositing::tree_from_front,
                               Compositing::sum};
    const std::vector<Transition> edges = orders();
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const Offer offer = edges[i].offer(samples.what, ask, usual(edges[i]));
        const Work work = edges[i].work(offer, ask, 0);
        // TABLE 36 and 37 of three colours; W premultiplied each, and W - 1 transparencies, are
        // composite.classify's; the picture's opacity is on top.
        const double table = counts_of(how[i], 21, 3).sum() - (3 * 21 + 20);
        EXPECT_EQ(work.operations, 40 * (table + opacity_counts(how[i], 21).sum()))
            << edges[i].name;
        EXPECT_EQ(work.streamed, 40 * 21 * 16 + 40 * 16);
        const Error error = edges[i].error(offer, ask), combined = combined_error(ask);
        EXPECT_EQ(error.bias, combined.bias);
        EXPECT_GE(error.noise, combined.noise);
    }
}

/// What rays along z see of samples one apart, in f64.
std::vector<double> rendered(const Data& scalar, const Request& want) {
    const Extent& n = scalar.what.extent;
    std::vector<double> picture;
    for (std::int64_t pixel = 0; pixel < n.x * n.y; ++pixel) {
        std::array<double, 4> all{0, 0, 0, 1};
        for (std::int64_t z = 0; z < n.z; ++z) {
            const auto at = want.transfer.at(double(scalar.as<float>()[pixel + n.x * n.y * z]));
            const double left = std::pow(1 - at[3], want.unit / want.transfer.unit);
            for (std::size_t c = 0; c < 3; ++c) all[c] += all[3] * (1 - left) * at[c];
            all[3] *= left;
        }
        all[3] = 1 - all[3];
        picture.insert(picture.end(), all.begin(), all.end());
    }
    return picture;
}

TEST(Classify, ThenAnyOrderIsARay) {
    for (const int depth : kDepths)
        for (const double unit : {1.0, 2.5})
            for (const bool grey : {false, true}) {
                Request want = request_of({61, 3, depth});
                want.transfer.unit = unit;
                // Thin, so that no ray of project.combine ends early; opaque and empty values too.
                for (Transfer::Point& point : want.transfer.points) {
                    point.opacity /= depth;
                    if (grey) point.color = {0.7, 0.7, 0.7};
                }
                const Data scalar = scalars(want.screen, 10);
                const Data samples = run_on(classify(), want, scalar);
                const std::vector<double> expected = rendered(scalar, want);
                // Opacities and colours are rounded four times, the logarithm and the exponential
                // to 2^-23, of numbers up to 1. A power of 1 - opacity is steep where that is
                // small: 1/1024 at least, but for the opaque value, which is exact.
                const double power = 1 / unit, least = depth == 1 ? 1.0 / 1024 : 1 - 1.0 / depth;
                const double steepest = power * std::pow(least, power - 1);
                // Both ends of a ray lie 1e-6 further in, and x^p log x is 1 / (e p) at most.
                const double most =
                    rounding(depth) + depth * (8 + 2 * steepest) * 0x1p-24 + 2e-6 / std::numbers::e;
                const Data combined = run_on(combine(), want, scalar);
                for (const Transition& edge : orders()) {
                    SCOPED_TRACE(edge.name + ", W " + std::to_string(depth));
                    const Data picture = run_on(edge, want, samples);
                    EXPECT_LE(largest_difference(picture, expected), most);
                    const std::vector<double> other(
                        combined.as<float>(), combined.as<float>() + combined.what.samples() * 4);
                    // Both have the same light and transparency of samples.
                    EXPECT_LE(largest_difference(picture, other), 2 * rounding(depth));
                }
            }
}

TEST(Classify, OpaqueValuesEndARay) {
    Request want = request_of({64, 2, 17});
    want.transfer.points = {{0, 0, {1, 1, 1}}, {0.5, 0, {1, 1, 0}}, {0.8, 1, {0, 0.5, 1}}};
    const Data scalar = scalars(want.screen, 11);
    const Data samples = run_on(classify(), want, scalar);
    for (std::int64_t i = 0; i < want.screen.samples(); ++i) {
        const float value = scalar.as<float>()[i];
        const float* sample = samples.as<float>() + 4 * i;
        if (value <= 0.5f) {
            EXPECT_EQ(sample[3], 1);
            EXPECT_EQ(sample[0], 0);
        }
        if (value >= 0.81f) {
            EXPECT_EQ(sample[3], 0);
            EXPECT_EQ(sample[2], 1);
        }
    }
    const std::vector<double> expected = rendered(scalar, want);
    const Data combined = run_on(combine(), want, scalar);
    const std::vector<double> other(combined.as<float>(),
                                    combined.as<float>() + combined.what.samples() * 4);
    for (const Transition& edge : orders()) {
        const Data picture = run_on(edge, want, samples);
        // The ramp from 0.5 to 0.8 is 3.3 times as steep as that of the test above.
        EXPECT_LE(largest_difference(picture, expected), 4 * 10 * 17 * 0x1p-24) << edge.name;
        // Rays of project.combine end where so little is left.
        EXPECT_LE(largest_difference(picture, other), kTerminated + 2 * rounding(17)) << edge.name;
    }
}

/// A turn about z and then about x, about the centres.
Mat4 turned(const Extent& input, const Extent& screen) {
    const double a = 0.5, b = 0.7;
    Mat4 about_z = Mat4::Identity(), about_x = Mat4::Identity();
    about_z(0, 0) = about_z(1, 1) = std::cos(a);
    about_z(1, 0) = std::sin(a);
    about_z(0, 1) = -about_z(1, 0);
    about_x(1, 1) = about_x(2, 2) = std::cos(b);
    about_x(2, 1) = std::sin(b);
    about_x(1, 2) = -about_x(2, 1);
    Mat4 map = about_x * about_z;
    for (int row = 0; row < 3; ++row) {
        map(row, 3) = double(screen[row] - 1) / 2;
        for (int k = 0; k < 3; ++k) map(row, 3) -= map(row, k) * double(input[k] - 1) / 2;
    }
    return map;
}

TEST(Classify, CellsAtTheEndsOfRaysHaveTheirLength) {
    const Extent screen{47, 41, 44};
    Request want = request_of(screen);
    want.input = {31, 22, 19};
    want.views = Placement(turned(want.input, screen));
    want.transfer.points = {{0, 0.02, {0.2, 1, 0.5}}, {1, 0.1, {1, 0.5, 0}}};
    Data scalar = scalars(screen, 12);
    scalar.what.placed = want.views;
    const Data samples = run_on(classify(), want, scalar);
    const Data combined = run_on(combine(), want, scalar);
    const std::vector<double> other(combined.as<float>(),
                                    combined.as<float>() + combined.what.samples() * 4);
    double opaque = 0;
    for (std::size_t i = 3; i < other.size(); i += 4) opaque += other[i];
    EXPECT_GT(opaque, 100);
    for (const Transition& edge : orders())
        EXPECT_LE(largest_difference(run_on(edge, want, samples), other), 2 * rounding(screen.z))
            << edge.name;
}

TEST(Classify, SamplesThatAreNotFiniteAreNotSeen) {
    const Request want = request_of({20, 1, 1});
    Data scalar = scalars(want.screen, 13);
    scalar.as<float>()[3] = std::numeric_limits<float>::quiet_NaN();
    scalar.as<float>()[4] = std::numeric_limits<float>::infinity();
    const Data samples = run_on(classify(), want, scalar);
    for (const int i : {3, 4})
        for (int c = 0; c < 4; ++c) EXPECT_EQ(samples.as<float>()[4 * i + c], c == 3 ? 1 : 0);
}

TEST(Classify, ReadsEveryType) {
    for (const Type type : {Type::u8, Type::i8, Type::i16, Type::u16, Type::i32, Type::f32}) {
        Request want = request_of({35, 2, 3});
        want.transfer.points = {{0, 0, {0, 0, 0}}, {100, 1, {1, 1, 1}}};
        Representation what;
        what.space = "screen";
        what.extent = want.screen;
        what.type = type;
        Data stored = Data::make(what, memory());
        what.type = Type::f32;
        Data floats = Data::make(what, memory());
        for (int i = 0; i < 210; ++i) {
            const int value = i * 37 % 101;
            floats.as<float>()[i] = static_cast<float>(value);
            if (bytes_of(type) == 1)
                stored.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(value);
            if (bytes_of(type) == 2)
                stored.as<std::int16_t>()[i] = static_cast<std::int16_t>(value);
            if (type == Type::i32) stored.as<std::int32_t>()[i] = value;
            if (type == Type::f32) stored.as<float>()[i] = static_cast<float>(value);
        }
        EXPECT_TRUE(same_bytes(run_on(classify(), want, stored), run_on(classify(), want, floats)))
            << name_of(type);
    }
}

// Progressive refinement: pictures of what lies in front.

/// The first slices of samples.
Data front_of(const Data& samples, std::int64_t slices) {
    Representation what = samples.what;
    what.extent.z = slices;
    Data front = Data::make(what, memory());
    std::memcpy(front.samples.data(), samples.samples.data(),
                static_cast<std::size_t>(what.bytes()));
    return front;
}

struct Seen {
    std::vector<std::int64_t> slices;
    std::vector<std::vector<float>> pictures;
    int most = 1000;  // of them, then it stops

    FrontWatch watch() {
        return [this](const FrontPicture& front) {
            slices.push_back(front.slices);
            const float* first = front.picture.as<float>();
            pictures.emplace_back(first, first + front.picture.what.samples() * 4);
            return static_cast<int>(pictures.size()) < most;
        };
    }
};

void expect_fronts(const Transition& edge, const Parameters& with, const Transition& plain,
                   const Request& want, Seen& seen, const std::vector<std::int64_t>& expected) {
    const Data samples = classified(want, 14);
    const Data picture = run_on(edge, with, want, samples);
    EXPECT_TRUE(same_bytes(picture, run_on(plain, want, samples)));
    EXPECT_EQ(seen.slices, expected);
    for (std::size_t i = 0; i < seen.slices.size(); ++i) {
        const Data front = run_on(plain, want, front_of(samples, seen.slices[i]));
        EXPECT_EQ(std::memcmp(front.samples.data(), seen.pictures[i].data(),
                              seen.pictures[i].size() * sizeof(float)),
                  0)
            << seen.slices[i];
    }
}

TEST(Refinement, EveryFrontIsThePictureOfItsSlices) {
    const Request want = request_of({301, 9, 21});
    Seen seen;
    expect_fronts(front_to_back_over(seen.watch()), {{"every", 8.0}}, front_to_back_over(), want,
                  seen, {8, 16, 21});
    Seen all;
    expect_fronts(front_to_back_over(all.watch()), {{"every", 40.0}}, front_to_back_over(), want,
                  all, {21});
}

TEST(Refinement, TreesInFrontDouble) {
    for (const auto& [first, expected] : std::vector<std::pair<double, std::vector<std::int64_t>>>{
             {1, {1, 2, 4, 8, 16, 21}}, {4, {4, 8, 16, 21}}, {32, {21}}}) {
        Seen seen;
        expect_fronts(binary_tree_front_to_back_over(seen.watch()), {{"first", first}},
                      binary_tree_front_to_back_over(), request_of({301, 9, 21}), seen, expected);
    }
}

TEST(Refinement, AWatchSeesSixteenPicturesOrAllTrees) {
    const Request want = request_of({301, 9, 21});
    Seen seen;
    std::vector<std::int64_t> by_two;
    for (std::int64_t at = 2; at < 21; at += 2) by_two.push_back(at);
    by_two.push_back(21);
    expect_fronts(front_to_back_over(seen.watch()), {{"every", 0.0}}, front_to_back_over(), want,
                  seen, by_two);
    Seen trees;
    expect_fronts(binary_tree_front_to_back_over(trees.watch()), {{"first", 0.0}},
                  binary_tree_front_to_back_over(), want, trees, {1, 2, 4, 8, 16, 21});
}

TEST(Refinement, StopsAtThePictureThatTheWatchIsContentWith) {
    const Request want = request_of({301, 9, 21});
    const Data samples = classified(want, 14);
    Seen seen;
    seen.most = 2;
    const Data picture = run_on(front_to_back_over(seen.watch()), {{"every", 4.0}}, want, samples);
    EXPECT_EQ(seen.slices, (std::vector<std::int64_t>{4, 8}));
    EXPECT_TRUE(same_bytes(picture, run_on(front_to_back_over(), want, front_of(samples, 8))));
}

TEST(Refinement, IsPricedAboveOnePicture) {
    const Request want = request_of({301, 9, 21});
    const Scene scene;
    const Ask ask{want, scene};
    const Data samples = classified(want, 1);
    const Transition edge = front_to_back_over();
    const Offer once = edge.offer(samples.what, ask, {{"every", 0.0}});
    const Offer often = edge.offer(samples.what, ask, {{"every", 2.0}});
    EXPECT_GT(edge.work(often, ask, 0).streamed, edge.work(once, ask, 0).streamed);
    EXPECT_GE(edge.work(often, ask, 0).workspace, 301 * 9 * 16);
    EXPECT_EQ(edge.parts(often, ask).kind, Partition::whole);
    EXPECT_EQ(edge.parts(once, ask).kind, Partition::output);
}

// Refusals.

std::string refusal(const Transition& edge, const Request& want, const Representation& from,
                    const Parameters& with, const Scene& scene = {}) {
    return edge.offer(from, {want, scene}, with).refused;
}

TEST(Classify, RefusesWhatItCannotDo) {
    const Extent extent{8, 8, 8};
    const Representation from = scalars(extent, 1).what;
    const auto expect = [&](const Request& want, const char* text, const Scene& scene = {},
                            const std::optional<Representation>& other = {}) {
        EXPECT_NE(refusal(classify(), want, other.value_or(from), {}, scene).find(text),
                  std::string::npos)
            << text;
    };
    Request want = request_of(extent);
    EXPECT_EQ(refusal(classify(), want, from, {}), "");
    want.mode = mode_named("mip");
    expect(want, "mip: nobody reads");
    want = request_of(extent);
    want.eye = Eye{};
    expect(want, "the eye is at a finite distance");
    want = request_of(extent);
    want.clips = {clip_of(extent, std::vector<HalfSpace>{{Vec3::UnitX(), -3}})};
    expect(want, "the clip cuts slices");
    want = request_of(extent);
    want.shading.by = Shade::phong;
    expect(want, "light needs gradients");
    want = request_of(extent);
    Scene scene;
    scene.non_finite = 3;
    expect(want, "3 samples are not finite", scene);
    Representation other = from;
    other.channels = 3;
    expect(want, "3 channels", {}, other);
    other = from;
    other.place = Place::ranks;
    other.layout = Layout::columns;
    expect(want, "spread over ranks", {}, other);
}

TEST(Orders, RefuseWhatTheyCannotDo) {
    const Request want = request_of({8, 8, 8});
    const Representation from = classified(want, 1).what;
    for (const Transition& edge : orders()) {
        const Parameters with = usual(edge);
        EXPECT_EQ(refusal(edge, want, from, with), "");
        Representation other = from;
        other.channels = 1;
        EXPECT_NE(refusal(edge, want, other, with).find("1 channels"), std::string::npos);
        other = from;
        other.place = Place::disk;
        EXPECT_NE(refusal(edge, want, other, with).find("in memory"), std::string::npos);
        Request mip = want;
        mip.mode = mode_named("mip");
        EXPECT_NE(refusal(edge, mip, from, with).find("mip"), std::string::npos);
        Request warp = want;
        warp.job = Job::warp;
        EXPECT_NE(refusal(edge, warp, from, with).find("not a picture"), std::string::npos);
    }
    EXPECT_NE(refusal(binary_tree_front_to_back_over(), want, from, {{"first", 12.0}})
                  .find("first=12: trees"),
              std::string::npos);
    EXPECT_NE(refusal(front_to_back_over(), want, from, {{"every", 2.5}}).find("every=2.5"),
              std::string::npos);
}

}  // namespace
}  // namespace edgewise
