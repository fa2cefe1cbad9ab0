// What a plan delivers: right, once, the same bytes for any number of threads, in the memory given.
#include <algorithm>
#include <gtest/gtest.h>

#include "runtime/schedule.hpp"
#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using toys::busy_in_parallel;
using toys::Frames;
using toys::ToyJob;
using toys::Watchdog;

/// A sum of 12 floats of up to 1e5, each product rounded once or twice: 14 ulp of the largest.
constexpr double kTolerance = 14 * 1e5 * 4 * 6e-8;

void expect_right(const ToyJob& job, int frames) {
    ASSERT_EQ(job.delivered.size(), static_cast<std::size_t>(frames));
    for (const auto& [frame, samples] : job.delivered) {
        const std::vector<double> expected = job.expected(frame);
        for (std::size_t i = 0; i < expected.size(); ++i)
            ASSERT_NEAR(samples[i], expected[i], kTolerance) << "frame " << frame;
    }
}

TEST(Flow, ResultsAreRightAndTheSameForAnyThreads) {
    const Watchdog dog(120);
    for (const int frames : {1, 2, 5, 40}) {
        ToyJob job(frames, std::min(frames, 4));
        job.load();
        const Plan plan = job.plan();
        ASSERT_EQ(plan.texts(), (std::vector<std::string>{"toy.prepare", "toy.turn", "toy.sum"}));
        Frames first;
        for (const int threads : {1, 2, 7, 1, 7}) {
            const Outcome outcome = job.run(plan, threads);
            expect_right(job, frames);
            if (first.empty()) first = job.delivered;
            EXPECT_EQ(job.delivered, first) << threads << " threads";  // exact
            EXPECT_EQ(outcome.steps, plan.texts());
            EXPECT_TRUE(outcome.warnings.empty());
        }
    }
}

TEST(Flow, PartsMergeInOneFixedTree) {
    // (((0+1)+(2+3))+((4+5)+(6+7))) + ((8+9)+(10+11)), written out here once more.
    ToyJob job(1, 1);
    job.load();
    job.run(job.plan(), 2);
    const std::size_t plane = 16 * 8;
    for (std::size_t i = 0; i < plane; ++i) {
        float z[12];
        for (int k = 0; k < 12; ++k) z[k] = 0.f + (2 * ToyJob::value(k * plane + i) + 0.f);
        const float low = ((z[0] + z[1]) + (z[2] + z[3])) + ((z[4] + z[5]) + (z[6] + z[7]));
        const float high = (z[8] + z[9]) + (z[10] + z[11]);
        EXPECT_EQ(job.delivered[0][i], low + high) << i;
    }
}

TEST(Flow, SharedResultsAreMadeOnceAndGoWhenTheyAreRead) {
    const Watchdog dog(120);
    ToyJob job(360, 4);
    job.load();
    const std::size_t before = job.memory.used();
    for (const int threads : {1, 2, 7}) {
        const Outcome outcome = job.run(job.plan(), threads);
        expect_right(job, 360);
        std::map<int, std::set<int>> views;
        std::map<int, int> nodes;
        for (const Ran& ran : outcome.trace) {
            views[ran.step].insert(ran.view);
            ++nodes[ran.step];
        }
        EXPECT_EQ(views[0].size(), 1u);
        EXPECT_EQ(views[1].size(), 4u);
        EXPECT_EQ(views[2].size(), 360u);
        EXPECT_EQ(nodes[0], 6);  // twelve slices in leaves of two
        EXPECT_EQ(nodes[1], 4 * 6);
        EXPECT_EQ(nodes[2], 360 * 12);
        EXPECT_EQ(job.memory.used(), before);
    }
    job.source.reset();
    EXPECT_EQ(job.memory.used(), 0u);
}

TEST(Flow, PlansWithoutStepsDeliverTheSource) {
    ToyJob job(5, 1);
    job.load();
    Plan nothing;
    nothing.source = job.source->what;
    std::vector<int> frames;
    const Outcome outcome = run(nothing, job.ask(), job.source,
                                [&](int frame, std::shared_ptr<const Data> result) {
                                    frames.push_back(frame);
                                    EXPECT_EQ(result, job.source);
                                },
                                {.memory = &job.memory});
    EXPECT_EQ(frames, (std::vector<int>{0, 1, 2, 3, 4}));
    EXPECT_TRUE(outcome.trace.empty());
    EXPECT_TRUE(outcome.steps.empty());
}

/// The least limit that the schedule asks for: the set-up; or what it leaves, and one lane.
std::size_t least_limit(const ToyJob& job, const Plan& plan) {
    std::vector<int> frames(job.frames);
    for (int i = 0; i < job.frames; ++i) frames[i] = i;
    const Schedule what = schedule(plan, job.ask(), frames);
    std::map<int, double> left;  // by lane: what it leaves for others
    for (const Task& task : what.tasks)
        if (task.shared) left[task.lane] += held_bytes(plan.steps[task.step].offer.to);
    double most = 0;
    for (std::size_t i = 0; i < what.lanes.size(); ++i) {
        double with = what.lanes[i].bytes + (i > 0 ? left[0] : 0);
        const int input = what.tasks[what.lanes[i].tasks[0]].input;
        if (input >= 0 && what.tasks[input].lane > 0) with += left[what.tasks[input].lane];
        most = std::max(most, with);
    }
    return job.memory.used() + static_cast<std::size_t>(most) + 1;
}

TEST(Flow, LanesWaitUnderATightLimitAndComplete) {
    const Watchdog dog(300);
    for (const int variants : {1, 3, 24})
        for (const double more : {1.0, 1.3, 2.0, 4.0})
            for (const int threads : {1, 2, 7}) {
                ToyJob job(24, variants);
                job.scratch = 20000;
                job.load();
                const Plan plan = job.plan();
                const std::size_t limit =
                    static_cast<std::size_t>(more * static_cast<double>(least_limit(job, plan)));
                MemoryBudget memory(limit);
                const Array loaded(job.source->samples.bytes(), &memory);  // as the source is
                int frames = 0;
                const Outcome outcome =
                    run(plan, job.ask(), job.source, [&](int, auto) { ++frames; },
                        {.threads = threads, .memory = &memory});
                EXPECT_EQ(frames, 24);
                EXPECT_TRUE(outcome.warnings.empty());
                EXPECT_LE(outcome.peak, limit);
                EXPECT_EQ(memory.used(), loaded.bytes() + kArraySlack);
            }
}

TEST(Flow, PlannedPeakHoldsForOneLane) {
    // What the label promises for one frame is what the run takes, but for slack around arrays.
    for (const int frames : {1, 6}) {
        ToyJob job(frames, frames);
        job.scratch = 30000;
        job.load();
        const Plan plan = job.plan();
        MemoryBudget memory(std::size_t{1} << 30);
        const Outcome outcome =
            run(plan, job.ask(), job.source, [](int, auto) {}, {.threads = 1, .memory = &memory});
        EXPECT_LE(outcome.peak, plan.label.peak + 16 * kArraySlack);
        EXPECT_GE(outcome.peak, 0.9 * plan.label.peak);
    }
}

TEST(Flow, DeliveryMayUseThreadsOfItsOwn) {
    const Watchdog dog(120);
    ToyJob job(60, 4);
    job.load();
    const Plan plan = job.plan();
    std::atomic<int> inside = 0, frames = 0;
    const Outcome outcome =
        run(plan, job.ask(), job.source,
            [&](int, std::shared_ptr<const Data>) {
                EXPECT_EQ(++inside, 1);  // never two at a time, not even on one thread
                busy_in_parallel();
                --inside;
                ++frames;
            },
            {.threads = 4, .memory = &job.memory});
    EXPECT_EQ(frames, 60);
}

TEST(Flow, ProgressGrowsToOne) {
    ToyJob job(9, 3);
    job.load();
    double last = 0;
    RunOptions options{.threads = 3, .memory = &job.memory};
    options.progress = [&](double share, const std::string& step) {
        EXPECT_GT(share, last);
        EXPECT_EQ(step.substr(0, 4), "toy.");
        last = share;
    };
    job.run(job.plan(), options);
    EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace edgewise
