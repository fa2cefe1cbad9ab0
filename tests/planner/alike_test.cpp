#include "planner/alike.hpp"

#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "tests/planner/random_graph.hpp"
#include "transitions/filters/like_linear.hpp"

namespace edgewise {
namespace {

using toys::unit_profile;

Representation at(const std::string& space) {
    Representation what;
    what.space = space;
    what.type = Type::u8;
    return what;
}

using Number = std::function<double(const Offer&, const Ask&)>;

/// One operation is one second with unit_profile().
Transition edge(const std::string& name, const std::string& from, const std::string& to,
                Number seconds, Number error, std::vector<std::string> filters = {}) {
    Transition made;
    made.name = name;
    made.joins = {{at(from).kind(), at(to).kind()}};
    if (!filters.empty()) made.parameters = {{"filter", one_of(std::move(filters))}};
    made.offer = [to](const Representation& here, const Ask&, const Parameters& with) {
        return Offer{.from = here, .to = at(to), .with = with};
    };
    made.work = [seconds](const Offer& offer, const Ask& ask, int) {
        return Work{.operations = seconds(offer, ask)};
    };
    made.error = [error](const Offer& offer, const Ask& ask) {
        return Error{.bias = error(offer, ask)};
    };
    return made;
}

Number fixed(double number) {
    return [number](const Offer&, const Ask&) { return number; };
}

Number by_filter(std::map<std::string, double> numbers) {
    return
        [numbers](const Offer& offer, const Ask&) { return numbers.at(offer.with.word("filter")); };
}

Number fact(const std::string& name, double factor = 1) {
    return [=, fact = FactName(name)](const Offer&, const Ask& ask) {
        return factor * ask.scene.fact(fact).value_or(0.5);
    };
}

/// The plain way of these tests: nearest samples take 1 s and err by 1, linear ones 4 s and by 2.
Transition plain() {
    Transition made = edge("toy.plain", "object", "screen", by_filter({{"zoh", 1}, {"foh", 4}}),
                           by_filter({{"zoh", 1}, {"foh", 2}}), {"zoh", "foh"});
    made.plain = Parameters{};
    return made;
}

struct Alikes {
    Catalogue edges;
    Request want;
    Scene scene;
    std::vector<Source> sources{{at("object")}};

    explicit Alikes(Catalogue all) : edges(std::move(all)) {
        want.job = Job::warp;
        want.budget.like = like_linear(Field::spline);
    }
    Ask ask() const { return {want, scene}; }
    Answer answer() const { return plan(edges, ask(), sources, unit_profile()); }
    std::string chosen() const {
        const Answer answer = this->answer();
        std::string text;
        if (answer.plan)
            for (const std::string& step : answer.plan->texts()) text += step + " ";
        return text;
    }
};

TEST(Alike, ABarredFilterIsNotTakenThoughFasterAndMoreAccurate) {
    const Alikes alikes({plain()});
    EXPECT_EQ(alikes.chosen(), "toy.plain/filter=foh ");
    const Answer answer = alikes.answer();
    EXPECT_TRUE(answer.warnings.empty());
    ASSERT_TRUE(answer.plain);
    EXPECT_EQ(answer.plain->step, "toy.plain/filter=foh");
    EXPECT_DOUBLE_EQ(answer.plain->error.value(), 2);
    EXPECT_DOUBLE_EQ(answer.plain->seconds.value(), 4);
    ASSERT_EQ(answer.front.size(), 2u);  // what else could be had, and what that does not replace
    EXPECT_EQ(answer.front[0].texts(), std::vector<std::string>{"toy.plain/filter=zoh"});
    EXPECT_EQ(answer.front[0].predicted.likeness, Likeness::barred);
    EXPECT_EQ(answer.front[1].texts(), answer.plan->texts());
}

TEST(Alike, ThePlainPathHasAPriceWhereItIsNoArcOfTheGraph) {
    const Alikes alikes({plain(), edge("toy.other", "object", "screen", fixed(3), fixed(7))});
    PlanOptions options;
    options.demands.via = {{"toy.other"}};
    const Answer answer = plan(alikes.edges, alikes.ask(), alikes.sources, unit_profile(), options);
    EXPECT_EQ(answer.edges, 1);
    ASSERT_TRUE(answer.plan && answer.plain);
    EXPECT_EQ(answer.plain->step, "toy.plain/filter=foh");
    EXPECT_DOUBLE_EQ(answer.plain->seconds.value(), 4);
    EXPECT_DOUBLE_EQ(answer.plan->predicted.seconds, 3);
}

TEST(Alike, OfLabelsTheNearestSampleIsThePlainWay) {
    Alikes alikes({plain()});
    alikes.want.budget.like = like_linear(Field::nearest);
    EXPECT_EQ(alikes.chosen(), "toy.plain/filter=zoh ");
}

TEST(Alike, TheFastestPathWithAtMostATwentiethMoreErrorIsTaken) {
    for (const double error : {2 * 1.049, 2 * 1.051}) {
        const Alikes alikes({plain(), edge("toy.other", "object", "screen", fixed(3), fixed(error)),
                             edge("toy.best", "object", "screen", fixed(5), fixed(0))});
        EXPECT_EQ(alikes.chosen(), error < 2.1 ? "toy.other " : "toy.plain/filter=foh ");
    }
}

TEST(Alike, LikelyErrorsAreCompared) {
    // The upper estimates would leave the faster edge out.
    Transition measured = edge("toy.plain", "object", "screen", fixed(4), fact("plain"), {"foh"});
    measured.plain = Parameters{};
    Alikes alikes({measured, edge("toy.other", "object", "screen", fixed(3), fact("other"))});
    alikes.scene.facts = {{"plain", 0.2}, {"other", 0.3}};
    alikes.scene.likely = {{"plain", 0.2}, {"other", 0.2}};
    EXPECT_EQ(alikes.chosen(), "toy.other ");
    EXPECT_DOUBLE_EQ(alikes.answer().plan->predicted.error, 0.3);  // what is said is the estimate
    alikes.scene.likely = {{"plain", 0.1}, {"other", 0.2}};
    EXPECT_EQ(alikes.chosen(), "toy.plain/filter=foh ");
}

TEST(Alike, APathThatABarredOneBeatsOnTheWayIsFound) {
    // To the middle the nearest sample is faster and more accurate, so no front has the other.
    Transition middle = edge("toy.middle", "object", "middle", by_filter({{"zoh", 1}, {"foh", 2}}),
                             by_filter({{"zoh", 0}, {"foh", 1}}), {"zoh", "foh"});
    const Alikes alikes(
        {plain(), middle, edge("toy.last", "middle", "screen", fixed(1), fixed(0))});
    EXPECT_EQ(alikes.chosen(), "toy.middle/filter=foh toy.last ");
}

TEST(Alike, ItIsAWish) {
    Alikes alikes({plain()});
    alikes.want.budget.seconds = 2;  // a demand stays one
    EXPECT_EQ(alikes.chosen(), "toy.plain/filter=zoh ");
    ASSERT_EQ(alikes.answer().warnings.size(), 1u);
    EXPECT_NE(alikes.answer().warnings[0].text().find("as good as linear"), std::string::npos);
    alikes.want.budget.seconds = 0.5;
    EXPECT_EQ(alikes.answer().problem, "no plan keeps to 0.5 s");
}

TEST(Alike, WithoutAPlainWayTheMostAccurateOfTheOthersIsComparedWith) {
    const Alikes alikes({edge("toy.a", "object", "screen", fixed(1), fixed(3)),
                         edge("toy.b", "object", "screen", fixed(2), fixed(1.04)),
                         edge("toy.c", "object", "screen", fixed(3), fixed(1))});
    EXPECT_EQ(alikes.chosen(), "toy.b ");
    EXPECT_FALSE(alikes.answer().plain);
}

TEST(Alike, WhatHangsOnTheSameFactNeedsNoLook) {
    Transition measured = edge("toy.plain", "object", "screen", fixed(4), fact("plain"), {"foh"});
    measured.plain = Parameters{};
    const auto unseen = [&](Number error) {
        Alikes alikes({measured, edge("toy.other", "object", "screen", fixed(3), error)});
        Request open = alikes.want;
        open.budget.like->times = std::numeric_limits<double>::infinity();
        const Answer answer =
            plan(alikes.edges, {open, alikes.scene}, alikes.sources, unit_profile());
        EXPECT_EQ(answer.plan->texts(), std::vector<std::string>{"toy.other"});
        return alike_unseen(*answer.plan, alikes.edges, alikes.ask(), alikes.sources,
                            *alikes.want.budget.like);
    };
    EXPECT_TRUE(unseen(fixed(0)));          // exact
    EXPECT_TRUE(unseen(fact("plain", 1)));  // the same whatever it is
    EXPECT_FALSE(unseen(fact("plain", 1.1)));
    EXPECT_FALSE(unseen(fixed(1e-6)));         // little, but the plain one may err by less
    EXPECT_FALSE(unseen(fact("other")));       // as good as guessed, and who knows
    EXPECT_FALSE(unseen(fact("other", 0.1)));  // nor where the guess is better
}

}  // namespace
}  // namespace edgewise
