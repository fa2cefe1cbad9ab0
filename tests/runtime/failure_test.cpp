// Every node is broken once, in every way: nothing hangs, leaks or comes twice.
#include <gtest/gtest.h>
#include <random>
#include <tuple>

#include "graph/errors.hpp"
#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using toys::Frames;
using toys::ToyJob;
using toys::Watchdog;

constexpr int kFrames = 9, kVariants = 3;
using Node = std::tuple<int, int, int>;

struct Whole {
    ToyJob job{kFrames, kVariants};
    Plan plan;
    Frames frames;
    std::vector<Node> nodes;
    std::size_t before;

    Whole() {
        job.load();
        plan = job.plan();
        before = job.memory.used();
        const Outcome outcome = job.run(plan, 1);
        frames = job.delivered;
        for (const Ran& ran : outcome.trace) nodes.emplace_back(ran.step, ran.view, ran.region);
    }

    /// Whatever was delivered is right to the last bit.
    void expect_part_of_whole() const {
        for (const auto& [frame, samples] : job.delivered)
            ASSERT_EQ(samples, frames.at(frame)) << "frame " << frame;
        ASSERT_EQ(job.memory.used(), before) << "bytes were lost";
    }
};

TEST(Failure, OfAnyNodeIsTheErrorOfTheRun) {
    const Watchdog dog(300);
    Whole whole;
    ASSERT_EQ(whole.nodes.size(), 6u + kVariants * 6 + kFrames * 12);
    for (const int threads : {1, 2, 7})
        for (const Node& broken : whole.nodes) {
            RunOptions options{.threads = threads};
            options.before_node = [&](int step, int view, int region) {
                if (Node(step, view, region) == broken) throw RunError("broken here");
            };
            try {
                whole.job.run(whole.plan, options);
                FAIL() << "went on";
            } catch (const RunError& error) {
                EXPECT_STREQ(error.what(), "broken here");
            }
            whole.expect_part_of_whole();
            EXPECT_LT(whole.job.delivered.size(), std::size_t{kFrames});
        }
}

TEST(Failure, OfAnyNodeIsMendedByAnotherPlan) {
    const Watchdog dog(300);
    Whole whole;
    for (const int threads : {1, 2, 7})
        for (const Node& broken : whole.nodes) {
            RunOptions options{.threads = threads, .replan = whole.job.replanner()};
            std::atomic<bool> armed = true;  // the same numbers occur again in the second plan
            options.before_node = [&](int step, int view, int region) {
                if (Node(step, view, region) == broken && armed.exchange(false))
                    throw RunError("broken here");
            };
            const Outcome outcome = whole.job.run(whole.plan, options);
            whole.expect_part_of_whole();
            EXPECT_EQ(whole.job.delivered.size(), std::size_t{kFrames});
            ASSERT_EQ(outcome.warnings.size(), 1u);
            const std::string failed = whole.plan.steps[std::get<0>(broken)].text();
            EXPECT_NE(outcome.warnings[0].text().find(failed + " failed (broken here)"),
                      std::string::npos)
                << outcome.warnings[0];
            EXPECT_EQ(std::count(outcome.steps.begin(), outcome.steps.end(), failed), 0);
        }
}

TEST(Failure, GoesOnFromTheFurthestWholeResult) {
    const Watchdog dog(60);
    for (const int frames : {1, 5})  // one frame: nobody else keeps what it had read
        for (const int threads : {1, 3}) {
            ToyJob job(frames, frames);
            job.load();
            RunOptions options{.threads = threads, .replan = job.replanner()};
            const auto replan = options.replan;
            std::vector<std::string> spaces;
            options.replan = [&](const std::string& failed, const std::string& why,
                                 const std::vector<Representation>& held) {
                for (const Representation& what : held) spaces.push_back(what.space);
                return replan(failed, why, held);
            };
            std::atomic<int> prepared = 0;
            for (std::size_t i = 0; i < job.catalogue.size(); ++i)
                if (Transition& edge = job.catalogue[i]; edge.name.starts_with("toy.prepare"))
                    edge.run = [&prepared, inner = edge.run](auto&&... all) {
                        ++prepared;
                        inner(all...);
                    };
            const Plan plan = job.plan();
            std::atomic<bool> armed = true;
            options.before_node = [&](int step, int, int) {
                if (step == 1 && armed.exchange(false)) throw RunError("broken");
            };
            job.run(plan, options);
            EXPECT_EQ(spaces, (std::vector<std::string>{"object", "prepared"}));
            EXPECT_EQ(prepared, 6) << "prepared again";
            EXPECT_EQ(job.delivered.size(), static_cast<std::size_t>(frames));
        }
}

TEST(Failure, WithoutAnyOtherPlanEndsInTheFirstError) {
    const Watchdog dog(60);
    Whole whole;
    RunOptions options{.threads = 2, .replan = whole.job.replanner()};
    options.before_node = [](int, int, int) { throw RunError("always broken"); };
    EXPECT_THROW(whole.job.run(whole.plan, options), RunError);
    whole.expect_part_of_whole();
    EXPECT_TRUE(whole.job.delivered.empty());
}

TEST(Failure, OfDeliveryIsMendedByNoPlan) {
    const Watchdog dog(60);
    Whole whole;
    for (const int threads : {1, 7})
        for (int bad = 0; bad < kFrames; ++bad) {
            int asked = 0;
            RunOptions options{.threads = threads, .memory = &whole.job.memory};
            options.replan = [&](auto&&...) {
                ++asked;
                return std::optional<Plan>();
            };
            EXPECT_THROW(run(
                             whole.plan, whole.job.ask(), whole.job.source,
                             [&](int frame, auto) {
                                 if (frame == bad) throw InputError("the disk is full");
                             },
                             options),
                         InputError);
            EXPECT_EQ(asked, 0);
            EXPECT_EQ(whole.job.memory.used(), whole.before);
        }
}

TEST(Failure, OfAnotherTypeIsToldToo) {
    const Watchdog dog(60);
    Whole whole;
    RunOptions options{.threads = 2};
    options.before_node = [](int, int, int) { throw 42; };
    EXPECT_THROW(whole.job.run(whole.plan, options), int);
    options.replan = whole.job.replanner();
    std::atomic<bool> armed = true;
    options.before_node = [&](int, int, int) {
        if (armed.exchange(false)) throw 42;
    };
    const Outcome outcome = whole.job.run(whole.plan, options);
    ASSERT_EQ(outcome.warnings.size(), 1u);
    EXPECT_NE(outcome.warnings[0].text().find("unknown type"), std::string::npos);
    whole.expect_part_of_whole();
}

TEST(Failure, AStepThatCallsItselfCancelledIsNotTakenForDone) {
    const Watchdog dog(60);
    Whole whole;
    RunOptions options{.threads = 2};
    options.before_node = [](int step, int, int) {
        if (step == 2) throw Cancelled();
    };
    EXPECT_THROW(whole.job.run(whole.plan, options), Cancelled);
    EXPECT_TRUE(whole.job.delivered.empty());
    whole.expect_part_of_whole();
}

TEST(Cancellation, AtAnyNodeEndsTheRun) {
    const Watchdog dog(300);
    Whole whole;
    for (const int threads : {1, 2, 7})
        for (const Node& last : whole.nodes) {
            std::atomic<bool> stop = false;
            RunOptions options{.threads = threads, .stop = &stop};
            options.replan = [](auto&&...) -> std::optional<Plan> {
                ADD_FAILURE() << "a plan is asked for after Ctrl-C";
                return {};
            };
            options.before_node = [&](int step, int view, int region) {
                if (Node(step, view, region) == last) stop = true;
            };
            EXPECT_THROW(whole.job.run(whole.plan, options), Cancelled);
            whole.expect_part_of_whole();
        }
}

TEST(Cancellation, FromAnotherThreadAtAnyTime) {
    const Watchdog dog(300);
    Whole whole;
    std::mt19937 random(5);
    for (int i = 0; i < 200; ++i) {
        std::atomic<bool> stop = false;
        RunOptions options{.threads = 1 + i % 4, .stop = &stop};
        const auto pause =
            std::chrono::microseconds(std::uniform_int_distribution<int>(0, 2000)(random));
        std::thread other([&] {
            std::this_thread::sleep_for(pause);
            stop = true;
        });
        try {
            whole.job.run(whole.plan, options);
            EXPECT_EQ(whole.job.delivered.size(), std::size_t{kFrames});
        } catch (const Cancelled&) {
        }
        other.join();
        whole.expect_part_of_whole();
    }
}

TEST(Memory, ModelThatIsTooLowBecomesAnotherPlan) {
    const Watchdog dog(60);
    for (const int threads : {1, 2, 7}) {
        ToyJob job(kFrames, kVariants);
        job.wrong_scratch = 2e9;  // toy.sum takes more than all there is
        job.load();
        const std::size_t before = job.memory.used();
        RunOptions options{.threads = threads, .replan = job.replanner()};
        const Outcome outcome = job.run(job.plan(), options);
        EXPECT_EQ(job.delivered.size(), std::size_t{kFrames});
        ASSERT_EQ(outcome.warnings.size(), 1u);
        EXPECT_NE(
            outcome.warnings[0].text().find("toy.sum failed (out of memory within the budget)"),
            std::string::npos)
            << outcome.warnings[0];
        EXPECT_EQ(outcome.steps.back(), "toy.sum_again");
        EXPECT_EQ(job.memory.used(), before);
        EXPECT_LE(outcome.peak, job.memory.limit());
        options.replan = {};
        EXPECT_THROW(job.run(job.plan(), options), std::bad_alloc);
        EXPECT_EQ(job.memory.used(), before);
    }
}

TEST(Memory, TooSmallForAnythingIsAnErrorNotAHang) {
    const Watchdog dog(60);
    Whole whole;
    for (std::size_t limit = 0; limit < 60000; limit += 1500)
        for (const int threads : {1, 3}) {
            MemoryBudget memory(limit);
            std::set<int> frames;
            try {
                run(whole.plan, whole.job.ask(), whole.job.source,
                    [&](int frame, auto) { EXPECT_TRUE(frames.insert(frame).second); },
                    {.threads = threads, .memory = &memory});
                EXPECT_EQ(frames.size(), std::size_t{kFrames});
            } catch (const std::bad_alloc&) {
            }
            EXPECT_EQ(memory.used(), 0u);
            EXPECT_LE(memory.peak(), limit);
        }
}

}  // namespace
}  // namespace edgewise
