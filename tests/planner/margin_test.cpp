#include "planner/margin.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

#include "tests/planner/random_graph.hpp"

namespace edgewise {
namespace {

using toys::BruteForce;
using toys::Planned;
using toys::random_graph;
using toys::ToyGraph;
using toys::unit_profile;
using toys::Walked;

constexpr double kRange = 4;
using Texts = std::vector<std::string>;

/// The graph with the operations of one step multiplied: "toy.e3" or "toy.e3/p=1".
ToyGraph scaled(ToyGraph toy, const std::string& step, double factor) {
    for (std::size_t e = 0; e < toy.edges.size(); ++e)
        for (std::size_t p = 0; p < toy.edges[e].choices.size(); ++p) {
            std::string text = "toy.e" + std::to_string(e);
            if (toy.edges[e].choices.size() > 1) text += "/p=" + std::to_string(p);
            if (text == step) toy.edges[e].choices[p].operations *= factor;
        }
    return toy;
}

/// What is left of a plan once the edges that it was made of are gone.
struct Replanned {
    Texts texts;
    double seconds = 0;
};

/// A random graph under a random request.
struct Case {
    Planned planned;

    explicit Case(std::mt19937& random) : planned(random_graph(random)) {
        planned.scene.range = kRange;
        const auto below = [&](int n) {
            return std::uniform_int_distribution<int>(0, n - 1)(random);
        };
        Budget& budget = planned.want.budget;
        if (below(3) == 0) budget.error = (2 + below(8)) / kRange;
        if (below(3) == 0) budget.bytes = 8 + below(12);
        if (below(3) == 0) budget.seconds = 4 + below(20);
        planned.want.minimize = static_cast<Minimize>(below(6) < 4 ? 0 : below(2) + 1);
    }

    std::optional<Replanned> again(const std::string& step, double factor) const {
        Planned other(scaled(planned.toy, step, factor));
        other.scene = planned.scene;
        other.want = planned.want;
        const Answer answer = other.answer();
        if (!answer.plan) return std::nullopt;
        return Replanned{answer.plan->texts(), answer.plan->predicted.seconds};
    }

    Margin margin(const Plan& plan, std::size_t rivals = 4) const {
        const Candidates paths = planned.candidates();
        return margin_of(paths, plan, rivals);
    }
};

/// The same plan, or one that is as good: ties are broken by resources that nobody asked for.
bool stays(const std::optional<Replanned>& then, const Plan& plan, double step_seconds,
           double factor, Minimize aim) {
    if (!then) return false;
    if (then->texts == plan.texts()) return true;
    const double seconds = plan.predicted.seconds + (factor - 1) * step_seconds;
    if (aim == Minimize::time) return then->seconds >= seconds - 1e-9;
    return false;
}

double seconds_in(const Plan& plan, const std::string& step) {
    double sum = 0;
    for (const Step& each : plan.steps)
        if (each.text() == step) sum += each.seconds;
    return sum;
}

TEST(Margin, IsWherePlanningAgainWithScaledCostsTurns) {
    std::mt19937 random(31);
    int turned = 0, never = 0;
    for (int i = 0; i < 600; ++i) {
        const Case test(random);
        const Answer answer = test.planned.answer();
        if (!answer.plan) continue;
        const Minimize aim = test.planned.want.minimize;
        const Margin margin = test.margin(*answer.plan);
        for (const StepMargin& step : margin.steps) {
            const double own = seconds_in(*answer.plan, step.step);
            if (!step.factor) {
                EXPECT_TRUE(stays(test.again(step.step, 1000), *answer.plan, own, 1000, aim))
                    << "graph " << i << " " << step.step;
                ++never;
                continue;
            }
            ++turned;
            const double below = 1 + 0.999 * (*step.factor - 1), above = *step.factor * 1.001;
            EXPECT_TRUE(stays(test.again(step.step, below), *answer.plan, own, below, aim))
                << "graph " << i << " " << step.step << " " << *step.factor;
            const auto then = test.again(step.step, above);
            EXPECT_EQ(then.has_value(), !step.instead.empty()) << "graph " << i;
            if (!then) continue;
            EXPECT_NE(then->texts, answer.plan->texts()) << "graph " << i << step.step;
            // Of rivals that tie any may be named: it is as good as the one that was planned.
            const auto named = [&](const Texts& texts) {
                const BruteForce brute(scaled(test.planned.toy, step.step, above), 0);
                for (const Walked& path : brute.paths())
                    if (path.texts == texts) return path.label;
                return Label{.seconds = 1e9};
            };
            if (aim == Minimize::time) {
                EXPECT_NEAR(named(step.instead).seconds, then->seconds, 0.002 * then->seconds)
                    << "graph " << i << " " << step.step;
            }
        }
    }
    EXPECT_GT(turned, 200);
    EXPECT_GT(never, 50);
}

TEST(Rivals, AreThreeWhereThereAreAsManyAndSayWhatTheyLose) {
    std::mt19937 random(32);
    int many = 0;
    for (int i = 0; i < 400; ++i) {
        const Case test(random);
        const Answer answer = test.planned.answer();
        if (!answer.plan) continue;
        const BruteForce brute(test.planned.toy, 0);
        const Margin margin = test.margin(*answer.plan, 3);
        ASSERT_EQ(margin.rivals.size(), std::min<std::size_t>(3, brute.paths().size() - 1))
            << "graph " << i;
        many += margin.rivals.size() == 3;
        const Predicted& plan = answer.plan->predicted;
        const Budget& budget = test.planned.want.budget;
        for (const Rival& rival : margin.rivals) {
            const bool exists =
                std::any_of(brute.paths().begin(), brute.paths().end(), [&](const Walked& path) {
                    const double error = std::hypot(path.label.bias, path.label.noise) / kRange;
                    return path.texts == rival.steps &&
                           std::abs(path.label.seconds - plan.seconds - rival.seconds) < 1e-9 &&
                           std::abs(path.label.peak - plan.bytes - rival.bytes) < 1e-9 &&
                           path.label.known == rival.predicted.known &&
                           std::abs(error - rival.predicted.error) < 1e-9;
                });
            EXPECT_TRUE(exists) << "graph " << i;
            const Predicted& its = rival.predicted;
            std::vector<std::string> broken;
            if (budget.error && !(its.known && its.error <= *budget.error))
                broken.push_back("error");
            if (budget.seconds && its.seconds > *budget.seconds) broken.push_back("time");
            if (budget.bytes && its.bytes > *budget.bytes) broken.push_back("memory");
            EXPECT_EQ(rival.breaks, broken) << "graph " << i;
        }
    }
    EXPECT_GT(many, 100);
}

TEST(Rivals, WinOnceTheirStepIsSoMuchFaster) {
    std::mt19937 random(33);
    int won = 0, hopeless = 0;
    for (int i = 0; i < 600; ++i) {
        Case test(random);
        test.planned.want.minimize = Minimize::time;
        const Answer answer = test.planned.answer();
        if (!answer.plan) continue;
        const Margin margin = test.margin(*answer.plan);
        for (const Rival& rival : margin.rivals) {
            if (!rival.differs) continue;
            const auto seconds = [&](double factor, const Texts& steps) {
                const BruteForce brute(scaled(test.planned.toy, *rival.differs, factor), 0);
                double least = 1e9;
                for (const Walked& path : brute.paths())
                    if (path.texts == steps) least = std::min(least, path.label.seconds);
                return least;
            };
            const auto gap = [&](double factor) {
                return seconds(factor, rival.steps) - seconds(factor, answer.plan->texts());
            };
            if (!rival.faster) {
                // No factor helps: it breaks another budget, or still loses where the step is free.
                const bool breaks = std::any_of(rival.breaks.begin(), rival.breaks.end(),
                                                [](const auto& what) { return what != "time"; });
                EXPECT_TRUE(breaks || gap(0) > -1e-9) << "graph " << i;
                ++hopeless;
                continue;
            }
            EXPECT_LT(gap(0.999 / *rival.faster), 1e-9) << "graph " << i;
            if (rival.breaks.empty() && *rival.faster > 1.01) {
                EXPECT_GT(gap(1.001 / *rival.faster), -1e-9) << "graph " << i;
            }
            ++won;
        }
    }
    EXPECT_GT(won, 100);
    EXPECT_GT(hopeless, 100);
}

/// Two ways of one edge each, with nothing measured: predictions spread by 35 %.
Planned two_ways(double fast, double slow) {
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{1}, {1, true}};
    toy.edges = {{0, 1, {{.operations = fast}}}, {0, 1, {{.operations = slow}}}};
    return Planned(toy);
}

TEST(Margin, InsideTheSpreadOfThePredictionsIsATossUp) {
    for (const double slow : {1.1, 1.6, 3.0}) {
        const Planned planned = two_ways(1, slow);
        const Candidates paths = planned.candidates();
        const Margin margin = margin_of(paths, *planned.answer().plan);
        ASSERT_EQ(margin.steps.size(), 1u);
        EXPECT_DOUBLE_EQ(*margin.steps[0].factor, slow);
        EXPECT_EQ(margin.steps[0].instead, (Texts{"toy.e1"}));
        EXPECT_EQ(margin.steps[0].inside, slow < std::exp(0.35));
        ASSERT_EQ(margin.rivals.size(), 1u);
        // Independent logs of deviation 0.35 each: theirs differ by about 0.5.
        EXPECT_EQ(margin.toss_up, slow < 1.64) << slow;
        EXPECT_GT(margin.rivals[0].chance, 0);
        EXPECT_LT(margin.rivals[0].chance, 0.5);
    }
}

TEST(Margin, MeasuredPathsGoBeforePredictedOnes) {
    const Planned planned = two_ways(1, 3);
    const Candidates::Known known{{{"toy.e0"}, {4, 0.01, 2, 0, true}},
                                  {{"toy.e1"}, {2, 0.01, 2, 0, true}}};
    const Candidates paths = planned.candidates(unit_profile(), known);
    Plan plan = *planned.answer().plan;
    plan.steps[0].by = planned.catalogue.shared(1);  // what a pilot would have chosen
    const Margin margin = margin_of(paths, plan);
    ASSERT_EQ(margin.steps.size(), 1u);
    EXPECT_DOUBLE_EQ(*margin.steps[0].factor, 2);
    EXPECT_FALSE(margin.toss_up);
}

}  // namespace
}  // namespace edgewise
