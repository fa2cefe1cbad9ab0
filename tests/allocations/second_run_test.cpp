// A run that is like one before it allocates nothing: counted at operator new.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <new>

#include "engine/prepared.hpp"
#include "planner/profile.hpp"
#include "tests/allocations/paths.hpp"
#include "transitions/catalogue.hpp"

namespace {

std::atomic<long> allocations{0};
std::atomic<long> left{-1};  // allocations before the one that is refused; less than 0: none

void* counted(std::size_t bytes, std::size_t alignment) noexcept {
    allocations.fetch_add(1, std::memory_order_relaxed);
    if (left.load(std::memory_order_relaxed) >= 0 && left.fetch_sub(1) == 0) return nullptr;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}

void* counted_or_thrown(std::size_t bytes, std::size_t alignment) {
    if (void* block = counted(bytes, alignment)) return block;
    throw std::bad_alloc();
}

constexpr std::size_t kLeast = alignof(std::max_align_t);

}  // namespace

// All of them allocate alike, so that each may free what any other made.
[[gnu::noinline]] void* operator new(std::size_t bytes) { return counted_or_thrown(bytes, kLeast); }
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    return counted(bytes, kLeast);
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return counted_or_thrown(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment,
                                     const std::nothrow_t&) noexcept {
    return counted(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t, std::align_val_t) noexcept {
    std::free(block);
}

namespace edgewise {
namespace {

using Bytes = std::vector<std::byte>;

const Engine& engine() {
    static const Engine engine(catalogue(), default_profile(catalogue()));
    return engine;
}

Query seen(Mode mode, int frames = 1, const char* via = nullptr) {
    Query query;
    query.mode = mode;
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10, 0}}};
    if (frames > 1)
        query.geometry.steps.push_back({GeometryStep::Kind::turntable, {double(frames)}});
    query.geometry.size = OutputSize{.sides = {64, 48}};
    if (via) query.demands.via = {{.name = via}};
    return query;
}

/// Under AddressSanitizer nothing is kept for another run, so that it sees what is lost.
#if defined(__SANITIZE_ADDRESS__)
#define SKIP_WHERE_NOTHING_IS_KEPT() GTEST_SKIP()
#else
#define SKIP_WHERE_NOTHING_IS_KEPT()
#endif

class SecondRun {
 public:
    explicit SecondRun(const CountedPath& of)
        : plan_(prepare(engine(), of.query, of.samples)),
          result_(static_cast<std::size_t>(plan_.result().bytes()) *
                  static_cast<std::size_t>(plan_.frames())) {}

    /// How often operator new is called.
    long run(int threads) {
        RunWith with;
        with.threads = threads;
        with.into = result_;
        std::fill(result_.begin(), result_.end(), std::byte{0xa5});
        const long before = allocations;
        plan_.run(with);
        return allocations - before;
    }
    const Bytes& result() const { return result_; }
    const Prepared& plan() const { return plan_; }

 private:
    Prepared plan_;
    Bytes result_;
};

TEST(SecondRun, AllocatesNothingOnOneThread) {
    SKIP_WHERE_NOTHING_IS_KEPT();
    for (const CountedPath& of : counted_paths()) {
        SecondRun second(of);
        EXPECT_GT(second.run(1), 0) << of.name << ": nothing is counted";
        const Bytes first = second.result();
        EXPECT_EQ(second.run(1), 0) << of.name;
        EXPECT_EQ(second.result(), first) << of.name;
    }
}

/// Threads meet in ever new orders, and now and then more is at work at once than ever before. Most
/// of the time it is not.
TEST(SecondRun, AllocatesNothingOnTwoThreads) {
    SKIP_WHERE_NOTHING_IS_KEPT();
    for (const CountedPath& of : counted_paths()) {
        SecondRun second(of);
        second.run(1);
        const Bytes first = second.result();
        std::vector<long> counts;
        for (int i = 0; i < 15; ++i) {
            counts.push_back(second.run(2));
            ASSERT_EQ(second.result(), first) << of.name;
        }
        std::sort(counts.begin(), counts.end());
        EXPECT_EQ(counts[counts.size() / 2], 0) << of.name;
    }
}

TEST(SecondRun, AllocatesNothingForWhoLooksOn) {
    SKIP_WHERE_NOTHING_IS_KEPT();
    const Prepared plan = prepare(engine(), seen(Mode::mip, 4, "project.ray_cast"),
                                  counted_noise({30, 30, 30}, Type::f32));
    int frames = 0, steps = 0;
    std::atomic<bool> stop = false;
    RunWith with;
    with.threads = 1;
    with.stop = &stop;
    with.on_frame = [&](const Frame&) { ++frames; };
    with.on_progress = [&, some = std::array<double, 8>{}](double, const std::string&) {
        steps += some[0] == 0;  // too large for a function to hold without memory of its own
    };
    plan.run(with);
    const long before = allocations;
    plan.run(with);
    EXPECT_EQ(allocations - before, 0);
    EXPECT_EQ(frames, 8);
    EXPECT_GE(steps, 8);
}

/// Frames that are kept are new, and nothing else is. Of each: its samples, the objects around
/// them, what keeps the memory for them, and that they were given away.
TEST(SecondRun, AllocatesWhatIsKept) {
    SKIP_WHERE_NOTHING_IS_KEPT();
    const Prepared plan = prepare(engine(), seen(Mode::mip, 4, "project.ray_cast"),
                                  counted_noise({30, 30, 30}, Type::f32));
    RunWith with;
    with.threads = 1;
    with.keep_frames = true;
    const auto first = plan.run(with);
    const long before = allocations;
    const auto second = plan.run(with);
    EXPECT_LE(allocations - before, 1 + 5 * 4);
    ASSERT_EQ(second.frames.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_EQ(0, std::memcmp(first.frames[i]->samples.data(), second.frames[i]->samples.data(),
                                 first.frames[i]->samples.bytes()));
}

/// Each allocation of a first run fails in turn, those of the sample memory and all others: an
/// error or the right result, and the plan runs afterwards.
TEST(FirstRun, SurvivesEachAllocationThatFails) {
    const auto samples = counted_noise({20, 18, 16}, Type::f32);
    Query query = seen(Mode::mip, 2, "filter.prefilter");
    query.geometry.size = OutputSize{.sides = {16, 12}};
    const Prepared there = prepare(engine(), query, samples);
    Bytes right(static_cast<std::size_t>(there.result().bytes()) * 2), result(right.size());
    RunWith with;
    for (const int threads : {1, 2}) {
        with.threads = threads;
        with.into = right;
        there.run(with);
        with.into = result;
        int failed = 0;
        bool enough = false;
        for (int at = 0; !enough; ++at) {
            ASSERT_LT(at, 10000);
            const Prepared plan(there.planned());  // shares nothing yet
            left = at;
            try {
                plan.run(with);
            } catch (const std::bad_alloc&) {
                ++failed;
            }
            enough = left >= 0;
            left = -1;
            plan.run(with);
            ASSERT_EQ(result, right) << at;
        }
        EXPECT_GT(failed, 5);
    }
}

}  // namespace
}  // namespace edgewise
