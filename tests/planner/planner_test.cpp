#include "planner/planner.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

#include "planner/priced_graph.hpp"
#include "tests/planner/random_graph.hpp"

namespace edgewise {
namespace {

using toys::BruteForce;
using toys::Planned;
using toys::random_graph;
using toys::ToyCost;
using toys::ToyGraph;
using toys::unit_profile;
using toys::Walked;

constexpr int kGraphs = 400;
constexpr double kPinned = 3, kResident = 5, kRange = 4;

/// What the user sees of a path, worked out by the test.
struct Seen {
    double seconds, bytes, error;
    bool known;
};

Seen seen(const Walked& path) {
    return {path.label.seconds, kResident + std::max(path.label.peak, kPinned),
            std::hypot(path.label.bias, path.label.noise) / kRange, path.label.known};
}

bool keeps(const Seen& path, const Budget& budget) {
    return (!budget.error || (path.known && path.error <= *budget.error)) &&
           (!budget.seconds || path.seconds <= *budget.seconds) &&
           (!budget.bytes || path.bytes <= *budget.bytes);
}

double objective(const Seen& path, Minimize what) {
    if (what == Minimize::time) return path.seconds;
    if (what == Minimize::memory) return path.bytes;
    return path.known ? path.error : std::numeric_limits<double>::infinity();
}

Budget random_budget(std::mt19937& random) {
    const auto chance = [&] { return std::bernoulli_distribution(0.4)(random); };
    const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
    Budget budget;
    if (chance()) budget.error = below(8) / kRange;
    if (chance()) budget.seconds = below(25);
    if (chance()) budget.bytes = kResident + kPinned + 4 + below(20);
    return budget;
}

PlanOptions options() {
    PlanOptions with;
    with.pinned = kPinned;
    with.resident = kResident;
    return with;
}

TEST(Planner, ChoiceIsTheBestOfBruteForce) {
    std::mt19937 random(11);
    int chosen = 0, impossible = 0, shortest = 0;
    for (int i = 0; i < kGraphs; ++i) {
        Planned planned(random_graph(random));
        planned.scene.range = kRange;
        const BruteForce brute(planned.toy, kPinned);
        for (const Minimize what : {Minimize::time, Minimize::error, Minimize::memory}) {
            planned.want.minimize = what;
            planned.want.budget = random_budget(random);
            const Answer answer = planned.answer(unit_profile(), options());
            // The plan is the same where nobody asks for the front.
            PlanOptions alone = options();
            alone.front = false;
            const Answer decided = planned.answer(unit_profile(), alone);
            ASSERT_EQ(answer.plan.has_value(), decided.plan.has_value()) << "graph " << i;
            if (answer.plan) {
                EXPECT_EQ(answer.plan->texts(), decided.plan->texts());
            }
            std::optional<double> best;
            for (const Walked& path : brute.paths())
                if (const Seen s = seen(path); keeps(s, planned.want.budget))
                    best = std::min(best.value_or(objective(s, what)), objective(s, what));
            ASSERT_EQ(answer.plan.has_value(), best.has_value()) << "graph " << i;
            if (!best) {
                ++impossible;
                EXPECT_FALSE(answer.problem.empty());
                EXPECT_EQ(answer.nearest.empty(), brute.paths().empty());
                continue;
            }
            ++chosen;
            EXPECT_EQ(answer.search, decided.search);
            if (answer.search == Search::shortest_path) ++shortest;
            const Predicted& p = answer.plan->predicted;
            // Where the one path of least seconds keeps all budgets, it is the answer as the
            // shortest path. Where several tie, each may be.
            const auto fastest = std::min_element(
                brute.paths().begin(), brute.paths().end(),
                [](const Walked& a, const Walked& b) { return a.label.seconds < b.label.seconds; });
            const auto ties = std::count_if(
                brute.paths().begin(), brute.paths().end(),
                [&](const Walked& path) { return path.label.seconds == fastest->label.seconds; });
            if (answer.search == Search::shortest_path) {
                EXPECT_EQ(p.seconds, fastest->label.seconds) << "graph " << i;
            } else if (what == Minimize::time && ties == 1) {
                EXPECT_FALSE(keeps(seen(*fastest), planned.want.budget)) << "graph " << i;
            }
            const Seen ours{p.seconds, p.bytes, p.error, p.known};
            EXPECT_TRUE(keeps(ours, planned.want.budget)) << "graph " << i;
            if (std::isfinite(*best)) {
                EXPECT_NEAR(objective(ours, what), *best, 1e-12) << "graph " << i;
            } else {
                EXPECT_FALSE(ours.known) << "graph " << i;
            }
            const auto same =
                std::find_if(brute.paths().begin(), brute.paths().end(), [&](const Walked& path) {
                    return path.texts == answer.plan->texts() && seen(path).bytes == p.bytes &&
                           std::abs(seen(path).error - p.error) < 1e-12 &&
                           seen(path).seconds == p.seconds && seen(path).known == p.known;
                });
            EXPECT_NE(same, brute.paths().end()) << "graph " << i << ": its label is not its own";
        }
    }
    EXPECT_GT(chosen, kGraphs);
    EXPECT_GT(impossible, kGraphs / 10);
    EXPECT_GT(shortest, kGraphs / 10);
    EXPECT_LT(shortest, chosen);
}

TEST(Planner, NoPathBeatsTheChosenOneInEverything) {
    std::mt19937 random(12);
    for (int i = 0; i < kGraphs; ++i) {
        Planned planned(random_graph(random, 0));
        const BruteForce brute(planned.toy, 0);
        const Answer answer = planned.answer();
        if (!answer.plan) continue;
        const Label& ours = answer.plan->label;
        for (const Walked& path : brute.paths()) {
            const Label& l = path.label;
            const bool no_worse = l.seconds <= ours.seconds && l.peak <= ours.peak &&
                                  l.bias <= ours.bias && l.noise <= ours.noise &&
                                  l.held <= ours.held;
            EXPECT_FALSE(no_worse && (l.seconds < ours.seconds || l.peak < ours.peak ||
                                      l.bias < ours.bias || l.noise < ours.noise))
                << "graph " << i;
        }
    }
}

TEST(Planner, ReportedFrontHoldsOnlyPlansThatNoneBeats) {
    std::mt19937 random(13);
    for (int i = 0; i < kGraphs; ++i) {
        const Planned planned(random_graph(random));
        const Answer answer = planned.answer();
        EXPECT_EQ(answer.front.empty(), !answer.plan.has_value());
        for (const Plan& a : answer.front)
            for (const Plan& b : answer.front) {
                const Predicted &p = a.predicted, &q = b.predicted;
                const bool beats = p.known == q.known && p.seconds <= q.seconds &&
                                   p.bytes <= q.bytes && p.error <= q.error;
                EXPECT_TRUE(&a == &b || !beats) << "graph " << i;
            }
        EXPECT_TRUE(std::is_sorted(answer.front.begin(), answer.front.end(),
                                   [](const Plan& a, const Plan& b) {
                                       return a.predicted.seconds < b.predicted.seconds;
                                   }));
    }
}

/// Serial edges are slower on many threads only relative to others: the order of two paths turns.
TEST(Planner, ChoiceDoesNotDependOnThreads) {
    std::mt19937 random(14);
    for (int i = 0; i < kGraphs; ++i) {
        Planned planned(random_graph(random));
        planned.want.budget.error = 3;
        Profile profile = unit_profile(4, 0.3);
        profile.start = 0.7;
        std::optional<std::vector<std::string>> first;
        double seconds = 0;
        for (const int threads : {1, 2, 4, 7, 64}) {
            planned.want.threads = threads;
            const Answer answer = planned.answer(profile);
            if (!answer.plan) break;
            if (!first) {
                first = answer.plan->texts();
            } else {
                EXPECT_EQ(answer.plan->texts(), *first) << "graph " << i;
                EXPECT_LE(answer.plan->predicted.seconds, seconds) << "predicted for the threads";
            }
            seconds = answer.plan->predicted.seconds;
        }
    }
}

/// Two ways: slow and serial in scratch, fast with much scratch a thread.
ToyGraph two_ways() {
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{1}, {1, true}};
    toy.edges = {{0, 1, {{.operations = 8, .scratch = 1, .error = {.bias = 1}}}},
                 {0, 1, {{.operations = 4, .scratch = 10, .error = {.bias = 2}}}}};
    return toy;
}

TEST(Planner, ThreadsTakeTheNextPlanOnlyWhereTheyBreakMemory) {
    Planned planned(two_ways());
    planned.want.budget.bytes = 50;
    for (const int threads : {1, 4, 5, 16}) {
        planned.want.threads = threads;
        const Answer answer = planned.answer(unit_profile(4));
        ASSERT_TRUE(answer.plan);
        // One byte of output and ten of scratch a thread: four threads fit, five do not.
        EXPECT_EQ(answer.plan->steps[0].by->name, threads <= 4 ? "toy.e1" : "toy.e0") << threads;
    }
}

TEST(Planner, ProfileOfManyProcessorsDoesNotPreventAPlanForOneThread) {
    Planned planned(two_ways());
    planned.want.budget.bytes = 11;  // the profile's four processors would need 41
    planned.want.minimize = Minimize::time;
    planned.want.threads = 1;
    const Answer answer = planned.answer(unit_profile(4));
    ASSERT_TRUE(answer.plan);
    EXPECT_LE(answer.plan->predicted.bytes, 11);
}

TEST(Planner, UnknownErrorsMeetNoErrorBudget) {
    ToyGraph toy = two_ways();
    toy.edges[1].choices[0].error = Error::unknown();
    Planned planned(toy);
    EXPECT_EQ(planned.answer().plan->steps[0].by->name, "toy.e1");  // no budget: the faster
    planned.want.budget.error = 1e9;
    EXPECT_EQ(planned.answer().plan->steps[0].by->name, "toy.e0");
    toy.edges[0].choices[0].error = Error::unknown();
    Planned unknown(toy);
    unknown.want.budget.error = 1e9;
    const Answer answer = unknown.answer();
    EXPECT_FALSE(answer.plan);
    EXPECT_EQ(answer.problem, "no plan keeps to an error of 1e+09");
    EXPECT_FALSE(answer.nearest.empty());
}

TEST(Planner, WhereSamplesMustStayOnlyCopiesWill) {
    ToyGraph toy = two_ways();
    toy.edges[0].choices[0].error = {.copies = true};
    Planned planned(toy);
    EXPECT_EQ(planned.answer().plan->steps[0].by->name, "toy.e1");  // the faster
    planned.want.budget.copied = true;
    EXPECT_EQ(planned.answer().plan->steps[0].by->name, "toy.e0");
    toy.edges[0].choices[0].error = {};  // exact, and yet no copy
    Planned computed(toy);
    computed.want.budget.copied = true;
    EXPECT_EQ(computed.answer().problem, "no plan keeps to all samples as they are stored");
}

TEST(Planner, NearestPlansLieOnEitherSideOfTheBudget) {
    Planned planned(two_ways());
    planned.want.budget.seconds = 5;  // the fast way
    planned.want.budget.error = 1.5;  // the accurate way
    const Answer answer = planned.answer();
    ASSERT_FALSE(answer.plan);
    EXPECT_EQ(answer.problem, "no plan keeps to an error of 1.5 and 5 s");
    std::set<std::string> names;
    for (const Plan& plan : answer.nearest) names.insert(plan.steps[0].by->name);
    EXPECT_EQ(names, (std::set<std::string>{"toy.e0", "toy.e1"}));
}

TEST(Planner, NoPathIsSaid) {
    ToyGraph toy = two_ways();
    toy.edges.clear();
    const Answer answer = Planned(toy).answer();
    EXPECT_FALSE(answer.plan);
    EXPECT_TRUE(answer.front.empty());
    EXPECT_EQ(answer.problem, "no path of edges leads from the input to what is asked for");
}

TEST(Planner, RandomCostsFollowTheSeedAndReachManyPaths) {
    ToyGraph toy;
    toy.vertices = {{1}, {1}, {1}, {1, true}};
    for (int v = 0; v < 3; ++v)
        for (int w = v + 1; w < 4; ++w) toy.edges.push_back({v, w, {{}, {}, {}}});
    const Planned planned(toy);
    std::set<std::vector<std::string>> taken;
    PlanOptions with;
    for (int seed = 0; seed < 300; ++seed) {
        with.random_costs = seed;
        const Answer a = planned.answer(unit_profile(), with);
        const Answer b = planned.answer(unit_profile(), with);
        ASSERT_TRUE(a.plan && b.plan);
        EXPECT_EQ(a.plan->texts(), b.plan->texts());
        for (const Step& step : a.plan->steps) EXPECT_TRUE(step.seconds > 0 && step.seconds <= 1);
        taken.insert(a.plan->texts());
    }
    EXPECT_EQ(BruteForce(toy, 0).paths().size(), 48u);  // 3 + 2 * 3^2 + 3^3
    // Shorter paths win more often: nearly all of the 21 with one or two edges are taken.
    EXPECT_GT(taken.size(), 18u);
}

TEST(Planner, ReplanningIsTheSameCallFromWhatIsHeld) {
    ToyGraph toy;
    toy.vertices = {{4}, {7}, {2, true}};
    toy.edges = {{0, 1, {{.operations = 9, .error = {.bias = 1}}}},
                 {1, 2, {{.operations = 1, .error = {.gain = 2}}}},
                 {0, 2, {{.operations = 4, .error = {.bias = 9}}}}};
    toy.sources.push_back({1, {.bias = 1}});  // vertex 1 is whole already, with its error
    Planned planned(toy);
    planned.want.minimize = Minimize::error;
    const Answer answer = planned.answer();
    ASSERT_TRUE(answer.plan);
    ASSERT_EQ(answer.plan->steps.size(), 1u);
    EXPECT_EQ(answer.plan->source.key(), planned.toy.representation(1, planned.want).key());
    EXPECT_EQ(answer.plan->predicted.seconds, 4);  // four frames at one second, no cost before
    EXPECT_EQ(answer.plan->label.bias, 2);         // gain 2 on what it starts with
    EXPECT_EQ(answer.plan->predicted.bytes, 2);    // the source's own bytes are pinned elsewhere
    PlanOptions forbidden;
    forbidden.demands.without = {{"toy.e1"}};
    EXPECT_EQ(planned.answer(unit_profile(), forbidden).plan->steps[0].by->name, "toy.e2");
}

TEST(Planner, SourceThatIsTheTargetNeedsNoSteps) {
    ToyGraph toy = two_ways();
    toy.sources = {{1, {}}};
    const Answer answer = Planned(toy).answer(unit_profile(), options());
    ASSERT_TRUE(answer.plan);
    EXPECT_TRUE(answer.plan->steps.empty());
    EXPECT_EQ(answer.plan->predicted.bytes, kResident + kPinned);
    EXPECT_EQ(answer.plan->predicted.seconds, 0);
}

TEST(Planner, QuestionsToEdgesAreFewAlsoForAThousandViews) {
    // Counted, not timed: at most eight views an arc for the processors and eight for the threads.
    ToyGraph toy = two_ways();
    toy.frames = 1000;
    Planned planned(toy);
    int works = 0, offers = 0;
    for (std::size_t i = 0; i < planned.catalogue.size(); ++i) {
        Transition& edge = planned.catalogue[i];
        edge.work = [&works, inner = edge.work](const Offer& o, const Ask& a, int view) {
            ++works;
            return inner(o, a, view);
        };
        edge.offer = [&offers, inner = edge.offer](const Representation& r, const Ask& a,
                                                   const Parameters& p) {
            ++offers;
            return inner(r, a, p);
        };
    }
    planned.want.threads = 3;
    const Answer answer = planned.answer();
    EXPECT_EQ(answer.edges, 2);
    EXPECT_EQ(answer.vertices, 2);
    EXPECT_EQ(offers, 2);
    EXPECT_EQ(works, 2 * 2 * 8);
}

TEST(Planner, AnEdgeThatIsPricedByNoNumberIsNamed) {
    for (const double wrong : {std::nan(""), -1.0, HUGE_VAL}) {
        ToyGraph toy = two_ways();
        toy.edges[1].choices[0].operations = wrong;
        try {
            Planned(toy).answer();
            FAIL() << "accepted " << wrong;
        } catch (const RequestError& error) {
            EXPECT_NE(std::string(error.what()).find("toy.e1"), std::string::npos) << error.what();
        }
        toy = two_ways();
        toy.edges[0].choices[0].error.gain = wrong;
        EXPECT_THROW(Planned(toy).answer(), RequestError);
    }
}

TEST(Planner, AllPathsAreThoseOfTheGraph) {
    std::mt19937 random(16);
    for (int i = 0; i < 50; ++i) {
        const Planned planned(random_graph(random));
        const BruteForce brute(planned.toy, kPinned);
        const PricedGraph graph(planned.catalogue, planned.ask(), planned.sources, unit_profile(),
                                options());
        const auto paths = [&](std::size_t limit) {
            return all_paths(graph.real(), planned.catalogue, planned.ask(), options(), limit);
        };
        const std::vector<Plan> all = paths(1000000);
        ASSERT_EQ(all.size(), brute.paths().size());
        std::multiset<std::pair<std::vector<std::string>, double>> ours, theirs;
        for (const Plan& plan : all) ours.insert({plan.texts(), plan.predicted.bytes});
        for (const Walked& path : brute.paths()) theirs.insert({path.texts, seen(path).bytes});
        EXPECT_EQ(ours, theirs);
        EXPECT_EQ(paths(2).size(), std::min<std::size_t>(2, all.size()));
    }
}

TEST(Planner, ExpectedBytesCountFramesSideBySideAndNoReserves) {
    ToyGraph toy;
    toy.vertices = {{1, false}, {5, true}};
    toy.edges = {{0, 1, {{.operations = 1, .scratch = 2, .workspace = 3}}}};
    toy.frames = 4;
    Planned planned(toy);
    planned.want.threads = 3;
    PlanOptions with;
    with.pinned = 1;
    with.resident = 100;
    const auto predicted = [&] { return planned.answer(unit_profile(), with).plan->predicted; };
    // One frame: pinned, its result, its workspace, a scratch for each thread.
    EXPECT_EQ(predicted().bytes, 100 + 1 + 5 + 3 + 3 * 2);
    EXPECT_EQ(predicted().expected_bytes(), predicted().bytes) << "not known how much is held";
    with.held = 40;
    // Three frames side by side share the scratches.
    EXPECT_EQ(predicted().bytes, 115);
    EXPECT_EQ(predicted().expected_bytes(), 40 + 1 + 3 * (5 + 3) + 3 * 2);
    planned.want.budget.bytes = 120;  // no room for three
    EXPECT_EQ(predicted().expected_bytes(), 120 - 60);
    with.after = 15;  // more than a frame takes, less than three
    EXPECT_EQ(predicted().bytes, 100 + 1 + 15);
    planned.want.budget.bytes.reset();
    EXPECT_EQ(predicted().expected_bytes(), 40 + 31);
    with.after = 50;
    EXPECT_EQ(predicted().bytes, 151);
    EXPECT_EQ(predicted().expected_bytes(), 40 + 51);
}

}  // namespace
}  // namespace edgewise
