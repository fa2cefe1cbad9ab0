#include "runtime/schedule.hpp"

#include <gtest/gtest.h>
#include <random>
#include <set>

#include "tests/runtime/toy_plan.hpp"

namespace edgewise {
namespace {

using toys::ToyJob;

std::vector<int> all_of(int frames) {
    std::vector<int> all;
    for (int i = 0; i < frames; ++i) all.push_back(i);
    return all;
}

TEST(Schedule, SetUpIsOneLaneAndEveryFrameOne) {
    ToyJob job(8, 4);
    job.load();
    const Schedule what = schedule(job.plan(), job.ask(), all_of(8));
    EXPECT_EQ(what.tasks.size(), 1u + 4 + 8);
    ASSERT_EQ(what.lanes.size(), 1u + 8);
    EXPECT_EQ(what.lanes[0].tasks.size(), 1u);
    std::set<int> frames;
    for (std::size_t at = 0; at < what.tasks.size(); ++at) {
        const Task& task = what.tasks[at];
        for (const int frame : task.frames) EXPECT_TRUE(frames.insert(frame).second);
        if (task.input < 0) continue;
        EXPECT_LT(task.input, static_cast<int>(at));
        const Task& input = what.tasks[task.input];
        EXPECT_EQ(input.step, task.step - 1);
        EXPECT_LE(input.lane, task.lane) << "a lane would wait for one that is not let in yet";
        EXPECT_TRUE(input.lane == task.lane || input.shared);
    }
    EXPECT_EQ(frames.size(), 8u);
}

TEST(Schedule, FramesThatShareFollowEachOther) {
    ToyJob job(12, 4);
    job.load();
    const Schedule what = schedule(job.plan(), job.ask(), all_of(12));
    std::vector<int> order;
    for (const Task& task : what.tasks)
        for (const int frame : task.frames) order.push_back(frame % 4);
    EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST(Schedule, OnlyTheFramesThatAreLeft) {
    ToyJob job(12, 4);
    job.load();
    const Schedule what = schedule(job.plan(), job.ask(), {1, 5, 6});
    std::set<int> frames;
    std::multiset<int> steps;
    for (const Task& task : what.tasks) {
        frames.insert(task.frames.begin(), task.frames.end());
        steps.insert(task.step);
    }
    EXPECT_EQ(frames, (std::set<int>{1, 5, 6}));
    EXPECT_EQ(steps.count(0), 1u);
    EXPECT_EQ(steps.count(1), 2u);  // variants 1 and 2
    EXPECT_EQ(steps.count(2), 3u);
    EXPECT_TRUE(schedule(job.plan(), job.ask(), {}).tasks.empty());
}

TEST(Schedule, FramesWithEqualViewsAreMadeOnce) {
    ToyJob job(6, 1);
    job.want.views = Placement();
    job.load();
    const Schedule what = schedule(job.plan(), job.ask(), all_of(6));
    EXPECT_EQ(what.tasks.size(), 3u);
    EXPECT_EQ(what.tasks.back().frames, all_of(6));
}

TEST(Regions, CoverTheExtentOnceInFewPieces) {
    std::mt19937 random(3);
    const auto below = [&](int n) { return std::uniform_int_distribution<int>(1, n)(random); };
    for (int i = 0; i < 500; ++i) {
        Partition parts;
        parts.kind = i % 2 ? Partition::output : Partition::input;
        parts.leaf = {below(40), below(40), below(40)};
        Offer offer;
        offer.from.extent = {below(50), below(50), i % 3 ? below(200) : 1};
        offer.to.extent = {below(50), below(50), i % 5 ? below(200) : 1};
        const Extent whole = i % 2 ? offer.to.extent : offer.from.extent;
        const std::vector<Region> regions = regions_of(parts, offer);
        ASSERT_LE(regions.size(), 16u);
        const int axis = whole.z > 1 ? 2 : 1;
        std::int64_t next = 0;
        for (const Region& region : regions) {
            EXPECT_FALSE(region.empty());
            EXPECT_EQ(region.begin[axis], next);  // in the order of memory, without gaps
            next = region.end[axis];
            EXPECT_TRUE(&region == &regions.back() ||
                        region.extent()[axis] % parts.leaf[axis] == 0);
            for (int other = 0; other < 3; ++other)
                EXPECT_TRUE(other == axis || region.extent()[other] == whole[other]);
        }
        EXPECT_EQ(next, whole[axis]);
    }
}

TEST(Regions, WholeAndEmptyAreOne) {
    Offer offer;
    offer.to.extent = {4, 5, 6};
    EXPECT_EQ(regions_of({}, offer), std::vector{Region::all({4, 5, 6})});
    offer.to.extent = {4, 0, 1};  // a step without regions would never end
    EXPECT_EQ(regions_of({.kind = Partition::output, .leaf = {4, 2, 1}}, offer).size(), 1u);
}

}  // namespace
}  // namespace edgewise
