#include "planner/cost.hpp"

#include <gtest/gtest.h>
#include <set>

namespace edgewise {
namespace {

Representation made(double bytes, int runs) {
    Representation what;
    what.type = Type::u8;
    what.extent = {static_cast<std::int64_t>(bytes), 1, 1};
    std::vector<Mat4> maps(runs, Mat4::Identity());
    for (int view = 0; view < runs; ++view) maps[view](0, 3) = view;
    if (runs > 1) what.placed = Placement::each(maps);
    return what;
}

TEST(Label, InputStaysOnlyForNextViews) {
    StepCost cost;
    cost.seconds = 2;
    cost.scratch = 5;
    cost.made = 10;
    const Label start{.seconds = 1, .peak = 3, .held = 7};
    // One run to one run: input and output side by side, nothing kept.
    Label next = extend(start, {.from = made(100, 1), .to = made(10, 1)}, cost, false, 1000);
    EXPECT_EQ(next.seconds, 3);
    EXPECT_EQ(next.held, 7);
    EXPECT_EQ(next.peak, 1000 + 7 + 100 + 10 + 5);
    // One run to four: the input is held from here on.
    next = extend(start, {.from = made(100, 1), .to = made(10, 4)}, cost, false, 1000);
    EXPECT_EQ(next.held, 107);
    EXPECT_EQ(next.peak, 1000 + 107 + 10 + 5);
    // A source is pinned already.
    next = extend(start, {.from = made(100, 1), .to = made(10, 4)}, cost, true, 1000);
    EXPECT_EQ(next.held, 7);
    EXPECT_EQ(next.peak, 1000 + 7 + 10 + 5);
    // A peak behind us is not forgotten.
    next = extend({.peak = 1e6}, {.from = made(1, 1), .to = made(1, 1)}, cost, false, 0);
    EXPECT_EQ(next.peak, 1e6);
}

TEST(Label, BiasAddsAndNoiseAddsInSquares) {
    StepCost cost;
    cost.error = {.gain = 2, .noise_gain = 3, .bias = 1, .noise = 8};
    const Label next =
        extend({.bias = 5, .noise = 5}, {.from = made(1, 1), .to = made(1, 1)}, cost, false, 0);
    EXPECT_EQ(next.bias, 11);
    EXPECT_EQ(next.noise, 17);  // 15, 8, 17
    EXPECT_DOUBLE_EQ(next.error(), std::hypot(11, 17));
    cost.error = Error::unknown();
    EXPECT_FALSE(extend({}, {.from = made(1, 1), .to = made(1, 1)}, cost, false, 0).known);
}

TEST(Label, RoundingCountsWhereSamplesAreNoCopies) {
    StepCost cost;
    cost.error = {.noise = 3, .copies = true};
    cost.rounding = 4;
    const Offer offer{.from = made(1, 1), .to = made(1, 1)};
    EXPECT_EQ(extend({}, offer, cost, false, 0).noise, 3);
    EXPECT_EQ(extend({.copied = false}, offer, cost, false, 0).noise, 5);
    cost.error.copies = false;
    const Label computed = extend({}, offer, cost, false, 0);
    EXPECT_EQ(computed.noise, 5);
    EXPECT_FALSE(computed.copied);

    Request want;
    Scene scene{.low = -100, .high = 50};
    EXPECT_EQ(rounding_of({want, scene}), 0);
    want.written = WrittenAs{.type = Type::i16, .values = {6, 0}};
    EXPECT_DOUBLE_EQ(rounding_of({want, scene}), 6 / std::sqrt(12.0));
    scene.facts["written"] = 2.5;  // measured
    EXPECT_EQ(rounding_of({want, scene}), 2.5);
}

TEST(Label, FilesInF32RoundCopiesOfSamplesWithMoreDigits) {
    Transition copying;
    copying.name = "toy.copying";
    copying.error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; };
    Request want;
    want.job = Job::warp;
    want.written = WrittenAs{.type = Type::f32};
    Offer offer{.from = made(1, 1), .to = made(1, 1)};
    offer.to.space = "screen";
    Scene scene{.low = -100, .high = 50};
    EXPECT_EQ(counted_error(copying, offer, {want, scene}).noise, 0)
        << "nothing measured: most results are f32 already";
    scene.facts["written"] = 2e-6;  // measured
    const Error error = counted_error(copying, offer, {want, scene});
    EXPECT_TRUE(error.copies);
    ASSERT_TRUE(is_target(offer.to, want));
    EXPECT_EQ(error.noise, 2e-6);
    EXPECT_EQ(rounding_of({want, scene}), 2e-6);
    want.written = WrittenAs{.type = Type::i16};
    EXPECT_EQ(counted_error(copying, offer, {want, scene}).noise, 0) << "the samples' own type";
}

TEST(Label, DominanceIsWeakAndInAllResources) {
    const Label a{.seconds = 1, .peak = 1, .held = 1, .bias = 1, .noise = 1};
    EXPECT_TRUE(dominates(a, a));
    for (double Label::*resource :
         {&Label::seconds, &Label::peak, &Label::held, &Label::bias, &Label::noise}) {
        Label worse = a;
        worse.*resource += 1;
        EXPECT_TRUE(dominates(a, worse));
        EXPECT_FALSE(dominates(worse, a));
        EXPECT_TRUE(before(a, worse));
        EXPECT_FALSE(before(worse, a));
    }
    Label computed = a;
    computed.copied = false;
    EXPECT_FALSE(dominates(computed, a));
    EXPECT_TRUE(dominates(a, computed));
    EXPECT_TRUE(before(a, computed));
    Label unknown = a;
    unknown.known = false;
    EXPECT_FALSE(dominates(unknown, a));
    EXPECT_TRUE(dominates(a, unknown));
    EXPECT_TRUE(before(a, unknown));
    EXPECT_FALSE(before(a, a));
}

/// Costs that grow with the view, to see which views were asked.
Transition graded(Partition parts = {}) {
    return {
        .name = "toy.graded",
        .work =
            [](const Offer&, const Ask&, int view) {
                Work work;
                work.operations = view;
                work.scratch = 1 + view;
                work.workspace = 1000 + view;
                return work;
            },
        .parts = [parts](const Offer&, const Ask&) { return parts; },
    };
}

Profile one_second_an_operation() {
    Profile profile;
    profile.operation = 1;
    profile.start = 0;
    profile.serial = 0;
    return profile;
}

TEST(Cost, AskedForAtMostEightViewsAndScaledToAll) {
    const Request want;
    const Scene scene;
    for (const int runs : {1, 3, 8, 360}) {
        const Offer offer{.from = made(1, 1), .to = made(1, runs)};
        const StepCost cost = cost_of(graded(), offer, {want, scene}, one_second_an_operation(), 2);
        const int asked = std::min(runs, 8), last = (asked - 1) * runs / asked;
        double sum = 0;
        for (int i = 0; i < asked; ++i) sum += i * runs / asked;
        EXPECT_NEAR(cost.seconds, runs * sum / asked / 2, 1e-9 * runs);  // two threads share
        EXPECT_EQ(cost.scratch, (1 + last) * 2 + 1000 + last);  // the largest, once a thread
    }
}

TEST(Cost, ViewsThatAreWorkedOnDifferentlyArePricedByTheirVariants) {
    const Request want;
    const Scene scene;
    Transition edge = graded();
    edge.work = [](const Offer&, const Ask&, int view) {
        return Work{.operations = view < 3 ? 10.0 : 20.0, .variant = view < 3 ? "rows" : "columns"};
    };
    Profile profile = one_second_an_operation();
    profile.spread = 0;
    const auto rates = [&](double rows, double columns) {
        profile.rates = rates_of(std::map<std::string, std::vector<Timed>>{
            {"toy.graded/rows 3d u8",
             {{.counted = 10, .alone = 10 * rows, .together = 10 * rows, .runs = 9}}},
            {"toy.graded/columns 3d u8",
             {{.counted = 20, .alone = 20 * columns, .together = 20 * columns, .runs = 9}}}});
    };
    const auto seconds = [&](int runs) {
        const Offer offer{.from = made(1, 1), .to = made(1, runs)};
        return cost_of(edge, offer, {want, scene}, profile, 1).seconds;
    };
    rates(2, 5);
    EXPECT_NEAR(seconds(1), 20, 1e-4);
    EXPECT_NEAR(seconds(3), 3 * 20, 1e-3);
    EXPECT_NEAR(seconds(8), 3 * 20 + 5 * 100, 1e-2);
    rates(2, 1);
    EXPECT_NEAR(seconds(8), 3 * 20 + 5 * 20, 1e-2);
    const Offer offer{.from = made(1, 1), .to = made(1, 8)};
    const Work mean = cost_of(edge, offer, {want, scene}, profile, 1).work;
    EXPECT_DOUBLE_EQ(mean.operations, (3 * 10 + 5 * 20) / 8.0);
    EXPECT_EQ(mean.variant, "rows") << "the first view's";
}

TEST(Cost, PartsThatAreMergedAreCounted) {
    const Request want;
    const Scene scene;
    Offer offer{.from = made(1, 1), .to = made(100, 1)};
    offer.from.extent = {4, 4, 10};
    const Partition parts{.kind = Partition::input, .leaf = {4, 4, 2}};
    ASSERT_EQ(regions_of(parts, offer).size(), 5u);
    const StepCost cost =
        cost_of(graded(parts), offer, {want, scene}, one_second_an_operation(), 1);
    EXPECT_EQ(cost.scratch, 1 + 1000 + 4 * 100);  // the first part is the output itself
}

TEST(Cost, AccessesLieWithinInputAndOutputUnlessTheEdgeKnowsBetter) {
    Request want;
    const Scene scene;
    const Profile profile = one_second_an_operation();
    Offer offer{.from = made(1000, 1), .to = made(60, 1)};
    StepCost cost = cost_of(graded(), offer, {want, scene}, profile, 1);
    EXPECT_EQ(cost.work.lines.span, 1000);
    EXPECT_EQ(cost.work.swept, 1060);
    Transition own = graded();
    own.work = [](const Offer&, const Ask&, int view) {
        return Work{.swept = 20, .lines = {.span = 10.0 + view}};
    };
    cost = cost_of(own, offer, {want, scene}, profile, 1);
    EXPECT_EQ(cost.work.lines.span, 10);
    EXPECT_EQ(cost.work.swept, 20);
    want.ranks = 4;  // bytes are those of one
    offer.from.place = Place::ranks;
    cost = cost_of(graded(), offer, {want, scene}, profile, 1);
    EXPECT_EQ(cost.work.lines.span, 250);
    EXPECT_EQ(cost.work.swept, 310);
}

TEST(Cost, LevelsOfMemoryPriceWhatIsRead) {
    const Request want;
    const Scene scene;
    Profile profile = one_second_an_operation();
    profile.levels = {{.bytes = 100, .gather = 1, .line = 1.5}, {.gather = 3, .line = 9}};
    Transition edge = graded();
    edge.work = [](const Offer&, const Ask&, int) { return Work{.gathers = 8, .lines = 2}; };
    const auto seconds = [&](double bytes) {
        const Offer offer{.from = made(bytes, 1), .to = made(1, 1)};
        return cost_of(edge, offer, {want, scene}, profile, 1).seconds;
    };
    EXPECT_DOUBLE_EQ(seconds(50), 8);
    // Two lines come from where all the data are, behind all others.
    EXPECT_DOUBLE_EQ(seconds(200), 8 + 2 * (9 - 1.5));
    EXPECT_DOUBLE_EQ(seconds(75), 8 + 2 * line_again(profile.levels, 75));
    EXPECT_LT(seconds(75), seconds(200));
}

TEST(Cost, RandomOnesHangOnEdgeParametersAndSeed) {
    std::set<double> all;
    for (const char* name : {"a.b", "a.c"})
        for (const double step : {1.0, 2.0})
            for (const std::uint64_t seed : {1, 2}) {
                Transition edge{.name = name};
                const Offer offer{.with = {{"step", step}}};
                StepCost one, two;
                randomise(one, edge, offer, seed);
                randomise(two, edge, offer, seed);
                EXPECT_EQ(one.seconds, two.seconds);
                EXPECT_GT(one.seconds, 0);
                EXPECT_LE(one.seconds, 1);
                all.insert(one.seconds);
            }
    EXPECT_EQ(all.size(), 8u);
}

}  // namespace
}  // namespace edgewise
