// A plan as a value: run again and again, with other samples, from elsewhere, by many threads.
#include "engine/prepared.hpp"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <thread>

#include "graph/errors.hpp"
#include "planner/profile.hpp"
#include "reference/phantoms.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

using Turn = GeometryStep::Kind;
using Pixels = std::vector<float>;

const Engine& engine() {
    static const Engine engine(catalogue(), default_profile());
    return engine;
}

Query mip(double angle, int frames = 1) {
    Query query;
    query.geometry.steps = {{Turn::rotate, {20, angle, 0}}};
    if (frames > 1) query.geometry.steps.push_back({Turn::turntable, {double(frames)}});
    query.geometry.size = OutputSize{.native = true};
    query.max_error = 0.02;
    query.threads = 2;
    return query;
}

/// A block of ones somewhere in zeros, and a little noise everywhere else where it is asked for.
std::shared_ptr<const Data> block(unsigned seed, int side = 24, bool noise = false) {
    Representation what;
    what.type = Type::f32;
    what.axes = 3;
    what.extent = {side, side, side};
    what.space = "object";
    what.content = "scalar";
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::mt19937 bits(seed);
    float* to = data.as<float>();
    for (std::int64_t i = 0; i < what.samples(); ++i)
        to[i] = noise ? static_cast<float>(bits() & 255) / 4096 : 0;
    const auto at = [&] { return static_cast<std::int64_t>(bits() % (side - 6)); };
    const std::int64_t x = at(), y = at(), z = at();
    for (int k = 0; k < 5; ++k)
        for (int j = 0; j < 5; ++j)
            for (int i = 0; i < 5; ++i) *data.at<float>(x + i, y + j, z + k) = 1;
    return std::make_shared<const Data>(std::move(data));
}

Pixels pixels_of(const Prepared& prepared, const RunWith& how = {}) {
    const std::size_t each = static_cast<std::size_t>(prepared.result().bytes()) / sizeof(float);
    Pixels pixels(each * static_cast<std::size_t>(prepared.frames()));
    RunWith with = how;
    with.into = std::as_writable_bytes(std::span(pixels));
    prepared.run(with);
    return pixels;
}

/// The same by a request of its own that goes by the same path.
Pixels alone(Query query, const std::shared_ptr<const Data>& samples, const Prepared& like) {
    query.max_error.reset();
    for (const Step& step : like.plan().steps)
        query.demands.via.push_back({step.by->name, step.offer.with});
    return pixels_of(prepare(engine(), query, samples));
}

TEST(Prepared, RunsAgainAndAgain) {
    const Prepared prepared = prepare(engine(), mip(10, 3), block(1));
    const Pixels first = pixels_of(prepared);
    EXPECT_GT(*std::max_element(first.begin(), first.end()), 0.5f);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(pixels_of(prepared), first) << i;
    std::vector<int> seen;
    prepared.run({.on_frame = [&](const Frame& frame) { seen.push_back(frame.number); }});
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, (std::vector<int>{0, 1, 2}));
    const auto kept = prepared.run({.keep_frames = true}).frames;
    ASSERT_EQ(kept.size(), 3u);
    EXPECT_EQ(0, std::memcmp(kept[2]->samples.data(), &first[first.size() / 3 * 2],
                             first.size() / 3 * sizeof(float)));
    Pixels small(7);
    RunWith wrong;
    wrong.into = std::as_writable_bytes(std::span(small));
    EXPECT_THROW(prepared.run(wrong), RequestError);
}

TEST(Prepared, TakesOtherSamplesOfTheSameShape) {
    const Prepared prepared = prepare(engine(), mip(10), block(1));
    for (unsigned seed = 2; seed < 102; ++seed) {
        const auto samples = block(seed, 24, seed % 3 == 0);
        const Prepared other = prepared.with_input(samples);
        ASSERT_EQ(pixels_of(other), alone(mip(10), samples, other)) << seed;
    }
    EXPECT_THROW(prepared.with_input(block(1, 25)), RequestError);
    EXPECT_THROW(prepared.with_input(nullptr), RequestError);
}

TEST(Prepared, IsSeenFromElsewhere) {
    const auto samples = block(5, 24, true);
    const Prepared prepared = prepare(engine(), mip(10), samples);
    const Pixels here = pixels_of(prepared);
    for (int i = 1; i <= 100; ++i) {
        const Query query = mip(10 + 3.5 * i);
        const Prepared other = prepared.with_views(query.geometry);
        ASSERT_EQ(pixels_of(other), alone(query, samples, other)) << i;
    }
    EXPECT_EQ(pixels_of(prepared), here) << "a plan never changes";
    GeometrySpec wrong = mip(10).geometry;
    wrong.steps[0].numbers = {1, 2};
    EXPECT_THROW(prepared.with_views(wrong), RequestError);
}

TEST(Prepared, SaysWhereThePathHadToChange) {
    Query query = mip(0);
    query.max_error = 0.5;  // the fastest path, which takes no perspective
    const Prepared prepared = prepare(engine(), query, block(3));
    ASSERT_EQ(prepared.plan().steps.back().by->name, "project.shear_warp");
    EXPECT_TRUE(prepared.with_views(mip(5).geometry).warnings().empty());
    GeometrySpec views = query.geometry;
    views.perspective = 40;
    const Prepared near = prepared.with_views(views);
    ASSERT_FALSE(near.warnings().empty());
    EXPECT_NE(near.warnings().front().text().find("project.shear_warp refuses here"),
              std::string::npos);
    const Pixels pixels = pixels_of(near);
    EXPECT_GT(*std::max_element(pixels.begin(), pixels.end()), 0.2f);
}

TEST(Prepared, ItsResultsOutliveIt) {
    std::vector<std::shared_ptr<const Data>> frames;
    Pixels right;
    {
        const Prepared prepared = prepare(engine(), mip(10, 3), block(1));
        right = pixels_of(prepared);
        frames = prepared.run({.keep_frames = true}).frames;
    }
    const std::size_t each = right.size() / frames.size();
    for (std::size_t i = 0; i < frames.size(); ++i)
        EXPECT_EQ(0,
                  std::memcmp(frames[i]->samples.data(), &right[i * each], each * sizeof(float)));
}

TEST(Prepared, ServesManyThreadsAtOnce) {
    const Prepared prepared = prepare(engine(), mip(10, 2), block(1, 32, true));
    const Pixels right = pixels_of(prepare(engine(), mip(10, 2), block(1, 32, true)));
    std::vector<std::thread> threads;
    std::array<int, 8> wrong{};
    for (std::size_t t = 0; t < wrong.size(); ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < 10; ++i) wrong[t] += pixels_of(prepared) != right;
        });
    for (std::thread& thread : threads) thread.join();
    for (const int one : wrong) EXPECT_EQ(one, 0);
}

TEST(Prepared, EndsAtAnyMomentAndRunsAfterwards) {
    const Prepared prepared = prepare(engine(), mip(10, 6), block(1, 40, true));
    const Pixels right = pixels_of(prepared);
    std::mt19937 bits(7);
    int ended = 0;
    for (int i = 0; i < 200; ++i) {
        std::atomic<bool> stop = false;
        RunWith with;
        with.stop = &stop;
        std::thread other([&, wait = bits() % 2000] {
            std::this_thread::sleep_for(std::chrono::microseconds(wait));
            stop = true;
        });
        try {
            const Pixels whole = pixels_of(prepared, with);
            EXPECT_EQ(whole, right);
        } catch (const Cancelled&) {
            ++ended;
        }
        other.join();
    }
    EXPECT_GT(ended, 0);
    EXPECT_EQ(pixels_of(prepared), right);
}

/// What the program holds is its own affair.
TEST(Prepared, CountsWhatItTakesItself) {
    const std::vector<char> held(std::size_t{300} << 20, 1);
    Query query = mip(10);
    query.max_memory = 150 << 20;
    const Prepared prepared = prepare(engine(), query, block(1));
    EXPECT_LT(prepared.plan().predicted.bytes, 150 << 20);
    EXPECT_GT(pixels_of(prepared).size(), 0u);
    EXPECT_EQ(held[held.size() / 2], 1);
    query.max_memory = 1 << 20;
    EXPECT_THROW(prepare(engine(), query, block(1)), Infeasible);
}

TEST(Prepared, SharesWhatAllRunsNeed) {
    Query query = mip(10);
    query.max_error.reset();
    query.demands.via = {{.name = "filter.prefilter"}};
    const Prepared prepared = prepare(engine(), query, block(4, 32, true));
    ASSERT_GT(prepared.plan().steps.size(), 1u);
    std::vector<std::string> first, second;
    prepared.run({.on_progress = [&](double, const std::string& step) { first.push_back(step); }});
    prepared.run({.on_progress = [&](double, const std::string& step) { second.push_back(step); }});
    const auto has = [](const std::vector<std::string>& steps) {
        return std::find(steps.begin(), steps.end(), "filter.prefilter") != steps.end();
    };
    EXPECT_TRUE(has(first));
    EXPECT_FALSE(has(second));
    EXPECT_EQ(pixels_of(prepared), pixels_of(prepared));
}

/// Refuses one allocation.
class Refusing final : public MemoryBudget {
 public:
    Refusing() : MemoryBudget(std::size_t{1} << 30) {}
    std::atomic<int> left = -1;  // allocations before the one that is refused; less than 0: none

 private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        if (left.fetch_sub(1) == 0) throw std::bad_alloc();
        return MemoryBudget::do_allocate(bytes, alignment);
    }
};

/// Out of memory at each allocation in turn: an error, nothing lost, and the plan runs afterwards.
TEST(Prepared, RunsOutOfMemoryCleanly) {
    Query query = mip(10, 2);
    query.demands.via = {{.name = "filter.prefilter"}};
    const Prepared there = prepare(engine(), query, block(1, 32, true));
    const Pixels right = pixels_of(there);
    const auto memory = std::make_shared<Refusing>();
    Planned planned = there.planned();
    planned.memory = memory;
    int refused = 0;
    for (int at = 0; refused == at; ++at) {
        const Prepared prepared(planned);  // shares nothing yet
        memory->left = at;
        try {
            EXPECT_EQ(pixels_of(prepared), right);
        } catch (const std::bad_alloc&) {
            ++refused;
        }
        memory->left = -1;
        EXPECT_EQ(pixels_of(prepared), right) << at;
    }
    EXPECT_GT(refused, 2);
    EXPECT_EQ(memory->used(), 0u);
}

}  // namespace
}  // namespace edgewise
