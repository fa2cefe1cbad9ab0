// Two threads of one program measure, plan and run requests of their own at once, over the same
// samples and from the same budget: each gets the bytes that it gets alone.
#include <barrier>
#include <cstring>
#include <exception>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <thread>

#include "planner/planner.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(EDGEWISE_THREAD_SANITIZER)
// Debian's oneTBB is not compiled with the sanitizer, which therefore sees no order between a task
// and what was written before it was given away. Without workers each thread does all of its own
// work, and what is left are the accesses of one request against those of the other.
constexpr int kMostThreads = 1, kRounds = 2;
#else
constexpr int kMostThreads = 2, kRounds = 6;
#endif

struct Asked {
    std::string name;
    Job job;
    Mode mode;
    std::string via;  // a step that the path must take, or ""
};

const std::vector<Asked>& all_asked() {
    static const std::vector<Asked> all = {
        {"mip", Job::render, Mode::mip, ""},
        {"warp", Job::warp, Mode::mip, "warp.backward/filter=keys"},
        {"xray", Job::render, Mode::xray, "spectrum.slice"},
    };
    return all;
}

struct Got {
    std::vector<std::string> path;
    std::vector<std::vector<char>> frames;
    friend bool operator==(const Got&, const Got&) = default;
};

Got got(const Asked& asked, std::shared_ptr<const Data> input, int threads, MemoryBudget& memory) {
    const Request want =
        request_of(asked.job, asked.mode, input->what, {rotation(25, -40, 10), rotation(0, 30, 0)});
    const Scene scene = scene_of(*input, want, memory);
    const Catalogue edges = catalogue();
    PlanOptions options;
    if (!asked.via.empty()) options.demands.via.push_back(demand_of(asked.via, edges));
    const Ask ask{want, scene};
    const Answer answer = plan(edges, ask, {{input->what}}, default_profile(edges), options);
    if (!answer.plan) throw std::logic_error(answer.problem);
    Got all{answer.plan->texts(), {}};
    for (const auto& frame : results_of(*answer.plan, ask, std::move(input), threads, memory)) {
        const char* bytes = frame->as<char>();
        all.frames.emplace_back(bytes, bytes + static_cast<std::size_t>(frame->what.bytes()));
    }
    return all;
}

class TwoAtOnce : public ::testing::TestWithParam<std::pair<int, int>> {};

TEST_P(TwoAtOnce, GiveTheBytesThatEachGivesAlone) {
    std::optional<tbb::global_control> no_workers;
    if (kMostThreads == 1)
        no_workers.emplace(tbb::global_control::max_allowed_parallelism, std::size_t{1});
    MemoryBudget memory(std::size_t{1} << 30);
    const auto input = std::make_shared<const Data>(make_phantom("gaussians", 20, &memory));
    const Asked* const asked[2] = {&all_asked()[GetParam().first], &all_asked()[GetParam().second]};
    const std::size_t before = memory.used();

    // At once comes first: what a process makes once (tables, arenas) is made while both ask for
    // it.
    std::vector<Got> at_once[2];
    std::exception_ptr failed[2];
    std::barrier begin(2);
    const auto work = [&](int k) {
        try {
            for (int round = 0; round < kRounds; ++round) {
                begin.arrive_and_wait();
                at_once[k].push_back(got(*asked[k], input, 1 + (round + k) % kMostThreads, memory));
            }
        } catch (...) {
            failed[k] = std::current_exception();
            begin.arrive_and_drop();
        }
    };
    std::thread first(work, 0), second(work, 1);
    first.join();
    second.join();
    for (const std::exception_ptr& each : failed)
        if (each) std::rethrow_exception(each);

    EXPECT_EQ(memory.used(), before) << "bytes that nobody holds any more";
    for (int k = 0; k < 2; ++k) {
        const Got alone = got(*asked[k], input, 1, memory);
        ASSERT_EQ(alone.frames.size(), 2u);
        for (const Got& each : at_once[k])
            EXPECT_TRUE(each == alone) << asked[k]->name << " beside " << asked[1 - k]->name << ": "
                                       << fmt::format("{}", fmt::join(each.path, " "));
    }
}

INSTANTIATE_TEST_SUITE_P(Requests, TwoAtOnce,
                         ::testing::Values(std::pair(2, 2), std::pair(1, 1), std::pair(0, 1),
                                           std::pair(2, 0), std::pair(1, 2)),
                         [](const auto& pair) {
                             return all_asked()[pair.param.first].name + "_" +
                                    all_asked()[pair.param.second].name;
                         });

}  // namespace
}  // namespace edgewise
