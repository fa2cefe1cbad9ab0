#include "reference/verify.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <tbb/global_control.h>

#include "reference/interval.hpp"

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

Request turned(const Data& data, Job job, int frames) {
    Request want;
    want.job = job;
    want.axes = data.what.axes;
    want.input = data.what.extent;
    want.frames = frames;
    want.screen = {80, 70, job == Job::warp && want.axes == 2 ? 1 : 80};
    const Vec3 middle = 0.5 * Vec3(79, 69, static_cast<double>(want.screen.z - 1));
    const Extent& n = data.what.extent;
    const Vec3 centre = 0.5 * Vec3(static_cast<double>(n.x - 1), static_cast<double>(n.y - 1),
                                   static_cast<double>(n.z - 1));
    std::vector<Mat4> views;
    for (int view = 0; view < frames; ++view) {
        const Eigen::Affine3d map =
            Eigen::Translation3d(middle) *
            Eigen::AngleAxisd(0.4 + view, want.axes == 2 ? Vec3(0, 0, 1) : Vec3(0, 1, 0)) *
            Eigen::Translation3d(-centre);
        views.push_back(map.matrix());
    }
    want.views = Placement::each(views);
    return want;
}

/// All frames of a request as another field than the reference's would have them.
std::vector<Data> results(const Request& want, const ReferenceField& field) {
    const Reference reference(want, field, heap());
    Representation what;
    what.extent = want.output();
    what.channels = reference.channels();
    std::vector<Data> frames;
    for (int frame = 0; frame < want.frames; ++frame) {
        Data data = Data::make(what, heap());
        std::vector<OutputSample> all;
        for (std::int64_t z = 0; z < what.extent.z; ++z)
            for (std::int64_t y = 0; y < what.extent.y; ++y)
                for (std::int64_t x = 0; x < what.extent.x; ++x) all.push_back({frame, x, y, z});
        const auto values = reference.values(all);
        for (std::size_t i = 0; i < values.size(); ++i)
            data.as<float>()[i] = std::isnan(values[i]) ? 0 : static_cast<float>(values[i]);
        frames.push_back(std::move(data));
    }
    return frames;
}

Verified verified(const Request& want, const ReferenceField& field, const std::vector<Data>& frames,
                  std::int64_t samples, std::uint64_t seed) {
    Verifier verifier(want, field, samples, seed, heap());
    for (int frame = 0; frame < want.frames; ++frame)
        verifier.frame(frame, frames[static_cast<std::size_t>(frame)]);
    return verifier.finish();
}

/// Errors of nearest samples against the formula, counted plainly.
TEST(Verifier, AgreesWithACountOverAllSamples) {
    const Data data = make_phantom("zone-plate", 64, heap());
    const Phantom phantom = phantom_named("zone-plate", 64);
    const Request want = turned(data, Job::warp, 2);
    const ReferenceField field(data, Field::formula, &phantom), other(data, Field::nearest);
    const std::vector<Data> frames = results(want, other);
    const Reference reference(want, field, heap());
    double sum = 0, low = 2, high = -2, largest = 0;
    std::int64_t count = 0;
    for (int frame = 0; frame < 2; ++frame)
        for (std::int64_t i = 0; i < 80 * 70; ++i) {
            const Vec3 p = want.views.at(frame).inverse().apply(
                Vec3(static_cast<double>(i % 80), static_cast<double>(i / 80), 0));
            if (p.x() < -0.5 || p.x() > 63.5 || p.y() < -0.5 || p.y() > 63.5) continue;
            const double expected = phantom.at(p);
            const double d =
                static_cast<double>(frames[static_cast<std::size_t>(frame)].as<float>()[i]) -
                expected;
            sum += d * d;
            largest = std::max(largest, std::abs(d));
            low = std::min(low, expected);
            high = std::max(high, expected);
            ++count;
        }
    const Verified all = verified(want, field, frames, 0, 1);
    EXPECT_EQ(all.samples, count);
    EXPECT_NEAR(all.range, high - low, 1e-12);
    EXPECT_NEAR(all.max, largest, 1e-12);
    EXPECT_NEAR(all.nrmse, std::sqrt(sum / static_cast<double>(count)) / (high - low), 1e-9);
    EXPECT_EQ(all.low, all.nrmse);
    EXPECT_EQ(all.high, all.nrmse);
}

/// What it remembers of the reference judges the next results of the same request alike.
TEST(Verifier, ComparesOneResultAfterTheOther) {
    const Data data = make_phantom("zone-plate", 64, heap());
    const Phantom phantom = phantom_named("zone-plate", 64);
    const Request want = turned(data, Job::warp, 2);
    const ReferenceField field(data, Field::formula, &phantom);
    const ReferenceField nearest(data, Field::nearest), linear(data, Field::linear);
    for (const std::int64_t samples : {0, 500}) {
        Verifier verifier(want, field, samples, 1, heap());
        for (const ReferenceField* held : {&nearest, &linear, &nearest}) {
            const std::vector<Data> frames = results(want, *held);
            for (int frame = 0; frame < 2; ++frame)
                verifier.frame(frame, frames[static_cast<std::size_t>(frame)]);
            const Verified next = verifier.finish();
            const Verified alone = verified(want, field, frames, samples, 1);
            EXPECT_EQ(next.samples, alone.samples);
            // What is drawn follows the first result; each is judged without bias.
            const bool is_first = held == &nearest;
            if (samples == 0 || is_first) {
                EXPECT_EQ(next.nrmse, alone.nrmse);
                EXPECT_EQ(next.range, alone.range);
            } else {
                const Verified all = verified(want, field, frames, 0, 1);
                EXPECT_LE(next.low, all.nrmse);
                EXPECT_GE(next.high, all.nrmse);
                EXPECT_NEAR(next.range, all.range, 0.01 * all.range);
            }
        }
    }
}

struct Case {
    const char* name;
    Job job;
    Mode mode;
};

/// Samples that are 0 but for a few peaks of one sample each.
Data peaks(std::int64_t side, int count) {
    Representation what;
    what.extent = {side, side, side};
    Data data = Data::make(what, heap());
    std::fill_n(data.as<float>(), what.samples(), 0.0F);
    std::mt19937_64 bits(3);
    for (int i = 0; i < count; ++i)
        data.as<float>()[bits() % static_cast<unsigned>(what.samples())] = 1;
    return data;
}

Data data_of(const std::string& name) {
    if (name == "one_peak") return peaks(40, 1);
    if (name == "some_peaks") return peaks(40, 30);
    return make_phantom(name, 40, heap());
}

class Intervals : public testing::TestWithParam<Case> {};

/// The full error lies in the interval for 95 of 100 seeds: of 100, at least 91 (95 % less two
/// standard deviations of a binomial). Where nothing that errs is left to chance the interval is
/// the error itself, but for the rounding of sums.
TEST_P(Intervals, HoldTheFullError) {
    const Data data = data_of(GetParam().name);
    Request want = turned(data, GetParam().job, 2);
    want.mode = GetParam().mode;
    want.transfer.points = {{0, 0, {0, 0, 0}}, {1, 0.3, {1, 1, 1}}};
    const ReferenceField field(data, Field::linear), other(data, Field::nearest);
    const std::vector<Data> frames = results(want, other);
    const Verified all = verified(want, field, frames, 0, 1);
    constexpr std::uint64_t kSeeds = 100;
    int held = 0;
    double width = 0, mean = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        const Verified some = verified(want, field, frames, 400, seed);
        EXPECT_EQ(some.samples, 400);
        EXPECT_NEAR(some.range, all.range, 0.02 * all.range);
        held += some.low <= all.nrmse * (1 + 1e-9) && all.nrmse * (1 - 1e-9) <= some.high;
        width += (some.high - some.low) / all.nrmse / kSeeds;
        mean += some.nrmse * some.nrmse / kSeeds;
    }
    RecordProperty("held", held);
    RecordProperty("width", std::to_string(width));
    EXPECT_GE(held, 91);
    EXPECT_LT(width, 0.7);
    // Squares are off by twice as much as roots: standard errors of 0.35 at most, whose mean over
    // the seeds is surer by their root.
    EXPECT_NEAR(mean, all.nrmse * all.nrmse, 3 * 0.035 * all.nrmse * all.nrmse);
}
INSTANTIATE_TEST_SUITE_P(
    Requests, Intervals,
    testing::Values(
        Case{"zone-plate", Job::warp, Mode::mip}, Case{"checker", Job::warp, Mode::mip},
        Case{"gaussians", Job::warp, Mode::mip}, Case{"one_peak", Job::warp, Mode::mip},
        Case{"some_peaks", Job::warp, Mode::mip}, Case{"shepp-logan", Job::render, Mode::mip},
        Case{"gaussians", Job::render, Mode::mip}, Case{"one_peak", Job::render, Mode::mip},
        Case{"some_peaks", Job::render, Mode::xray}, Case{"sphere", Job::render, Mode::xray},
        Case{"noise", Job::render, Mode::composite}),
    [](const auto& tested) { return "number_" + std::to_string(tested.index); });

/// Where no draw has met a jump, some of the pixels that were not drawn may.
TEST(Verifier, LeavesRoomForJumpsThatNoDrawHasMet) {
    const Data data = make_phantom("gaussians", 40, heap());
    const ReferenceField field(data, Field::linear);
    for (const char* name : {"binary", "surface", "mip"}) {
        Request want = turned(data, Job::render, 1);
        want.mode = mode_named(name);
        if (want.mode->takes_level) want.surface = SurfaceOf{0.4};
        const std::vector<Data> frames = results(want, field);
        const Verified all = verified(want, field, frames, 0, 1);
        EXPECT_EQ(all.at_most, all.high);
        for (const std::int64_t samples : {100, 400}) {
            const Verified some = verified(want, field, frames, samples, 1);
            if (!want.mode->threshold) {
                EXPECT_EQ(some.at_most, some.high);
                continue;
            }
            // Half of the draws or more are even: 3 in as many, or in all of them.
            const double share = some.at_most * some.at_most - some.high * some.high;
            EXPECT_GE(share, 2.9 / static_cast<double>(some.samples)) << name;
            EXPECT_LE(share, 6.1 / static_cast<double>(some.samples)) << name;
        }
    }
}

/// Results that are wrong where nothing in the data tells: the guess is compared with the results.
TEST(Verifier, FindsWrongPlacesThatTheDataDoNotTell) {
    const Data data = make_phantom("gaussians", 40, heap());
    Request want = turned(data, Job::render, 1);
    want.mode = Mode::xray;
    const ReferenceField field(data, Field::linear);
    std::vector<Data> frames = results(want, field);
    for (int i = 0; i < 6; ++i) frames[0].as<float>()[80 * (30 + i) + 41] += 5;
    const Verified all = verified(want, field, frames, 0, 1);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Verified some = verified(want, field, frames, 250, seed);
        EXPECT_EQ(some.samples, 250);
        EXPECT_NEAR(some.nrmse, all.nrmse, 1e-6 * all.nrmse) << "all of them are certain";
        EXPECT_LE(some.high - some.low, 0.05 * all.nrmse);
    }
}

TEST(Verifier, TakesAllWhereThatIsAtMostFourTimesAsMuch) {
    const Data data = make_phantom("gaussians", 40, heap());
    const Request want = turned(data, Job::render, 1);
    const ReferenceField field(data, Field::spline), other(data, Field::linear);
    const std::vector<Data> frames = results(want, other);
    const Verified all = verified(want, field, frames, 0, 1);
    const Verified some = verified(want, field, frames, (all.samples + 3) / 4, 1);
    EXPECT_EQ(some.samples, all.samples);
    EXPECT_EQ(some.nrmse, all.nrmse);
    EXPECT_EQ(some.low, all.nrmse);
    EXPECT_EQ(some.high, all.nrmse);
    EXPECT_LT(verified(want, field, frames, all.samples / 4 - 1, 1).samples, all.samples);
}

/// Of a composite its colours over the background are written: 3 channels, no opacity.
TEST(Verifier, ComparesWhatIsWritten) {
    const Data data = make_phantom("gaussians", 20, heap());
    Request want = turned(data, Job::render, 1);
    want.mode = Mode::composite;
    want.transfer.points = {{0, 0, {0, 0, 0}}, {1, 0.3, {1, 0.5, 0}}};
    want.background = {0, 0, 0.5};
    const ReferenceField field(data, Field::linear);
    std::vector<Data> frames = results(want, field);
    const Reference reference(want, field, heap());
    double low = 9, high = -9;
    std::int64_t count = 0;
    for (std::int64_t i = 0; i < 80 * 70; ++i) {
        if (!reference.sees_input({0, i % 80, i / 80, 0})) continue;
        ++count;
        float* pixel = frames[0].as<float>() + 4 * i;
        for (int c = 0; c < 3; ++c) {
            const double value = pixel[c] + (1 - pixel[3]) * want.background[c];
            low = std::min(low, value);
            high = std::max(high, value);
        }
        // Over the background blue is off by 0.125, and nothing else.
        pixel[3] += 0.25F;
    }
    const Verified all = verified(want, field, frames, 0, 1);
    EXPECT_EQ(all.samples, count);
    EXPECT_NEAR(all.range, high - low, 1e-6);
    EXPECT_NEAR(all.nrmse * all.range, 0.125 / std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(all.max, 0.125, 1e-6);
}

TEST(Verifier, CountsLabelsThatDiffer) {
    const Data data = make_phantom("checker", 64, heap());
    const Request want = turned(data, Job::warp, 1);
    const ReferenceField field(data, Field::nearest);
    std::vector<Data> frames = results(want, field);
    EXPECT_EQ(verified(want, field, frames, 0, 1).nrmse, 0);
    const Reference reference(want, field, heap());
    std::int64_t seen = 0, changed = 0;
    for (std::int64_t i = 0; i < 80 * 70; ++i) {
        if (!reference.sees_input({0, i % 80, i / 80, 0})) continue;
        if (++seen % 10) continue;
        ++changed;
        frames[0].as<float>()[i] = 7;  // how far off does not matter
    }
    const Verified all = verified(want, field, frames, 0, 1);
    EXPECT_NEAR(all.nrmse, std::sqrt(static_cast<double>(changed) / static_cast<double>(seen)),
                1e-12);
    const Verified some = verified(want, field, frames, 500, 3);
    EXPECT_LE(some.low, all.nrmse);
    EXPECT_GE(some.high, all.nrmse);
}

/// On a face between two labels either is right, and neither tells anything.
TEST(Verifier, LeavesOutWhereNoLabelIsNearest) {
    Representation what;
    what.extent = {9, 6, 1};
    what.axes = 2;
    Data data = Data::make(what, heap());
    for (std::int64_t i = 0; i < what.samples(); ++i) data.as<float>()[i] = float(i % 9 < 4);
    Request want;
    want.job = Job::warp;
    want.axes = 2;
    want.input = want.screen = what.extent;
    want.field = Field::nearest;
    Mat4 shift = Mat4::Identity();
    shift(0, 3) = 0.5;
    want.views = shift;
    const ReferenceField field(data, Field::nearest);
    Data result = Data::make(what, heap());
    // Taken from the left, where the reference takes the right one: the face at 3.5 lies under x
    // = 4.
    for (std::int64_t i = 0; i < what.samples(); ++i) result.as<float>()[i] = float(i % 9 < 5);
    std::vector<Data> frames;
    frames.push_back(std::move(result));
    const Verified all = verified(want, field, frames, 0, 1);
    EXPECT_EQ(all.nrmse, 0);
    EXPECT_EQ(all.samples, what.samples() - 6);
    frames[0].as<float>()[0] = 0;  // all others still count
    EXPECT_NEAR(verified(want, field, frames, 0, 1).nrmse, std::sqrt(1.0 / double(all.samples)),
                1e-12);
}

/// What is compared is what a file of integers says, clipped at the ends of its type.
TEST(Verifier, RoundsResultsAsTheyAreWritten) {
    const Data data = make_phantom("gaussians", 40, heap());
    Request want = turned(data, Job::warp, 1);
    const ReferenceField field(data, Field::linear);
    const std::vector<Data> frames = results(want, field);
    ASSERT_LT(verified(want, field, frames, 0, 1).nrmse, 1e-6);  // f32 rounds
    // 0.25 is a step of quarters; the last of 0, 0.25 ... 0.75 that i8 has here is 0.5.
    want.written = WrittenAs{.type = Type::i8, .values = {0.25, -31.25}};
    const Reference reference(want, field, heap());
    double squares = 0, most = 0;
    std::int64_t seen = 0;
    for (std::int64_t i = 0; i < want.output().samples(); ++i) {
        const OutputSample at{0, i % 80, i / 80 % 70, i / 5600};
        if (!reference.sees_input(at)) continue;
        const double value = frames[0].as<float>()[i];
        const double written = std::min(0.5, 0.25 * std::nearbyint(value / 0.25));
        squares += (written - value) * (written - value);
        most = std::max(most, std::abs(written - value));
        ++seen;
    }
    const Verified found = verified(want, field, frames, 0, 1);
    const double rms = std::sqrt(squares / static_cast<double>(seen));
    ASSERT_GT(rms, 0.04);
    EXPECT_NEAR(found.nrmse * found.range, rms, 1e-6);
    EXPECT_NEAR(found.max, most, 1e-6);
}

TEST(Verifier, NoticesResultsThatAreNotFinite) {
    const Data data = make_phantom("gaussians", 40, heap());
    const Request want = turned(data, Job::render, 1);
    const ReferenceField field(data, Field::linear);
    std::vector<Data> frames = results(want, field);
    frames[0].as<float>()[40 + 80 * 35] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(std::isfinite(verified(want, field, frames, 0, 1).nrmse));
}

TEST(Verifier, IsZeroWhereNothingSeesTheInput) {
    const Data data = make_phantom("gaussians", 20, heap());
    Request want = turned(data, Job::render, 1);
    Mat4 away = want.views.at(0).matrix();
    away(0, 3) += 1000;
    want.views = away;
    const ReferenceField field(data, Field::linear);
    const std::vector<Data> frames = results(want, field);
    for (std::int64_t samples : {0, 100}) {
        const Verified none = verified(want, field, frames, samples, 1);
        EXPECT_EQ(none.nrmse, 0);
        EXPECT_EQ(none.samples, 0);
    }
}

TEST(Verifier, DoesNotDependOnThreads) {
    const Data data = make_phantom("marschner-lobb", 50, heap());
    const Request want = turned(data, Job::render, 3);
    const ReferenceField field(data, Field::spline), other(data, Field::linear);
    const std::vector<Data> frames = results(want, other);
    const auto run = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Verified v = verified(want, field, frames, 300, 9);
        return std::array{v.nrmse, v.low, v.high, v.max, v.range};
    };
    const auto one = run(1);
    EXPECT_EQ(one, run(2));
    EXPECT_EQ(one, run(7));
}

/// Rounding is no range: results of a constant are off by parts of its magnitude.
TEST(Verifier, TakesTheMagnitudeOfAConstant) {
    Representation what;
    what.extent = {12, 12, 12};
    Data data = Data::make(what, heap());
    for (const float value : {0.1F, -700.0F, 0.0F}) {
        std::fill_n(data.as<float>(), what.samples(), value);
        for (const Mode mode : {Mode::mip, Mode::mean}) {
            Request want = turned(data, Job::render, 1);
            want.mode = mode;
            const ReferenceField field(data, Field::spline);
            const Verified all = verified(want, field, results(want, field), 0, 1);
            EXPECT_NEAR(all.range, value == 0 ? 1 : std::abs(value), 1e-4 * std::abs(value));
            EXPECT_LT(all.nrmse, 1e-6);
        }
        // An X-ray that takes the constant away leaves rounding.
        Request want = turned(data, Job::render, 1);
        want.mode = Mode::xray;
        want.zero = value * (1 + 1e-8);
        const ReferenceField field(data, Field::spline);
        EXPECT_EQ(verified(want, field, results(want, field), 0, 1).range, 1);
    }
}

TEST(RangeBetween, IsNeverZero) {
    EXPECT_EQ(range_between(-2, 3), 5);
    EXPECT_EQ(range_between(-2, -2), 2);
    EXPECT_EQ(range_between(0, 0), 1);
    EXPECT_EQ(range_between(1, 0), 1);
    EXPECT_EQ(range_between(1000, std::nextafter(1000.0F, 2000.0F)),
              std::nextafter(1000.0F, 2000.0F));
    EXPECT_EQ(range_between(0, 1e-9), 1e-9);
    EXPECT_EQ(range_between(-1e-9, 1e-9, 1), 1) << "what is left of 1 - 1";
}

TEST(RootSumInterval, HoldsTheSumAlsoOfManyHeavyTailedParts) {
    // Half of 24000 squares are drawn, each with the same chance; one in fifty is 100 times larger.
    constexpr int kThere = 24000, kSeeds = 40;
    int held = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> uniform(0, 1);
        std::vector<Part> parts;
        double sum = 0, most = 0;
        for (int i = 0; i < kThere; ++i) {
            const double value = (uniform(random) < 0.02 ? 100 : 1) * uniform(random) / kThere;
            sum += value;
            most = std::max(most, value * kThere);
            if (uniform(random) < 0.5)
                parts.push_back({.value = value / 0.5, .missing = 0.5, .square = value * kThere});
        }
        const Interval found =
            root_sum_interval(parts, {.looked = kThere, .seen = 1, .least = 0, .most = most}, 1);
        held += found.low <= std::sqrt(sum) && std::sqrt(sum) <= found.high;
        // One standard error is 3.5 % of the sum, 1.8 % of its root: of normal sums the ends lie
        // 7 % apart. The tail takes up to two thirds more.
        EXPECT_LT(found.high / found.low, 1.12) << seed;
    }
    EXPECT_GE(held, 35);  // 95 % of 40 less two standard deviations of a binomial
}

TEST(RootShareInterval, IsWilsons) {
    // 10 of 100: Wilson's interval is 0.05522914, 0.17436566.
    const Interval interval = root_share_interval(10, 100);
    EXPECT_NEAR(interval.low * interval.low, 0.0552291, 1e-6);
    EXPECT_NEAR(interval.high * interval.high, 0.1743657, 1e-6);
    EXPECT_EQ(root_share_interval(0, 50).low, 0);
    EXPECT_GT(root_share_interval(0, 50).high, 0);
}

}  // namespace
}  // namespace edgewise
