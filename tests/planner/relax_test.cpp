#include "planner/relax.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "tests/planner/random_graph.hpp"

namespace edgewise {
namespace {

using toys::Planned;
using toys::random_graph;
using toys::ToyGraph;
using toys::unit_profile;

constexpr double kRange = 4;

double two_digits_up(double value) {
    if (!(value > 0)) return 0;
    const double step = std::pow(10.0, std::floor(std::log10(value)) - 1);
    return std::ceil(value / step - 1e-9) * step;
}

Budget with(Budget budget, const Relaxed& relaxed) {
    if (relaxed.error && std::isinf(*relaxed.error))
        budget.error.reset();
    else if (relaxed.error)
        budget.error = relaxed.error;
    if (relaxed.seconds) budget.seconds = relaxed.seconds;
    if (relaxed.bytes) budget.bytes = relaxed.bytes;
    return budget;
}

bool plans(Planned planned, const Budget& budget) {
    planned.want.budget = budget;
    return planned.answer().plan.has_value();
}

Budget tight_budget(std::mt19937& random) {
    const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
    Budget budget;
    if (below(4)) budget.error = below(5) / kRange;
    if (below(4)) budget.seconds = below(8);
    if (below(4)) budget.bytes = 2 + below(5);
    return budget;
}

void expect_minimal(const Planned& planned, const Budget& budget, const Relaxed& relaxed, int i) {
    const auto tighter = [&](std::optional<double> Relaxed::*which) {
        if (!(relaxed.*which) || std::isinf(*(relaxed.*which))) return;
        Relaxed less = relaxed;
        less.*which = *(relaxed.*which) * 0.99 - 1e-9;
        EXPECT_FALSE(plans(planned, with(budget, less))) << "graph " << i;
    };
    tighter(&Relaxed::error);
    tighter(&Relaxed::seconds);
    tighter(&Relaxed::bytes);
}

TEST(Relax, SuggestionsWorkAndTighterOnesDoNot) {
    std::mt19937 random(41);
    const auto exact = [](double value) { return value; };
    int alone = 0, pairs = 0, wider = 0;
    for (int i = 0; i < 800; ++i) {
        Planned planned(random_graph(random));
        planned.scene.range = kRange;
        const Budget budget = planned.want.budget = tight_budget(random);
        if (planned.answer().plan) continue;
        const Candidates paths = planned.candidates();
        const auto all = relaxed_budgets(paths, budget, {exact, exact, exact});
        EXPECT_EQ(all.empty(), paths.all().empty()) << "graph " << i;
        for (const Relaxed& relaxed : all) {
            EXPECT_TRUE(plans(planned, with(budget, relaxed))) << "graph " << i;
            expect_minimal(planned, budget, relaxed, i);
            (relaxed.changed() == 1 ? alone : relaxed.changed() == 2 ? pairs : wider) += 1;
            EXPECT_EQ(relaxed.changed(), all[0].changed());
        }
        for (const Relaxed& relaxed :
             relaxed_budgets(paths, budget, {two_digits_up, two_digits_up, two_digits_up}))
            EXPECT_TRUE(plans(planned, with(budget, relaxed))) << "graph " << i << ", rounded";
    }
    EXPECT_GT(alone, 50);
    EXPECT_GT(pairs, 10);
    EXPECT_GT(wider, 3);
}

TEST(Relax, FewerBudgetsWouldNotDo) {
    std::mt19937 random(42);
    const auto exact = [](double value) { return value; };
    for (int i = 0; i < 400; ++i) {
        Planned planned(random_graph(random));
        planned.scene.range = kRange;
        const Budget budget = planned.want.budget = tight_budget(random);
        if (planned.answer().plan) continue;
        const Candidates paths = planned.candidates();
        const auto all = relaxed_budgets(paths, budget, {exact, exact, exact});
        if (all.empty() || all[0].changed() == 1) continue;
        // A pair is the answer only where lifting any one budget altogether does not help.
        for (int one = 0; one < 3; ++one) {
            Budget lifted = budget;
            (one == 0 ? lifted.error : one == 1 ? lifted.seconds : lifted.bytes).reset();
            EXPECT_FALSE(plans(planned, lifted)) << "graph " << i;
        }
    }
}

TEST(Relax, AWishIsNoObstacle) {
    ToyGraph toy;
    toy.vertices = {{1}, {1, true}};
    toy.edges = {{0, 1, {{.operations = 2, .error = {.bias = 9}}}}};
    Planned planned(toy);
    planned.want.budget = {.seconds = 4, .like = Like{.times = 0.5}};
    const auto exact = [](double value) { return value; };
    const Candidates paths = planned.candidates();
    const auto all = relaxed_budgets(paths, planned.want.budget, {exact, exact, exact});
    ASSERT_EQ(all.size(), 1u);
    EXPECT_FALSE(all[0].error);
    EXPECT_DOUBLE_EQ(*all[0].seconds, 8);
}

TEST(Relax, SmallestSetsOfDemandsAreThoseOfBruteForce) {
    std::mt19937 random(43);
    int dropped = 0, several = 0;
    for (int i = 0; i < 300; ++i) {
        const Planned planned(random_graph(random));
        const int edges = static_cast<int>(planned.toy.edges.size());
        const auto some = [&] {
            return Demand{"toy.e" +
                          std::to_string(std::uniform_int_distribution<int>(0, edges - 1)(random))};
        };
        if (edges == 0) continue;
        PlanOptions options;
        options.demands.via = {some()};
        options.demands.without = {some(), some(), some()};
        if (planned.answer(unit_profile(), options).plan) continue;
        const auto sets = demands_to_drop(planned.catalogue, planned.ask(), planned.sources,
                                          unit_profile(), options, true);
        const auto helps = [&](unsigned set) {
            PlanOptions fewer = options;
            fewer.demands = {};
            if (!(set & 1)) fewer.demands.via = options.demands.via;
            for (unsigned k = 0; k < 3; ++k)
                if (!(set >> (k + 1) & 1))
                    fewer.demands.without.push_back(options.demands.without[k]);
            return planned.answer(unit_profile(), fewer).plan.has_value();
        };
        int least = 9, count = 0;
        for (unsigned set = 1; set < 16; ++set)
            if (const int size = __builtin_popcount(set); helps(set)) {
                if (size < least) least = size, count = 0;
                count += size == least;
            }
        ASSERT_EQ(static_cast<int>(sets.size()), least == 9 ? 0 : count) << "graph " << i;
        for (const Dropped& set : sets) {
            EXPECT_EQ(static_cast<int>(set.size()), least);
            unsigned bits = set.via.empty() ? 0 : 1;
            for (const std::size_t k : set.without) bits |= 2u << k;
            EXPECT_TRUE(helps(bits)) << "graph " << i;
            ++dropped;
            several += set.size() > 1;
        }
    }
    EXPECT_GT(dropped, 50);
    EXPECT_GT(several, 5);
}

/// A chain 0 -> 1 -> 2 -> 3 and a short cut 1 -> 3; the edges that are named refuse.
Planned refusing(std::set<std::string> names) {
    ToyGraph toy;
    toy.vertices = {{1}, {1}, {1}, {1, true}};
    toy.edges = {{0, 1, {{}}}, {1, 2, {{}}}, {2, 3, {{}}}, {1, 3, {{}}}};
    Planned planned(toy);
    for (std::size_t i = 0; i < planned.catalogue.size(); ++i)
        if (Transition& edge = planned.catalogue[i]; names.contains(edge.name))
            edge.offer = [](const Representation&, const Ask&, const Parameters&) {
                return Offer::no("not today");
            };
    return planned;
}

std::set<std::set<std::string>> missing(const Planned& planned) {
    std::set<std::set<std::string>> sets;
    for (const auto& refusals : missing_edges(planned.catalogue, planned.ask(), planned.sources)) {
        std::set<std::string> names;
        for (const Refusal& refusal : refusals) {
            names.insert(refusal.transition);
            EXPECT_EQ(refusal.reason, "not today");
        }
        sets.insert(names);
    }
    return sets;
}

TEST(Relax, SmallestSetsOfMissingEdges) {
    using Sets = std::set<std::set<std::string>>;
    EXPECT_EQ(missing(refusing({"toy.e1"})), Sets{});  // there is a path
    EXPECT_EQ(missing(refusing({"toy.e0"})), Sets{{"toy.e0"}});
    // Behind an edge that was never asked: e2 reads what e1 would make.
    EXPECT_EQ(missing(refusing({"toy.e1", "toy.e3"})), (Sets{{"toy.e1"}, {"toy.e3"}}));
    EXPECT_EQ(missing(refusing({"toy.e2", "toy.e3"})), (Sets{{"toy.e2"}, {"toy.e3"}}));
    EXPECT_EQ(missing(refusing({"toy.e0", "toy.e1", "toy.e3"})), Sets{{"toy.e0"}});
}

}  // namespace
}  // namespace edgewise
