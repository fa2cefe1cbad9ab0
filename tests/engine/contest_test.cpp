// What a few draws decide: the same path whatever is known beforehand, and one that is as good as
// asked for.
#include "engine/contest.hpp"

#include <edgewise/edgewise.hpp>
#include <gtest/gtest.h>

#include "engine/facts/memory_facts.hpp"
#include "engine/planned.hpp"
#include "engine/prepared.hpp"
#include "planner/alike.hpp"
#include "planner/profile.hpp"
#include "scene/scene.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

struct Case {
    const char* input;
    const char* mode;
    const char* rotate;
    double frames, size;
};

constexpr Case kCases[] = {{"phantom:gaussians:72", "mip", "10,20,0", 400, 160},
                           {"phantom:marschner-lobb:64", "mip", "35,5,60", 700, 128},
                           {"phantom:shepp-logan:80", "mip", "3,2,0", 300, 200},
                           {"phantom:shepp-logan:80", "xray", "70,20,0", 800, 128},
                           {"phantom:gaussians:72", "xray", "10,20,0", 500, 160},
                           {"phantom:marschner-lobb:64", "mean", "15,40,0", 500, 128},
                           {"phantom:gaussians:72", "composite", "40,10,0", 300, 160}};

Query query_of_case(const Case& of) {
    Query query = query_of(Job::render, {{"mode", std::string(of.mode)},
                                         {"rotate", std::string(of.rotate)},
                                         {"turntable", of.frames},
                                         {"size", of.size}});
    query.input = of.input;
    return query;
}

Engine engine(std::shared_ptr<FactStore> facts = nullptr) {
    return {catalogue(), default_profile(catalogue()), std::move(facts)};
}

std::vector<std::string> path_of(const Engine& by, const Query& query, ErrorsWanted errors) {
    return prepare(by, query, nullptr, {.errors = errors, .front = false}).plan().texts();
}

TEST(Contest, ChoosesTheSameWhateverIsKnownOrShown) {
    for (const Case& of : kCases) {
        const Query query = query_of_case(of);
        const auto path = path_of(engine(), query, ErrorsWanted::for_choice);
        const Engine keeps = engine(std::make_shared<MemoryFacts>());
        for (int again = 0; again < 2; ++again)
            EXPECT_EQ(path_of(keeps, query, ErrorsWanted::for_choice), path) << of.input;
        EXPECT_EQ(path_of(engine(), query, ErrorsWanted::asked), path) << of.input << of.mode;
        Query other = query;
        other.threads = 7;
        EXPECT_EQ(path_of(engine(), other, ErrorsWanted::for_choice), path) << of.input << of.mode;
    }
}

TEST(Contest, IsWonByPathsThatAreAsGoodByManyMoreDraws) {
    int winners = 0, good = 0;
    for (const Case& of : kCases) {
        const Prepared plan = prepare(engine(), query_of_case(of), nullptr,
                                      {.errors = ErrorsWanted::for_choice, .front = false});
        const Planned& planned = plan.planned();
        const Like& like = *planned.want.budget.like;
        const Scene scene =
            preview_scene(planned.engine.edges(), *planned.input.data, planned.statistics,
                          planned.want, planned.input.phantom ? &*planned.input.phantom : nullptr,
                          planned.memory.get(), 4)
                .as_likely();
        const Ask ask{planned.want, scene};
        const auto plain = plain_way(planned.engine.edges(), ask, planned.sources(), like);
        ASSERT_TRUE(plain);
        if (plan.plan().texts().back() == plain->step) continue;
        const auto error = likely_error(plan.plan(), ask, planned.sources());
        ASSERT_TRUE(error);
        ++winners;
        // Four times the draws have a standard error of a few hundredths themselves.
        good += *error * scene.range <= 1.05 * like.times * plain->likely;
        EXPECT_LE(*error * scene.range, 2 * plain->likely) << of.input << " " << of.mode;
    }
    EXPECT_GE(winners, 2);
    EXPECT_EQ(good, winners);
}

}  // namespace
}  // namespace edgewise
